"""Published values beside measured ones. The numbers stand in the scenario (`[[published]]`), never in code."""

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from ..names import SignalName
from ..problems import Problem, suggestion
from .metrics import Metric

PUBLISHED_KEYS = ("metric", "preset", "value", "tolerance", "where", "status", "claim")
STATUSES = ("stated", "reconstructed", "misprint", "measured")
_RELATIVE_ROUNDING = 1e-12  # of the value: 0.3 within 0.1 of 0.2 must not fail on the last bit


@dataclass(frozen=True)
class PublishedRow:
    """One published value with what was measured. `published` is None for a claim in words only."""

    metric: str
    index: int | None
    claim: str
    preset: str | None
    published: float | None
    measured: float
    tolerance: float | None
    unit: str
    where: str
    status: str
    verdict: Literal["reproduced", "missed", "not judged"]
    reason: str = ""


def split_metric(text: str) -> tuple[str, int | None]:
    """`gap[3]` as ("gap", 3), `settling` as ("settling", None)."""
    name = SignalName(text)
    return name.group, name.number


def check_published(
    entries: Sequence[Mapping[str, Any]],
    metrics: Mapping[str, Collection[int | None]],
    presets: Collection[str],
) -> list[Problem]:
    """Every problem of the [[published]] entries.

    Args:
        entries: the tables as read from the scenario.
        metrics: for every metric the indices it has, (None,) for a single value (`metrics.metric_indices`).
        presets: every valid preset name, the default one included.
    """
    return [
        problem.at(f"[[published]] entry {number} ({entry.get('metric', 'no metric')})")
        for number, entry in enumerate(entries, 1)
        for _, problem in check_entry(entry, metrics, presets)
    ]


def check_entry(
    entry: Mapping[str, Any], metrics: Mapping[str, Collection[int | None]], presets: Collection[str]
) -> Iterator[tuple[str, Problem]]:
    """Every problem of one entry, each with the key that it stands under; the arguments are those of all entries."""
    for key in entry:
        if key not in PUBLISHED_KEYS:
            near = suggestion(key, PUBLISHED_KEYS) or _listed(PUBLISHED_KEYS)
            yield key, Problem("", f"unknown key '{key}'", near)
    for key in ("where", "claim", "preset", "metric", "status"):
        if key in entry and not isinstance(entry[key], str):
            yield key, Problem("", f"{key} must be text, not {entry[key]!r}")
    if not isinstance(entry.get("metric", ""), str) or not isinstance(entry.get("preset", ""), str):
        return
    for problem in _metric_problems(entry, metrics):
        yield "metric", problem
    status, preset = entry.get("status"), entry.get("preset")
    if status not in STATUSES:
        near = suggestion(str(status), STATUSES)
        yield "status", Problem("", f"status must be one of {', '.join(STATUSES)}", near)
    if preset is not None and preset not in presets:
        near = suggestion(preset, presets) or _listed(presets)
        yield "preset", Problem("", f"unknown preset '{preset}'", near)
    yield from _number_problems(entry)


def _metric_problems(entry: Mapping[str, Any], metrics: Mapping[str, Collection[int | None]]) -> Iterator[Problem]:
    if "metric" not in entry:
        yield Problem("", "metric is missing", "name the metric that measures this value")
        return
    name, index = split_metric(entry["metric"])
    if name not in metrics:
        yield Problem("", f"unknown metric '{name}'", suggestion(name, metrics) or _listed(metrics))
        return
    indices = metrics[name]
    if index in indices or not indices:  # none: the metric itself is wrong and has been told
        return
    if None in indices:
        yield Problem("", f"metric '{name}' has a single value", f"leave out [{index}]")
        return
    valid = ", ".join(f"{name}[{i}]" for i in indices)
    yield Problem("", f"metric '{name}' has one value for each i", f"write one of {valid}")


def _number_problems(entry: Mapping[str, Any]) -> Iterator[tuple[str, Problem]]:
    value, tolerance = entry.get("value"), entry.get("tolerance")
    if value is None and "claim" not in entry:
        yield "value", Problem("", "give a value, or a claim in words")
    if value is not None and (not isinstance(value, int | float) or math.isnan(value)):
        message = f"value must be a number, inf or a boolean, not {value!r}"
        yield "value", Problem("", message, "put words into claim")
    if tolerance is not None and (
        isinstance(tolerance, bool) or not isinstance(tolerance, int | float) or not 0 <= tolerance < math.inf
    ):
        message = f"tolerance must be a number >= 0, absolute and in the unit of the metric, not {tolerance!r}"
        yield "tolerance", Problem("", message)


def _listed(names: Collection[str]) -> str:
    return f"there are {', '.join(sorted(names))}" if names else "there are none"


def judge_published(
    entries: Sequence[Mapping[str, Any]],
    metrics: Sequence[Metric],
    preset: str | None,
    modified: bool,
    *,
    default_preset: str | None = None,
    completed: bool = True,
) -> list[PublishedRow]:
    """Set each published value of this preset beside the measured one.

    Args:
        entries: the [[published]] tables, checked.
        metrics: the values of this run.
        preset: the preset that ran; `default_preset` (or None) for the scenario as it stands.
        modified: whether anything was changed beyond the preset (--set, --swap, --step, --stop, ...).
        default_preset: what the scenario calls its values as they stand; entries without `preset` belong to it.
        completed: whether the run reached its stop time.

    Returns:
        A row for every entry of this preset; entries of other presets are left out.
    """
    by_name = {metric.name: metric for metric in metrics}
    current = default_preset if preset is None else preset
    rows = []
    for entry in entries:
        if entry.get("preset", default_preset) != current:
            continue
        name, index = split_metric(entry["metric"])
        metric = by_name.get(name)
        measured = metric.values.get(index, math.nan) if metric else math.nan
        value = None if entry.get("value") is None else float(entry["value"])
        verdict, reason = _judge(entry, value, measured, modified, completed)
        if verdict == "missed" and metric and metric.problem:
            reason = metric.problem
        rows.append(
            PublishedRow(
                metric=entry["metric"],
                index=index,
                claim=entry.get("claim", ""),
                preset=current,
                published=value,
                measured=measured,
                tolerance=entry.get("tolerance"),
                unit=metric.unit if metric else "",
                where=entry.get("where", ""),
                status=entry["status"],
                verdict=verdict,
                reason=reason,
            )
        )
    return rows


def _judge(
    entry: Mapping[str, Any], value: float | None, measured: float, modified: bool, completed: bool
) -> tuple[Literal["reproduced", "missed", "not judged"], str]:
    tolerance: Any = entry.get("tolerance")
    reasons = {
        "a misprint is printed, never judged": entry["status"] == "misprint",
        "the scenario was modified": modified,
        "the run did not reach its stop time": not completed,
        "no number is stated": value is None,
        "no tolerance is given": tolerance is None and not (value is not None and math.isinf(value)),
    }
    for reason, applies in reasons.items():
        if applies:
            return "not judged", reason
    assert value is not None
    if math.isnan(measured):
        return "missed", "the measured value is not a number (NaN)"
    if math.isinf(value) or math.isinf(measured):
        return ("reproduced" if value == measured else "missed"), ""
    close = abs(measured - value) <= tolerance + _RELATIVE_ROUNDING * abs(value)
    return ("reproduced" if close else "missed"), ""
