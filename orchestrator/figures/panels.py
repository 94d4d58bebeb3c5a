"""What the tables of `[[figures]]` say: a figure is one panel, or several `panels` above one another."""

from collections.abc import Mapping, Sequence
from typing import Any

PANEL_KEYS = ("title", "y", "x", "label", "x_label", "y_label", "x_range", "y_range", "bands", "scale")


def panels_of(figure: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """The panels of a figure; what the figure says of x holds for all of them."""
    if "panels" not in figure:
        return [{key: value for key, value in figure.items() if key != "title"}]
    common = {key: figure[key] for key in ("x", "x_label", "x_range") if key in figure}
    return [{**common, **panel} for panel in figure["panels"]]


def share_x(panels: Sequence[Mapping[str, Any]]) -> bool:
    """Whether all panels are drawn over the same."""
    return all(panel.get("x") == panels[0].get("x") for panel in panels)


def texts_of(value: Any) -> list[str]:
    """A text, or a list of texts, as a list; nothing when it is something else."""
    values = value if isinstance(value, list) else [value]
    return values if all(isinstance(x, str) for x in values) else []


def bands_of(panel: Mapping[str, Any]) -> list[list[Any]]:
    """The bands of a panel, one or two ends each."""
    bands = panel.get("bands", [])
    return [band if isinstance(band, list) else [band] for band in bands] if isinstance(bands, list) else []
