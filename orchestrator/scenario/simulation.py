"""`[simulation]`: which keys it has, and what may stand in them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

from ..errors import ScenarioError
from ..master import ALGORITHMS
from ..problems import Problem
from ..system import ACCELERATIONS, LOOPS, UNSETTLED
from ..times import count_steps, digits, is_lost
from .groups import Entry, choice, number, positive, shown, truth, whole, whole_multiple
from .patterns import Counts, members, read_signal

SIMULATION_KEYS = (
    "stop_time",
    "step",
    "start_time",
    "algorithm",
    "record",
    "record_only",
    "seed",
    "order",
    "extrapolation",
    "algebraic_loops",
    "refresh",
    "tolerance",
    "tolerances",
    "max_iterations",
    "relaxation",
    "acceleration",
    "unsettled",
    "min_step",
)
TOLERANCES = "tolerances."
"""A draft holds `[simulation.tolerances]` line by line: the key is this and the signal as written."""

_CHOICES = {
    "algorithm": (ALGORITHMS, "algorithm"),
    "algebraic_loops": (LOOPS, "treatment of algebraic loops"),
    "acceleration": (ACCELERATIONS, "acceleration"),
    "unsettled": (UNSETTLED, "way on where iterations lead nowhere"),
}


def read_simulation(entries: Mapping[str, Entry], origin: str, problems: list[Problem]) -> dict[str, Any]:
    """The values of `[simulation]`, checked; `order` and the signals of `tolerances` are left as written."""
    before = len(problems)
    if "stop_time" not in entries:
        remedy = "say how long to run, in s: stop_time = 350.0"
        problems.append(Problem(origin, "simulation.stop_time is missing", remedy))
    values: dict[str, Any] = {
        key: number(entries[key], problems, 1.0)
        for key in ("stop_time", "step", "start_time", "record")
        if key in entries
    }
    for key, (valid, what) in _CHOICES.items():
        if key in entries:
            values[key] = choice(entries[key], problems, valid, what)
    if "record_only" in entries:
        values["record_only"] = _patterns(entries["record_only"], problems)
        if isinstance(values["record_only"], dict):
            values.setdefault("record", min(values["record_only"].values()))
    if "seed" in entries:
        values["seed"] = read_seed(entries["seed"], problems)
    if len(problems) == before:
        problems += _grid(entries, values)
    return values | _numerics(entries, problems)


def _patterns(entry: Entry, problems: list[Problem]) -> list[str] | dict[str, float]:
    """Which signals are recorded, and how often where that is said for each."""
    value = entry.value
    if value and isinstance(value, dict):
        apart = [Entry(one, entry.origin, f"{entry.place}.{pattern}") for pattern, one in value.items()]
        return dict(zip(value, [positive(one, problems) for one in apart], strict=True))
    if isinstance(value, list) and value and all(isinstance(each, str) and each for each in value):
        return list(value)
    remedy = 'write record_only = ["train*.speed", "cruise[1].force"], or { "train*.speed" = 0.1, "cruise*" = 1.0 }'
    problems.append(entry.problem("is not a list of names, nor a table of names and times in s", remedy))
    return []


def read_seed(entry: Entry, problems: list[Problem]) -> int:
    """The seed of all noise."""
    return whole(entry, problems, lambda value: 0 <= value < 2**63, "a whole number from 0 to 2**63 - 1")


def _numerics(entries: Mapping[str, Entry], problems: list[Problem]) -> dict[str, Any]:
    """What steers extrapolation, iterations and steps of variable length."""
    values: dict[str, Any] = {}
    if "extrapolation" in entries:
        order = "0, 1 or 2, the order of the polynomial by which inputs are continued"
        values["extrapolation"] = whole(entries["extrapolation"], problems, lambda value: value in (0, 1, 2), order)
    if "refresh" in entries:
        values["refresh"] = truth(entries["refresh"], problems)
    if "max_iterations" in entries:
        least = "a whole number, at least 1"
        values["max_iterations"] = whole(entries["max_iterations"], problems, lambda value: value >= 1, least)
    if "tolerance" in entries:
        within = "a number greater than 0 and less than 1"
        values["tolerance"] = number(entries["tolerance"], problems, 0.5, within, lambda value: 0 < value < 1)
    if "relaxation" in entries:
        within = "a number greater than 0 and at most 2"
        values["relaxation"] = number(entries["relaxation"], problems, 1.0, within, lambda value: 0 < value <= 2)
    if "min_step" in entries:
        values["min_step"] = positive(entries["min_step"], problems)
        problems += _shortest(entries)
    pairs = {key: entry for key, entry in entries.items() if key.startswith(TOLERANCES)}
    if pairs:
        values["tolerances"] = {key.removeprefix(TOLERANCES): _pair(entry, problems) for key, entry in pairs.items()}
    return values


def _shortest(entries: Mapping[str, Entry]) -> list[Problem]:
    """What is wrong with a shortest step that is a number, beside a step that is one."""
    unsaid: list[Problem] = []
    step = number(entries["step"], unsaid) if "step" in entries else 0.1
    shortest = positive(entries["min_step"], unsaid)
    if unsaid or step <= 0 or shortest <= step:
        return []
    where = f" ({entries['step'].origin})" if "step" in entries else ""
    longer = f"the shortest step, {digits(shortest)} s, must not be longer than the step, {digits(step)} s{where}"
    return [entries["min_step"].problem(longer)]


def _pair(entry: Entry, problems: list[Problem]) -> list[float]:
    """`[relative, absolute]`."""
    if isinstance(entry.value, list) and len(entry.value) == 2:
        unfit: list[Problem] = []
        pair = [number(Entry(one, ""), unfit, 0.0, "", lambda value: value >= 0) for one in entry.value]
        if not unfit and any(pair):
            return pair
    problems.append(
        entry.problem(f"takes [relative, absolute], two numbers from 0 and not both 0, not {shown(entry.value)}")
    )
    return [0.0, 1.0]


def _grid(entries: Mapping[str, Entry], values: Mapping[str, Any]) -> list[Problem]:
    """What is wrong with the points in time."""
    step, start, stop = values.get("step", 0.1), values.get("start_time", 0.0), values["stop_time"]
    steps_of = f"steps of {digits(step)} s" + (f" ({entries['step'].origin})" if "step" in entries else "")
    if step <= 0:
        return [entries["step"].problem(f"the step must be greater than 0 s, not {digits(step)} s")]
    if stop <= start:
        return [
            entries["stop_time"].problem(
                f"the stop time, {digits(stop)} s, must be later than the start, {digits(start)} s"
            )
        ]
    record = values.get("record")
    problems = list(_apart(entries, values))
    if (
        "algorithm" in values and ALGORITHMS[values["algorithm"]].varies_step
    ):  # a step ends wherever a row or the end is due
        if record is not None and record <= 0:
            return [entries["record"].problem(f"the distance of rows must be greater than 0 s, not {digits(record)} s")]
        return problems
    if is_lost(step, start, stop):
        message = f"points that are {digits(step)} s apart cannot be told apart at such times"
        problems.append(entries["stop_time"].problem(message, "begin nearer to 0 s (simulation.start_time)"))
    elif count_steps(start, stop, step) is None:
        steps = max(1, math.floor((stop - start) / step)) if math.isfinite((stop - start) / step) else 1
        near = " or ".join(f"{digits(start + k * step)} s" for k in (steps, steps + 1))
        message = f"{digits(stop - start, start, stop)} s is not a whole number of {steps_of}"
        problems.append(entries["stop_time"].problem(message, f"change the step, or stop at {near}"))
    if record is not None and not whole_multiple(record, step):
        fitting = max(1, round(record / step)) * step if 0 < record / step < 1e15 else step
        message = f"{digits(record)} s is not a whole number of {steps_of}"
        said, key = (entries["record"], "record") if "record" in entries else (entries["record_only"], "record_only")
        problems.append(said.problem(message, f"take {digits(fitting)} s (simulation.{key})"))
    return problems


def _apart(entries: Mapping[str, Entry], values: Mapping[str, Any]) -> Iterator[Problem]:
    """What is wrong with how often signals are recorded."""
    patterns = values.get("record_only")
    if not isinstance(patterns, dict) or values["record"] <= 0.0:
        return
    for pattern, apart in patterns.items():
        if not whole_multiple(apart, values["record"]):
            rows, fitting = digits(values["record"]), digits(max(1, round(apart / values["record"])) * values["record"])
            message = f"{digits(apart)} s of {pattern!r} is no whole number of rows, which are {rows} s apart"
            remedy = f"take {fitting} s, or a simulation.record that divides all"
            yield entries["record_only"].problem(message, remedy)


def spread_tolerances(entries: Mapping[str, Entry], counts: Counts, problems: list[Problem]) -> dict[str, str]:
    """For every signal that has a tolerance of its own, the key in `entries` that says so; one beats all."""
    lines = []
    for key, entry in entries.items():
        if key.startswith(TOLERANCES):
            try:
                lines.append((read_signal(key.removeprefix(TOLERANCES), counts), key))
            except ScenarioError as error:
                problems += error.at(entry.where)
    lines.sort(key=lambda line: line[0].number is not None)
    return {str(name): key for signal, key in lines for name in members(signal, counts)}


def set_tolerance(entries: dict[str, Entry], text: str, entry: Entry, counts: Counts) -> None:
    """Give a signal a tolerance; what comes later wins, all instances over one and an array over its elements too.

    Raises:
        ScenarioError: there is no such instance.
    """
    signal = read_signal(text, counts)
    for key in [key for key in entries if key.startswith(TOLERANCES)]:
        try:
            if signal.covers(read_signal(key.removeprefix(TOLERANCES), counts)):
                del entries[key]
        except ScenarioError:  # told where it stands
            pass
    entries[TOLERANCES + text] = entry
