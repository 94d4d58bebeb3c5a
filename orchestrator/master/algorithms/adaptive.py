"""Communication steps as long as a tolerance lets them be, by step doubling.

Each step is taken once whole and, from the same saved state, in two halves; the difference estimates the error of the
coupling: of second order in a step where inputs are held, of a higher one where they are continued. The halves are kept
(Hairer, Norsett and Wanner 1993, section II.4).

What happens in the last half, a ball that hits the ground, neither of them sees: an input is that of a step's begin. So
a step that would be accepted is taken whole once more, with the inputs of its end.

An output that may pass inputs on at once shows those of the begin, however short the step is. It is compared with what
its FMU gives when it is shown the same inputs (`repetition`), so that what is left of the difference is of its states.

A jump cannot be stepped over within a tolerance. It is passed in one step of the shortest length, counted and told.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

from ...errors import CouplingError, FmuError, LostError, RunError, StoppedError
from ...fmi import Interface, Variable
from ...names import SignalName
from ...problems import Problem
from ...system import System
from ...times import digits
from ...wiring import Wiring
from ..coupling import Coupling
from .algorithm import Batch, Fit, Operation, VariableStep
from .refusals import cannot, listed
from .repetition import Repetition

_SAFETY, _SMALLEST, _LARGEST = 0.9, 0.2, 5.0
"""How a step may change: of the step that the error estimate asks for, and by which factors at most."""
_AT_END = {1: 3.0, 2: 1.8, 3: 1.9}
"""How many times their error the two halves differ from a step with the inputs of the end, by order, on a smooth
course: polynomials through former points have the error constants 1/2, 5/12, 3/8; with the end -1/2, -1/12, -1/24."""
_SAME_INPUTS = {1: 1.0, 2: 0.6, 3: 0.56}
"""The same for a step with the inputs of the second half throughout: by the same polynomials, half a step apart."""
_MOST_IN_A_ROW = 8
"""So many jumps one shortest step after the other are none: the tolerance cannot be kept."""
_ROUNDING = 1e-9
"""Part of a step that is not worth a step of its own."""
_TOLERANCE = 1e-4
"""Relative tolerance of the error of a step, where the system gives none."""
_TOLD = 100
"""How many jumps are told one by one."""
_SHORTEST = 2.0**-20
"""Part of the longest step that the shortest is, where nothing else is said."""
_APART = 8
"""So many numbers lie in the shortest step at least: seconds since 1970 are 2e-7 s apart, and a step has two halves."""


def is_watched(variable: Variable) -> bool:
    """Whether the error of an output counts."""
    return (variable.type, variable.variability) == ("Real", "continuous")


@dataclass
class Tally:
    """How the steps went.

    How many were ``accepted`` and ``rejected``, the ``shortest`` and ``longest`` in s, and the ``jumps``: time, signal.
    """

    accepted: int = 0
    rejected: int = 0
    shortest: float = math.inf
    longest: float = 0.0
    jumps: list[tuple[float, str]] = field(default_factory=list)


@dataclass(frozen=True)
class _Point:
    """A point to come back to: saved states, values, and what is remembered beside them."""

    states: Sequence[Any]
    values: Sequence[Any]
    memory: Any


class Adaptive(VariableStep):
    """Steps as long as a tolerance lets them be, by step doubling; within each, instances step one after the other."""

    name = "adaptive"
    in_order = True

    def __init__(self, coupling: Coupling) -> None:
        super().__init__(coupling)
        settings, exchange = coupling.settings, coupling.exchange
        self.exchange, self.tally = exchange, Tally()
        self.tolerances = coupling.tolerances(_TOLERANCE)
        self.shortest = settings.stepping.min_step
        self.order = 1 + settings.stepping.extrapolation
        """Of the coupling's error over the whole run."""
        watched = [
            (instance, name)
            for instance, name in exchange.places
            if is_watched(coupling.interfaces[instance].variables[name])
        ]
        self.repetition = Repetition(coupling, watched)
        self.plain = [exchange.places[one] for one in watched if exchange.places[one] not in self.repetition.places]
        """Places of the values whose error counts, but for those that the repetition is for."""
        self._in_a_row = 0

    @classmethod
    def fit(cls, system: System, interfaces: Mapping[str, Interface], wiring: Wiring) -> Fit:
        """States are saved and steps vary, so nothing may count steps."""
        sampled = [name for name, interface in interfaces.items() if interface.sampled]
        others = {name: interface for name, interface in interfaces.items() if name not in sampled}
        problems = [
            *cannot(
                sampled,
                "sampled at points of its own, which adaptive cannot step over",
                "choose gauss-seidel or iterative",
            ),
            *cannot(
                [name for name, interface in others.items() if not interface.can_save_state],
                "the state that adaptive comes back to cannot be saved (canGetAndSetFMUstate is false)",
                "choose gauss-seidel",
            ),
            *cannot(
                [name for name, interface in others.items() if not interface.variable_step],
                "the step cannot vary (canHandleVariableCommunicationStepSize is false)",
                "choose gauss-seidel or iterative",
            ),
            *cannot(
                sorted({link.connection.target for link in wiring.links if link.delay}),
                "a delay counts communication points, which adaptive sets anew at every run",
                "leave the delay out, or choose gauss-seidel",
            ),
        ]
        fed = {link.target[0] for link in wiring.links}
        if fed and not any(is_watched(v) for name in fed for v in interfaces[name].of("output")):
            what = "adaptive has nothing to watch: they have no continuous Real output"
            problems.append(Problem(listed(sorted(fed)), what, "choose gauss-seidel"))
        return Fit(problems, list(_unwatched(system, interfaces)))

    # ---------------------------------------------------------------- on the way

    def advance(self, time: float, until: float, longest: float) -> float:
        """Take one step, as `VariableStep.advance` says."""
        shortest = longest * _SHORTEST if self.shortest is None else self.shortest
        shortest = max(shortest, _APART * math.ulp(max(abs(time), abs(until))))
        begin, rejected = self._keep(), 0
        kept = [begin]
        wanted = min(self.length or longest, longest)
        try:
            while True:
                end, length = _fit(time, wanted, until)
                is_shortest = min(length, wanted) <= shortest * (1.0 + _ROUNDING)
                try:
                    error, place = self._take(time, end, kept)
                except RunError as failure:  # of a shorter step they may be capable
                    if is_shortest or isinstance(failure, StoppedError) or _is_fatal(failure):
                        self.tally.rejected += rejected
                        raise
                    error, place = math.inf, -1
                ideal = _SAFETY * error ** (-1.0 / (self.order + 1)) if error > 0.0 else _LARGEST
                factor = min(_LARGEST, max(_SMALLEST, ideal))
                if error <= 1.0 or (is_shortest and self._is_jump(end, place)):
                    if error > 1.0:
                        factor = _LARGEST
                    elif length > _LARGEST * shortest:
                        self._in_a_row = 0
                    self._let_go(kept)
                    self.tally.rejected += rejected
                    self._accept(length)
                    # A step that was cut short to land on a point says little of how long the next may be.
                    self.length = min(longest, max(length * factor, wanted if factor >= 1.0 else shortest))
                    return end
                rejected += 1
                if is_shortest:
                    self.tally.rejected += rejected
                    self._fail(time, length, error, place)
                self._let_go(kept, but=1)
                self._go_to(begin)
                wanted = max(shortest, length * min(factor, _SAFETY))
        except BaseException:
            for point in kept:
                with suppress(RunError):  # what is told of is what came first
                    self._forget(point)
            raise

    def _sweep(self, time: float, length: float, *, ended: bool = False) -> None:
        """A step that may be taken back, with the inputs of its begin or, ``ended``, the present ones as of its end."""
        for slave in self.coupling.sequence:
            self.coupling.write(slave.name, time, length, ended=ended)
            if not ended:
                self.repetition.note(slave.name, time)
            slave.step(time, length, final=False)
            self.exchange.read_finite(slave, time + length)
        if not ended and self.repetition.places:
            self.repetition.reached = list(self.exchange.values)
        self.coupling.settle(time + length)

    def _take(self, time: float, end: float, kept: list[_Point]) -> tuple[float, int]:
        """Take a step in two halves; its error as `_error` has it, and the place of the value that has it."""
        length, middle = end - time, 0.5 * (time + end)
        values, again = self.exchange.values, self.repetition
        self._sweep(time, length)
        whole = list(values)
        self._go_to(kept[0])
        self._sweep(time, middle - time)
        self._sweep(middle, end - middle)
        halves = list(values)
        found = self._error(self.plain, whole, halves, 2.0**self.order - 1.0)
        if found[0] <= 1.0:
            kept.append(self._keep())
            if again.places:
                self._go_to(kept[0], values=False)
                again.repeat(time, length)
                found = _worse(found, self._error(again.places, values, again.reached, _SAME_INPUTS[self.order]))
                self._go_to(kept[0], values=False)
                values[:] = halves
                again.repeat(time, length, ended=True)
                found = _worse(found, self._error(again.places, values, again.reached, _AT_END[self.order]))
                values[:] = halves
            self._go_to(kept[0], values=False)
            self._sweep(time, length, ended=True)
            found = _worse(found, self._error(self.plain, values, halves, _AT_END[self.order]))
            if not again.is_proven:
                self._go_to(kept[0], values=False)
                again.prove(time, length)
            self._go_to(kept[-1])
        return found

    def _is_jump(self, time: float, place: int) -> bool:
        """Note a jump before a time in s that a value made, unless it is one of too many."""
        self._in_a_row += 1
        if self._in_a_row > _MOST_IN_A_ROW:
            return False
        self.tally.jumps.append((time, self.exchange.signals[place]))
        if self.coupling.extrapolator is not None:
            self.coupling.extrapolator.restart()
        return True

    def _keep(self) -> _Point:
        """The present point, to come back to."""
        states = [slave.save() for slave in self.exchange.slaves.values()]
        memory = self.coupling.extrapolator
        return _Point(states, list(self.exchange.values), memory and memory.save())

    def _go_to(self, point: _Point, *, values: bool = True) -> None:
        for slave, state in zip(self.exchange.slaves.values(), point.states, strict=True):
            slave.restore(state)
        if values:
            self.exchange.values[:] = point.values
        if self.coupling.extrapolator is not None:
            self.coupling.extrapolator.restore(point.memory)

    def _let_go(self, kept: list[_Point], but: int = 0) -> None:
        """Forget points, ``but`` the first ones; a step that ends with one that cannot be forgotten is not counted."""
        while len(kept) > but:
            self._forget(kept.pop(but))

    def _forget(self, point: _Point) -> None:
        for slave, state in zip(self.exchange.slaves.values(), point.states, strict=True):
            slave.forget(state)

    def _error(
        self, places: Iterable[int], other: Sequence[float], kept: Sequence[float], times: float
    ) -> tuple[float, int]:
        """The largest error of kept values relative to its bound, and the place of the value that has it.

        Args:
            places: of the values to compare.
            other: all values by another way.
            kept: those that are kept.
            times: how many times their error the distance is.
        """
        worst, where = 0.0, -1
        for k in places:
            coarse, fine = other[k], kept[k]
            relative, absolute = self.tolerances[k]
            bound = absolute + relative * max(abs(fine), abs(coarse)) + 1e-300
            error = abs(fine - coarse) / times / bound
            if not error <= worst:
                worst, where = (error, k) if math.isfinite(error) else (math.inf, k)
        return worst, where

    def _accept(self, length: float) -> None:
        self.tally.accepted += 1
        self.tally.shortest = min(self.tally.shortest, length)
        self.tally.longest = max(self.tally.longest, length)

    def _fail(self, time: float, length: float, error: float, place: int) -> None:
        relative, absolute = self.tolerances[place]
        name = self.exchange.signals[place]
        lists = ""
        if place in self.plain:
            lists = "; or let its FMU list the input, if this output passes one on at once"
        raise CouplingError(
            f"t = {digits(time)} s: {name} cannot be kept within its tolerance ({relative:g} relative, {absolute:g} "
            f"absolute): its error is {error:.3g} times as large at the shortest step, {digits(length, time)} s; "
            f"loosen simulation.tolerance, or this signal's in [simulation.tolerances], or allow a smaller "
            f"simulation.min_step{lists}"
        )

    # ---------------------------------------------------------------- for the compiled loop

    @property
    def is_decided(self) -> bool:
        """Whether nothing is left to be found out, so that all steps are alike."""
        return self.repetition.is_proven

    @property
    def watched(self) -> list[int]:
        """Places of the values whose error counts, those that the repetition is for behind the others."""
        return [*self.plain, *self.repetition.places]

    def sections(self) -> Sequence[Sequence[Batch]]:
        """What is done at once, in the order of ``native/adaptive.h``; the second is what the coupling settles."""
        of, names, again = Operation, [slave.name for slave in self.coupling.sequence], self.repetition.names
        states = (of.SAVE, of.RESTORE, of.FORGET, of.SAVE_END, of.RESTORE_END, of.FORGET_END)
        return [
            [Batch((of.SET, *[of.NOTE] * (name in again), of.STEP, of.GET), (name,)) for name in names],
            [],
            [Batch((of.SET_OF_END, of.STEP, of.GET), (name,)) for name in names],
            [Batch((of.SHOW, of.STEP), (name,)) for name in again],
            [Batch((of.GET,), again)],
            [Batch((of.SET_OF_END,), again)],
            [Batch((of.STEP,), again)],
            *([Batch((state,), tuple(self.exchange.slaves))] for state in states),
        ]

    def give(self, control: Any, longest: float) -> None:
        """Say how steps are chosen, and how they went: in the fields of ``native/adaptive.h``.

        Args:
            control: a record of them.
            longest: how long a step may be, in s.
        """
        tally, order = self.tally, self.order
        control["shortest"] = longest * _SHORTEST if self.shortest is None else self.shortest
        control["exponent"], control["of_halves"] = -1.0 / (order + 1), 2.0**order - 1.0
        control["of_same"], control["of_end"] = _SAME_INPUTS[order], _AT_END[order]
        control["plain_count"], control["shown_count"] = len(self.plain), len(self.repetition.places)
        control["length"], control["least"], control["most"] = self.length, tally.shortest, tally.longest
        control["accepted"], control["rejected"], control["in_a_row"] = tally.accepted, tally.rejected, self._in_a_row

    def take(self, control: Any) -> None:
        """Go on with how steps went."""
        tally = self.tally
        self.length, tally.shortest, tally.longest = (float(control[name]) for name in ("length", "least", "most"))
        tally.accepted, tally.rejected, self._in_a_row = (int(control[x]) for x in ("accepted", "rejected", "in_a_row"))
        if control["jump"] >= 0:
            tally.jumps.append((float(control["time"]), self.exchange.signals[int(control["jump"])]))

    def report(self) -> dict[str, Any]:
        """Steps taken and their lengths."""
        tally = self.tally
        shortest = None if math.isinf(tally.shortest) else tally.shortest
        count = len(tally.jumps)
        jumps = f"; {count} jump{'s' * (count > 1)}, each passed in a shortest step" if count else ""
        return {
            "accepted": tally.accepted,
            "rejected": tally.rejected,
            "shortest_step": shortest,
            "longest_step": tally.longest,
            "jumps": count,
            "first_jumps": [{"time": time, "signal": signal} for time, signal in tally.jumps[:_TOLD]],
            "summary": f"{tally.accepted} steps accepted, {tally.rejected} rejected, between {shortest or 0.0:.3g} and "
            f"{tally.longest:.3g} s long{jumps}",
        }


def _unwatched(system: System, interfaces: Mapping[str, Interface]) -> Iterable[str]:
    """Tolerances that it has no use for."""
    for signal in system.stepping.tolerances:
        instance, name = SignalName.parse(signal)
        interface = interfaces.get(instance)
        scalars = interface.scalars(name) if interface is not None else None
        if interface is None or scalars is None:  # told elsewhere
            continue
        if not any(is_watched(interface.variables[scalar]) for scalar in scalars):
            yield f"the tolerance of {signal} has no effect: adaptive watches continuous outputs"


def _worse(one: tuple[float, int], other: tuple[float, int]) -> tuple[float, int]:
    """The larger of two errors; the first where they are the same."""
    return other if other[0] > one[0] else one


def _is_fatal(failure: RunError) -> bool:
    """Whether an FMU may not be called any more."""
    return isinstance(failure, LostError) or (isinstance(failure, FmuError) and failure.status == "fatal")


def _fit(time: float, wanted: float, until: float) -> tuple[float, float]:
    """End and length of a step that lands on ``until`` where it comes near, without a tiny rest."""
    left = until - time
    if left <= wanted * (1.0 + _ROUNDING):
        return until, left
    if left < 2.0 * wanted:
        wanted = 0.5 * left
    return time + wanted, time + wanted - time
