"""Couplings that diverge: signals that go round between instances and grow geometrically from step to step.

Explicit algorithms lose a stiff coupling without a word: the numbers grow until one is infinite, or until the run ends.
That is told from physical growth by its pace: what an unstable plant or an accelerating train does between two
communication points is a small part of its value, or the step is too long for it anyway. Slower growth is told where
it shows in `swings` that become larger and larger up to the end, which no coupling of stable systems should do.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from ...errors import FmuError
from ...evaluation import Part
from ...fmi import Interface
from ...master import ALGORITHMS, HAS_KERNEL, SWING, find_loops, note_swings
from ...names import SignalName
from ...system import System
from ...times import digits
from ...wiring import Link, circles, graph_of
from .finding import Finding
from .swings import FEWEST_RISES, VISIBLE, find_swings
from .tail import Tail

Array = NDArray[np.float64]
Points: TypeAlias = Part | Tail

_FACTOR = 1.2
"""Growth in each communication step above which it is not taken for physical; less where the sign alternates."""
_PACE = 1.1
"""The same over a few rows, to find where it began: an oscillation that grows does not do so evenly."""
_ALL = 1e6
"""Growth in all, from the variable's nominal value or what it was before."""
_STEPS, _FAILED_STEPS = 10, 3
"""Communication steps over which it must grow; fewer where an FMU failed of it."""
_WINDOW = 8
"""Rows in which an oscillation is taken to reach its next peak."""
_ASTRONOMIC = 1e30
"""What no quantity in SI units is: then a slower growth is told, too."""
_STEADY = 1e3
"""A factor that is no property of a linear coupling: it changes from step to step."""
_SHOWN = 4


@dataclass(frozen=True)
class Growth:
    """How a signal grows: by which factor in each communication step or swing, and since when in s."""

    factor: float
    since: float


def explain_divergence(
    system: System,
    interfaces: Mapping[str, Interface],
    links: Sequence[Link],
    seen: Sequence[Points],
    error: object = None,
    *,
    suspects: Collection[str] | None = None,
) -> Finding | None:
    """What coupling diverges and what to do about it, if one does.

    Args:
        system: what was simulated.
        interfaces: of its instances.
        links: its scalar connections.
        seen: the run's signals: all that was recorded, or every point at its end.
        error: what the run failed of, if it did.
        suspects: the signals that may be growing; None for all.
    """
    if ALGORITHMS[
        system.stepping.algorithm
    ].varies_step:  # it holds the error or fails, and its rows are of uneven length
        return None
    failed = isinstance(error, FmuError)
    for inner in _cycles(links):
        sources = dict.fromkeys(x.source for x in inner if suspects is None or str(x.source) in suspects)
        for signals in seen:
            found = dict(_growing(sources, interfaces, signals, failed=failed))
            if found:
                factor = float(np.median([growth.factor for growth in found.values()]))
                pace = f"by a factor of {factor:.3g}" if factor < _STEADY else "more than a thousandfold"
                how = f"it grows {pace} per communication step"
                return _finding(found, signals, how, _advice(system, interfaces, inner))
        for signals in () if failed else seen:
            found = dict(_swinging(sources, interfaces, signals))
            if found:
                factor = float(np.median([growth.factor for growth in found.values()]))
                how = f"its swings become larger, each {factor:.3g} times the one before,"
                return _finding(found, signals, how, _advice(system, interfaces, inner))
    return None


def sources_in_cycles(
    system: System, interfaces: Mapping[str, Interface], links: Sequence[Link]
) -> Iterator[SignalName]:
    """The signals of which `explain_divergence` wants to see every point."""
    if not ALGORITHMS[system.stepping.algorithm].varies_step:
        for link in (link for inner in _cycles(links) for link in inner):
            if interfaces[link.source.instance].variables[link.source.variable].type == "Real":
                yield link.source


class Suspicion:
    """Tells signals that may be growing from all others while a run goes: `explain_divergence` need not look at these.

    Args:
        sources: of which every point is shown. interfaces: of the instances.
    """

    def __init__(self, sources: Iterable[SignalName], interfaces: Mapping[str, Interface]) -> None:
        variables = {str(each): interfaces[each.instance].variables[each.variable] for each in sources}
        self._names = list(variables)
        self._sizes = np.array([abs(variable.nominal or 1.0) for variable in variables.values()])
        self._swings = np.zeros(len(self._names), SWING)

    def see(self, number: int, values: Array) -> None:
        """Take the next values of one of them in, shape (T,)."""
        note_swings(self._swings, number, values)

    def suspects(self) -> list[str]:
        """The signals that may be growing; all without the kernel."""
        if not HAS_KERNEL:
            return self._names
        swings, sizes = self._swings, self._sizes
        swinging = (swings["rises"] >= FEWEST_RISES) & (swings["size"] > VISIBLE * sizes)
        return [self._names[k] for k in np.flatnonzero(swinging | (swings["peak"] > _ALL * sizes))]


def _finding(found: Mapping[str, Growth], signals: Points, how: str, advice: str) -> Finding:
    since = min(growth.since for growth in found.values())
    first = next(iter(found))
    values = np.where(np.isfinite(signals[first]), np.abs(signals[first]), 0.0)
    worst = int(np.argmax(values))
    names = ", ".join(list(found)[:_SHOWN]) + (", ..." if len(found) > _SHOWN else "")
    return Finding(
        "diverging",
        tuple(dict.fromkeys(SignalName.parse(name).instance for name in found)),
        first,
        since,
        float(signals[first][worst]),
        float(signals.time[worst]),
        f"the coupling through {names} diverges: {how} since t = {digits(since)} s; {advice}",
    )


def _cycles(links: Sequence[Link]) -> list[list[Link]]:
    """The connections within each group of instances that act on each other, or of one that acts on itself."""
    graph = graph_of((link.source[0], link.target[0]) for link in links)
    groups = {name: k for k, names in enumerate(circles(graph)) for name in names}
    inner: dict[int, list[Link]] = {}
    for link in links:
        if groups[link.source[0]] == groups[link.target[0]]:
            inner.setdefault(groups[link.source[0]], []).append(link)
    return list(inner.values())


def _sized(
    sources: Iterable[SignalName], interfaces: Mapping[str, Interface], signals: Points
) -> Iterator[tuple[str, float]]:
    """The real numbers among the sources, and what a usual size of each is."""
    for source in sources:
        variable, name = interfaces[source.instance].variables[source.variable], str(source)
        if variable.type == "Real" and name in signals.names():
            yield name, abs(variable.nominal or 1.0)


def _growing(
    sources: Iterable[SignalName], interfaces: Mapping[str, Interface], signals: Points, *, failed: bool
) -> Iterator[tuple[str, Growth]]:
    for name, size in _sized(sources, interfaces, signals):
        growth = find_growth(signals.time, signals[name], signals.step, size=size, failed=failed)
        if growth is not None:
            yield name, growth


def _swinging(
    sources: Iterable[SignalName], interfaces: Mapping[str, Interface], signals: Points
) -> Iterator[tuple[str, Growth]]:
    for name, size in _sized(sources, interfaces, signals):
        swings = find_swings(signals[name], size)
        if swings is not None:
            yield name, Growth(swings.factor, float(signals.time[swings.begin]))


def find_growth(time: Array, values: Array, step: float, *, size: float = 1.0, failed: bool = False) -> Growth | None:
    """How a signal grows at the end of a run, if it does so geometrically and beyond measure.

    Args:
        time: shape (T,), s.
        values: shape (T,).
        step: the communication step, s.
        size: what is a usual size of it.
        failed: whether an FMU failed afterwards, so that less of it needs to be seen.
    """
    finite = np.isfinite(values)
    time, values = time[finite], values[finite]
    peaks = np.maximum.accumulate(np.abs(values))
    if len(values) < 3 or not peaks[-1] > _ALL * size:
        return None
    visible = int(np.searchsorted(peaks, 1e-3 * size))  # what happens to rounding errors is not worth a word
    for onset, fastest in ((_swing(values), 1.0), (_onset(time, peaks, step), _FACTOR), (_slow_onset(peaks), 1.0)):
        if onset is None:
            continue
        begin = max(onset, visible)
        steps = (time[-1] - time[begin]) / step
        grown = peaks[-1] / max(peaks[begin], size)
        if grown > _ALL and steps > (_FAILED_STEPS if failed else _STEPS) - 0.5:
            middle = (begin + len(peaks) - 1) // 2  # at the begin, what grows is hidden in what was there
            factor = math.exp(math.log(peaks[-1] / peaks[middle]) * step / (time[-1] - time[middle]))
            if factor > fastest:
                return Growth(factor, float(time[begin]))
    return None


def _swing(values: Array) -> int | None:
    """Where values begin that have another sign than the one before, and are larger, up to the last."""
    signs, sizes = np.sign(values), np.abs(values)
    other = (signs[1:] * signs[:-1] < 0.0) & (sizes[1:] > sizes[:-1])
    calm = np.flatnonzero(~other)
    begin = int(calm[-1]) + 1 if calm.size else 0
    return begin if len(values) - begin > _STEPS else None


def _onset(time: Array, peaks: Array, step: float) -> int | None:
    """Where peaks begin to grow at `_PACE` at least in every few rows, up to the last."""
    width = min(_WINDOW, (len(peaks) - 1) // 2)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        growth = np.log(peaks[width:]) - np.log(peaks[:-width])
    slow = np.flatnonzero(~(growth >= math.log(_PACE) * (time[width:] - time[:-width]) / step))
    if not slow.size:
        return 0
    begin = int(slow[-1]) + 1
    return begin if begin < len(peaks) - width else None


def _slow_onset(peaks: Array) -> int | None:
    """Where peaks that end beyond all measure left a usual size, if they grew in each quarter of the time since."""
    if peaks[-1] < _ASTRONOMIC:
        return None
    begin = int(np.searchsorted(peaks, 1e-20 * peaks[-1]))
    quarters = np.log(peaks[np.linspace(begin, len(peaks) - 1, 5).astype(int)])
    return begin if (np.diff(quarters) > 0.1 * (quarters[-1] - quarters[0])).all() else None


def _advice(system: System, interfaces: Mapping[str, Interface], links: Sequence[Link]) -> str:
    """What to do about a cycle of instances."""
    interfaces = {name: interfaces[name] for link in links for name in (link.source.instance, link.target.instance)}
    members = interfaces.values()
    moving = any(interface.interpolates_inputs for interface in members)
    ways = ["take a smaller step"]
    if ALGORITHMS[system.stepping.algorithm].solves_loops:
        ways += ["let inputs move over it by extrapolation = 1"] if moving and not system.stepping.extrapolation else []
    elif system.stepping.algebraic_loops == "delay" and find_loops(interfaces, links, doubtful=True):
        ways = ['let its algebraic loop be solved at each communication point by algebraic_loops = "solve"']
    elif all(interface.can_save_state or interface.sampled for interface in members):
        ways += ['algorithm = "iterative"' + (" with extrapolation = 1" if moving else "")]
    return f"{', or '.join(ways)}; if it grows alike with any, the system itself is unstable"
