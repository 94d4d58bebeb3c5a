"""Recorded results side by side, of runs and files of any tool: signal by signal, in tubes around a reference."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np

from .. import world
from ..errors import ScenarioError
from ..evaluation import without_blanks
from ..figures import remove_drawn
from ..names import matching
from ..problems import suggestion
from ..run import RESULT_ENDINGS, Results
from .deviations import Deviation, RecordedComparison, Tested
from .tube_figures import draw_tubes
from .tubes import Array, Tube, departure

TOLERANCE, NOMINAL = 0.002, 1e-3


def is_recorded(name: str | Path) -> bool:
    """Whether a name is that of results: a file with an ending of theirs, or the directory of a run."""
    path = Path(name)
    return path.suffix.lower() in RESULT_ENDINGS or (path / "run.json").is_file()


def compare_recorded(
    paths: Sequence[str | Path],
    *,
    tolerance: float = TOLERANCE,
    time_tolerance: float | None = None,
    nominal: float = NOMINAL,
    signals: Collection[str] = (),
    output: str | Path | None = None,
    figures: bool = True,
) -> RecordedComparison:
    """Compare recorded results with those that are named first.

    Args:
        paths: directories of runs, and files of any tool (CSV, Parquet, HDF5, MAT).
        tolerance: half the height of the tube as part of a signal's range, and half its width as part of the duration.
        time_tolerance: half its width in s instead.
        nominal: the range that a signal is taken to have at least, in its unit; that of one that stands still says
            nothing.
        signals: patterns of those to compare, such as ``train*.speed``; all that both have by default.
        output: directory for ``compare.json``, ``compare.csv`` and figures.
        figures: whether to draw there those that depart most.

    Raises:
        ScenarioError: something cannot be read, or nothing can be compared.
    """
    if len(paths) < 2:
        raise ScenarioError("name two results or more: the first is what the others are compared with")
    reference, *others = (_loaded(Path(path)) for path in paths)
    width = tolerance * float(reference.time[-1] - reference.time[0]) if time_tolerance is None else time_tolerance
    chosen = _chosen(reference, signals, str(paths[0]))
    limits = {name: Tube(width, tolerance * _range(reference, name, nominal)) for name in chosen}
    tested = [_tested(str(path), reference, other, limits) for path, other in zip(paths[1:], others, strict=True)]
    comparison = RecordedComparison(str(paths[0]), reference, tested)
    if output is not None:
        _write(comparison, Path(output), figures)
    return comparison


def _loaded(path: Path) -> Results:
    found = Results.load(path)
    back = np.flatnonzero(~(np.diff(found.time) >= 0.0))
    if not found.points or len(back) or not np.isfinite(found.time[[0, -1]]).all():
        row = f"goes back after row {back[0] + 1}" if len(back) else "has no points, or no finite ones"
        raise ScenarioError(f"{path} cannot be compared: its time {row}")
    return found


def _chosen(reference: Results, patterns: Collection[str], name: str) -> list[str]:
    """The signals of the reference that patterns ask for; in names brackets are what they are, and no patterns."""
    for pattern in patterns:
        if not matching(reference, [pattern]):
            near = suggestion(pattern, reference)
            raise ScenarioError(f"{name} has no signal {pattern}" + (f"; {near}" if near else ""))
    return matching(reference, patterns or ["*"])


def _is_number(results: Results, name: str) -> bool:
    return results[name].dtype.kind in "fiub"


def _range(reference: Results, name: str, nominal: float) -> float:
    """How far a signal goes, but never nothing."""
    values = reference[name] if _is_number(reference, name) else np.zeros(1)
    finite = values[np.isfinite(values)].astype(float)
    return max(float(np.ptp(finite)) if len(finite) else 0.0, nominal)


def _within(begin: float, end: float, time: Array, values: Array) -> tuple[Array, Array]:
    within = (time >= begin) & (time <= end)
    return time[within], values[within]


def _tested(name: str, reference: Results, other: Results, limits: Mapping[str, Tube]) -> Tested:
    begin, end = float(reference.time[0]), float(reference.time[-1])
    width = next((tube.width for tube in limits.values()), 0.0)
    within = (other.time >= begin) & (other.time <= end)
    common = [signal for signal in limits if signal in other]
    numbers = [signal for signal in common if _is_number(reference, signal) and _is_number(other, signal)]
    if not numbers or not within.any():
        what = "no signal in common" if not numbers else "no point within the time"
        raise ScenarioError(
            f"{name} has {what} of {len(limits)} signals from {begin:.6g} to {end:.6g} s to compare with"
        )
    parts = {
        signal: _within(begin, end, *without_blanks(other.time, other[signal].astype(float))) for signal in numbers
    }
    without = [signal for signal in numbers if not len(parts[signal][0])]
    numbers = [signal for signal in numbers if signal not in without]
    if not numbers:
        raise ScenarioError(f"{name} has no value of {', '.join(without)} from {begin:.6g} to {end:.6g} s")
    deviations = [
        Deviation(
            signal,
            reference.units.get(signal, ""),
            limits[signal],
            departure(*without_blanks(reference.time, reference[signal].astype(float)), *parts[signal], limits[signal]),
        )
        for signal in numbers
    ]
    notes = [f"{signal} has no value in {name} from {begin:.6g} to {end:.6g} s" for signal in without]
    for called, results in (("the reference", reference), (name, other)):
        few = {signal: len(without_blanks(results.time, results[signal])[0]) for signal in numbers}
        notes += [
            f"{signal} has values at 2 of {results.points} points of {called}"
            for signal, count in few.items()
            if count == 2 < results.points
        ]
    notes += [
        f"{signal} is in {mine} in the reference and in {theirs} in {name}: compared as plain numbers"
        for signal in numbers
        if (mine := reference.units.get(signal)) and (theirs := other.units.get(signal)) and mine != theirs
    ]
    notes += [
        f"{signal} holds texts, which are not compared"
        for signal in common
        if not _is_number(reference, signal) or not _is_number(other, signal)
    ]
    beyond = int(np.count_nonzero(~within))
    if beyond:
        notes.append(f"{beyond} points of {name} are outside the time of the reference, and not compared")
    first, last = float(other.time[0]), float(other.time[-1])
    covered = first <= begin + width and last >= end - width
    return Tested(
        name,
        other,
        sorted(deviations, key=lambda one: -one.relative),
        [signal for signal in limits if signal not in other],
        [signal for signal in other if signal not in reference],
        notes,
        ""
        if covered
        else f"it has the time from {first:.6g} to {last:.6g} s alone, the reference {begin:.6g} to {end:.6g}",
    )


# -------------------------------------------------------------------- files


def _write(comparison: RecordedComparison, directory: Path, figures: bool) -> None:
    comparison.directory = directory
    world.mkdir(directory, parents=True, exist_ok=True)
    remove_drawn(directory / "compare.json")
    if figures:
        comparison.figures = draw_tubes(comparison, directory)
    content = {
        "reference": comparison.reference,
        "same": comparison.same,
        "tested": [
            {
                "name": one.name,
                "same": one.same,
                "short": one.short,
                "lacking": one.lacking,
                "more": one.more,
                "notes": one.notes,
                "signals": [
                    {"signal": row.signal, "unit": row.unit, "inside": row.inside}
                    | {key: _finite(value) for key, value in (asdict(row.tube) | asdict(row.departure)).items()}
                    for row in one.deviations
                ],
            }
            for one in comparison.tested
        ],
        "figures": [path.name for path in comparison.figures],
    }
    text = json.dumps(content, indent=1, ensure_ascii=False) + "\n"
    world.write_text(directory / "compare.json", text, encoding="utf-8", errors="backslashreplace")
    with world.open(directory / "compare.csv", "w", newline="", encoding="utf-8", errors="backslashreplace") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(["results", "signal", "unit", "inside", "distance", "height", "at", "outside", "points"])
        for one in comparison.tested:
            for row in one.deviations:
                told = row.departure
                numbers = (told.distance, row.tube.height, told.at)
                cells = [one.name, row.signal, row.unit, "yes" if row.inside else "no", *map(repr, numbers)]
                writer.writerow([*cells, told.outside, told.points])


def _finite(value: float) -> float | str:
    return value if math.isfinite(value) else repr(value)
