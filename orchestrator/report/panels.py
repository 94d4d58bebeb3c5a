"""The panels that the figures of a scenario ask for, with the curves of one run or of several."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ..errors import RailcosimError
from ..figures import bands_of, bracketed, curves_of, filled_title, marks_of, number, panels_of, x_label_of
from .content import Columns, Content, requirements_of
from .live import tracks_of


@dataclass(frozen=True)
class _Shown:
    """One of the runs of a page.

    Attributes:
        content: of it. run: its number. prefix: what its curves are told apart by, where there are several.
        decided: of each requirement that an instant decided, the signals it looked at then, and what is marked there.
    """

    content: Content
    run: int
    prefix: str
    decided: Sequence[tuple[frozenset[str], Mapping[str, Any]]]


def panels(contents: Sequence[Content], names: Sequence[str], columns: Columns) -> list[dict[str, Any]]:
    """The panels that the first run's figures ask for, with the curves of all runs.

    Args:
        contents: the runs.
        names: what each is called where there are several.
        columns: to which computed curves are added.
    """
    several = len(contents) > 1
    runs = [
        _Shown(content, run, names[run] if several else "", _decided(content)) for run, content in enumerate(contents)
    ]
    found = []
    for figure in contents[0].results.figures:
        for panel in panels_of(figure):
            lines = [line for shown in runs for line in _lines(shown, panel, columns)]
            if lines:
                found.append(_panel(figure, panel, lines, contents[0]))
    return found


def _panel(
    figure: Mapping[str, Any], panel: Mapping[str, Any], lines: list[dict[str, Any]], first: Content
) -> dict[str, Any]:
    units = {line["unit"] for line in lines}
    told: dict[str, Any] = {
        "title": _title(panel, first) or str(figure["title"]),
        "label": str(panel.get("y_label", "")) or (bracketed(units.pop()) if len(units) == 1 else ""),
        "lines": lines,
        "levels": [],
        "marks": [],
    }
    told |= {key: panel[key] for key in ("x_range", "y_range", "y_log") if key in panel}
    if panel.get("x") is not None:
        told |= {"over": "another", "x_label": str(panel.get("x_label", "")) or _safe(x_label_of, panel, first, "")}
        told |= {"x_log": True} if panel.get("x_log") else {}
    scale = float(panel.get("scale", 1.0))
    for band in bands_of(panel):
        ends = [_safe(number, end, first, None) for end in band]
        told["levels"] += [[scale * end for end in ends]] if None not in ends else []
    for mark in marks_of(panel):
        x, y = (_safe(number, mark[key], first, None) if key in mark else None for key in ("x", "y"))
        told["marks"].append({"x": x, "y": None if y is None else scale * y, "label": str(mark.get("label", ""))})
    return told


def _title(panel: Mapping[str, Any], first: Content) -> str:
    return str(_safe(filled_title, panel, first, str(panel.get("title", ""))))


def _safe(of: Any, what: Any, content: Content, other: Any) -> Any:
    """What is told of a run, or else what is said where it was cut short and lacks something."""
    try:
        return of(what, content.results)
    except RailcosimError:
        return other


def _lines(shown: _Shown, panel: Mapping[str, Any], columns: Columns) -> Iterator[dict[str, Any]]:
    """The curves of a panel in one run."""
    content, prefix = shown.content, shown.prefix
    try:
        curves = curves_of(panel, content.results)
    except RailcosimError:  # what a run that was cut short does not have
        return
    scale = float(panel.get("scale", 1.0))
    over_time, stepwise = panel.get("x") is None, content.stepwise
    tracks = tracks_of(panel, content.results) if columns.live else [{}] * len(curves)
    for k, (curve, track) in enumerate(zip(curves, tracks, strict=True)):
        label = curve.label.replace("\\$", "$")
        recorded = curve.signals & content.places.keys()
        line: dict[str, Any] = {
            "label": f"{prefix}: {label}" if prefix else label,
            "run": shown.run,
            "look": [shown.run, k] if prefix else [k, 0],
            "unit": curve.unit if scale == 1.0 else "",
        }
        if curve.plain and over_time and scale == 1.0 and len(recorded) == 1:  # whole, however many points there are
            line["column"] = content.places[next(iter(recorded))]
        else:
            line["column"] = columns.add(curve.y * scale)
            line |= {} if over_time and len(curve.y) == content.results.points else {"x": columns.add(curve.x)}
        line |= track
        line |= {"steps": True} if over_time and recorded and recorded <= stepwise else {}
        marked = [told for signals, told in shown.decided if recorded and recorded <= signals]
        yield line | ({"decided": marked} if marked else {})


def _decided(content: Content) -> list[tuple[frozenset[str], dict[str, Any]]]:
    return [
        (frozenset(told["signals"]), {key: told[key] for key in ("name", "verdict", "margin", "time")})
        for told in requirements_of(content)
        if told["time"] is not None
    ]
