"""What the tables of `[[figures]]` say: a figure is one panel, or several `panels` above one another."""

import re
from collections.abc import Mapping, Sequence
from typing import Any

PANEL_KEYS = (
    *("title", "y", "x", "label", "x_label", "y_label", "x_range", "y_range", "x_log", "y_log"),
    *("bands", "marks", "scale"),
)
FIGURE_KEYS = ("remark", "format", "dpi")
"""What a figure may say beside what a panel may: a line under its title, and how it is written."""
X_KEYS = ("x", "x_label", "x_range", "x_log")
"""What all panels of a figure may have in common."""
FORMATS = ("png", "svg", "pdf")


def panels_of(figure: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """The panels of a figure; what the figure says of x holds for all of them."""
    if "panels" not in figure:
        return [{key: value for key, value in figure.items() if key not in ("title", *FIGURE_KEYS)}]
    common = {key: figure[key] for key in X_KEYS if key in figure}
    return [{**common, **panel} for panel in figure["panels"]]


def heading(figure: Mapping[str, Any]) -> str:
    """What stands above a figure: its title, and its remark in a line below."""
    return "\n".join(filter(None, (figure["title"], figure.get("remark", ""))))


def remarked(figures: Sequence[Mapping[str, Any]], remark: str) -> list[dict[str, Any]]:
    """The figures with another remark; none where it is empty."""
    others = [{key: value for key, value in figure.items() if key != "remark"} for figure in figures]
    return [figure | ({"remark": remark} if remark else {}) for figure in others]


def share_x(panels: Sequence[Mapping[str, Any]]) -> bool:
    """Whether all panels are drawn over the same."""
    return all(panel.get("x") == panels[0].get("x") for panel in panels)


def texts_of(value: Any) -> list[str]:
    """A text, or a list of texts, as a list; nothing when it is something else."""
    values = value if isinstance(value, list) else [value]
    return values if all(isinstance(x, str) for x in values) else []


def numbers_in(title: str) -> list[str]:
    """The expressions between braces in a panel's title; one with mathematics has none."""
    return [] if "$" in title else re.findall(r"\{([^{}]+)\}", title)


def bands_of(panel: Mapping[str, Any]) -> list[list[Any]]:
    """The bands of a panel, one or two ends each."""
    bands = panel.get("bands", [])
    return [band if isinstance(band, list) else [band] for band in bands] if isinstance(bands, list) else []


def marks_of(panel: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """The marks of a panel."""
    marks = panel.get("marks", [])
    return [mark for mark in marks if isinstance(mark, Mapping)] if isinstance(marks, list) else []


def written_as(figures: Sequence[Mapping[str, Any]], format: str | None, dpi: float | None) -> list[dict[str, Any]]:
    """The figures with another format or resolution than they ask for; None leaves it."""
    wanted = {key: value for key, value in (("format", format), ("dpi", dpi)) if value is not None}
    return [{**figure, **wanted} for figure in figures]
