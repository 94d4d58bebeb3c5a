"""Values known before a run, beside the measured ones: printed by a source, or our own.

They stand in the scenario, never in code: `[[published]]` holds what a source printed, `[[references]]` what somebody's
own integration gave. Every row says which (`origin`), and the two are counted apart.
"""

import math
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

from ..names import SignalName
from ..problems import Problem, suggestion
from .metrics import Metric

REFERENCE_KEYS = ("metric", "preset", "value", "tolerance", "where", "claim", "departs")
PUBLISHED_KEYS = (*REFERENCE_KEYS, "origin")
ORIGINS = ("stated", "fitted", "reconstructed", "misprint")
REFERENCE = "reference"
ALLOWANCES = ("rounding", "sampling", "noise")
_RELATIVE_ROUNDING = 1e-12  # of the value: 0.3 within 0.1 of 0.2 must not fail on the last bit

Outcome = Literal["reproduced", "missed", "departs", "departs no more", "not judged"]
UNJUDGED_RUN = ("the scenario was modified", "the run did not reach its stop time")
"""Why nothing of a whole run is judged."""
BAD = ("missed", "departs no more")
"""The verdicts that cost the exit code. A known departure does not; one that has come to hold does, until the entry
that says otherwise is mended."""


@dataclass(frozen=True)
class ComparedValue:
    """One known value with what was measured.

    `value` is None for a claim in words only. `tolerance` is the sum of `allowances`: the rounding of the known value,
    the cost of sampling, and how far random numbers move it. `origin` is one of `ORIGINS`, or `REFERENCE`. `departs`
    is why the value is known not to be met; `reason` why it is not judged, or what else there is to say. `judges_truth`
    says that the value is true or false, not a number.
    """

    metric: str
    index: int | None
    claim: str
    preset: str | None
    value: float | None
    measured: float
    tolerance: float | None
    unit: str
    where: str
    origin: str
    verdict: Outcome
    reason: str = ""
    departs: str = ""
    allowances: dict[str, float] = field(default_factory=dict)
    judges_truth: bool = False


def split_metric(text: str) -> tuple[str, int | None]:
    """`gap[3]` as ("gap", 3), `settling` as ("settling", None)."""
    name = SignalName(text)
    return name.group, name.number


def count_values(rows: Sequence[ComparedValue]) -> dict[str, Counter[str]]:
    """How many values of each origin have which verdict; origins without a value are left out."""
    return {
        origin: Counter(row.verdict for row in rows if row.origin == origin)
        for origin in (*ORIGINS, REFERENCE)
        if any(row.origin == origin for row in rows)
    }


def check_values(
    published: Sequence[Mapping[str, Any]],
    references: Sequence[Mapping[str, Any]],
    metrics: Mapping[str, Collection[int | None]],
    presets: Collection[str],
) -> list[Problem]:
    """Every problem of the [[published]] and [[references]] entries.

    Args:
        published: the [[published]] tables as read from the scenario.
        references: the [[references]] tables.
        metrics: for every metric the indices it has, (None,) for a single value (`metrics.metric_indices`).
        presets: every valid preset name, the default one included.
    """
    return [
        problem.at(f"[[{section}]] entry {number} ({entry.get('metric', 'no metric')})")
        for section, entries in (("published", published), ("references", references))
        for number, entry in enumerate(entries, 1)
        for _, problem in check_entry(entry, section, metrics, presets)
    ]


def check_entry(
    entry: Mapping[str, Any], section: str, metrics: Mapping[str, Collection[int | None]], presets: Collection[str]
) -> Iterator[tuple[str, Problem]]:
    """Every problem of one entry of a section, each with the key that it stands under; else as `check_values`."""
    keys = PUBLISHED_KEYS if section == "published" else REFERENCE_KEYS
    for key in entry:
        if key not in keys:
            yield key, unknown_key(key, section)
    for key in ("where", "claim", "preset", "metric", "departs"):
        if key in entry and (not isinstance(entry[key], str) or (key == "departs" and not entry[key])):
            yield key, Problem("", f"{key} must be text, not {entry[key]!r}")
    if not isinstance(entry.get("metric", ""), str) or not isinstance(entry.get("preset", ""), str):
        return
    for problem in _metric_problems(entry, metrics):
        yield "metric", problem
    origin, preset = entry.get("origin"), entry.get("preset")
    if section == "published" and origin not in ORIGINS:
        near = suggestion(str(origin), ORIGINS) or "a value that no source printed stands under [[references]]"
        yield "origin", Problem("", f"origin must be one of {', '.join(ORIGINS)}", near)
    if preset is not None and preset not in presets:
        near = suggestion(preset, presets) or _listed(presets)
        yield "preset", Problem("", f"unknown preset '{preset}'", near)
    yield from _number_problems(entry)
    if "departs" in entry and (entry.get("value") is None or origin == "misprint"):
        yield "departs", Problem("", "only a value that is judged can depart", "leave departs out")


def unknown_key(key: str, section: str) -> Problem:
    """What to say of a key that an entry of this section cannot have."""
    keys = PUBLISHED_KEYS if section == "published" else REFERENCE_KEYS
    near = suggestion(key, keys) or _listed(keys)
    if key == "status":
        near = f"origin = one of {', '.join(ORIGINS)} says where a published value comes from"
    elif key == "origin":
        near = "a value of one's own has none; what a source printed stands under [[published]]"
    return Problem("", f"unknown key '{key}'", near)


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
    if isinstance(tolerance, dict):
        for part, size in tolerance.items():
            if part not in ALLOWANCES:
                near = suggestion(part, ALLOWANCES) or f"its parts are {', '.join(ALLOWANCES)}"
                yield "tolerance", Problem("", f"unknown part '{part}' of the tolerance", near)
            elif not _is_size(size):
                yield "tolerance", Problem("", f"{part} must be a number >= 0, not {size!r}")
    elif tolerance is not None and not _is_size(tolerance):
        message = f"tolerance must be a number >= 0, absolute and in the unit of the metric, not {tolerance!r}"
        yield "tolerance", Problem("", message, "or its parts, as in { rounding = 0.05, sampling = 0.02 }")


def _is_size(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and 0 <= value < math.inf


def _listed(names: Collection[str]) -> str:
    return f"there are {', '.join(sorted(names))}" if names else "there are none"


def judge_values(
    entries: Sequence[Mapping[str, Any]],
    metrics: Sequence[Metric],
    preset: str | None,
    modified: bool,
    *,
    default_preset: str | None = None,
    completed: bool = True,
) -> list[ComparedValue]:
    """Set each known value of this preset beside the measured one.

    Args:
        entries: the [[published]] tables, or the [[references]], checked.
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
    of_all = UNJUDGED_RUN[0] if modified else "" if completed else UNJUDGED_RUN[1]
    rows = []
    for entry in entries:
        if entry.get("preset", default_preset) != current:
            continue
        name, index = split_metric(entry["metric"])
        metric = by_name.get(name)
        measured = metric.values.get(index, math.nan) if metric else math.nan
        value = None if entry.get("value") is None else float(entry["value"])
        allowances, tolerance = _tolerance(entry)
        verdict, reason = _judge(entry, value, tolerance, measured, of_all)
        if verdict == "missed" and metric and metric.problem:
            reason = metric.problem
        rows.append(
            ComparedValue(
                metric=entry["metric"],
                index=index,
                claim=entry.get("claim", ""),
                preset=current,
                value=value,
                measured=measured,
                tolerance=tolerance,
                unit=metric.unit if metric else "",
                where=entry.get("where", ""),
                origin=entry.get("origin", REFERENCE),
                verdict=verdict,
                reason=reason,
                departs=entry.get("departs", ""),
                allowances=allowances,
                judges_truth=isinstance(entry.get("value"), bool),
            )
        )
    return rows


def _tolerance(entry: Mapping[str, Any]) -> tuple[dict[str, float], float | None]:
    """The parts of a tolerance, where they are named, and their sum; a boolean is met exactly."""
    given = entry.get("tolerance")
    if isinstance(given, dict):
        return {part: float(size) for part, size in given.items()}, float(sum(given.values()))
    return {}, 0.0 if given is None and isinstance(entry.get("value"), bool) else given


def _judge(
    entry: Mapping[str, Any], value: float | None, tolerance: float | None, measured: float, of_all: str
) -> tuple[Outcome, str]:
    """The verdict and what there is to say of it; `of_all` is why nothing of this run is judged."""
    reasons = {
        of_all: bool(of_all),
        "a misprint is printed, never judged": entry.get("origin") == "misprint",
        "no number is stated": value is None,
        "no tolerance is given": tolerance is None and not (value is not None and math.isinf(value)),
    }
    for reason, applies in reasons.items():
        if applies:
            return "not judged", reason
    assert value is not None
    known = entry.get("departs", "")
    if math.isnan(measured):
        return "missed", "the measured value is not a number (NaN)"
    if math.isinf(value) or math.isinf(measured):
        close = value == measured
    else:
        close = abs(measured - value) <= (tolerance or 0.0) + _RELATIVE_ROUNDING * abs(value)
    if not known:
        return ("reproduced" if close else "missed"), ""
    if close:
        return "departs no more", f"the entry says that it departs ({known}); mend the entry"
    return "departs", known
