"""One instance as matrices: from its FMU's directional derivatives, or from finite differences over a step.

A continuous block is x' = A x + B u, y = C x + D u, from `fmi2GetDirectionalDerivative` and the rates ``der(x)``. What
has memory, or gives no derivatives, is stepped from saved states that differ a little.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from ..errors import ScenarioError
from ..fmi import Model, Slave, state_names, take_snapshot
from ..fmi.binding import FmuSlave

Array = NDArray[np.float64]
Way = Literal["derivatives", "differences", "source"]

_FIRST_STEP = 1e-3
"""First step of the finite differences, relative to the value's size above 1."""
_HALVINGS = 6
_ROUGH = 1e-3
"""Relative disagreement of difference quotients above which a column is called rough."""


@dataclass(frozen=True)
class Continuous:
    """x' = A x + B u, y = C x + D u at one point."""

    a: Array
    b: Array
    c: Array
    d: Array


@dataclass(frozen=True)
class Stepped:
    """One communication step with its inputs held: x+ = phi x + gamma u; recorded after it: y = e x + f u.

    Before it, the outputs that belong to these inputs are c x + d u. ``rough``: what it depends on without a slope.
    """

    phi: Array
    gamma: Array
    e: Array
    f: Array
    c: Array
    d: Array
    rough: tuple[str, ...] = ()


@dataclass
class Block:
    """One instance on its way into the linear model.

    Attributes:
        slave: the instance. way: how its matrices are had; a source has none: nothing acts on it.
        rates: names of its continuous states with those of their rates. memory: names of its other states.
        inputs, outputs: scalar names of those that matter here.
        note: what a user should know about it.
    """

    slave: Slave
    way: Way
    rates: Mapping[str, str]
    memory: tuple[str, ...]
    inputs: list[str] = field(default_factory=list)
    outputs: list[str] = field(default_factory=list)
    note: str = ""

    @property
    def name(self) -> str:
        """The instance's name."""
        return self.slave.name

    @property
    def states(self) -> list[str]:
        """Scalar names of everything that it keeps from step to step."""
        return [*self.rates, *self.memory]

    @property
    def is_continuous(self) -> bool:
        """Whether it has rates rather than a step."""
        return self.way != "differences"

    def continuous(self) -> Continuous:
        """Its matrices at the present inputs and states.

        Raises:
            FmuError: the FMU refuses.
        """
        n, m, rows = len(self.rates), len(self.inputs), len(self.rates) + len(self.outputs)
        jacobian = np.zeros((rows, n + m))
        if self.way == "derivatives" and rows:
            jacobian = _directional(self.slave, [*self.rates.values(), *self.outputs], [*self.rates, *self.inputs])
        return Continuous(jacobian[:n, :n], jacobian[:n, n:], jacobian[n:, :n], jacobian[n:, n:])

    def step(self, time: float, length: float) -> Stepped:
        """Take a step, and give its linear model. The inputs have been set.

        Raises:
            FmuError: the FMU failed or refuses.
        """
        if self.way == "differences":
            return self._differences(time, length)
        before = self.continuous()
        self.slave.step(time, length)
        after = self.continuous()
        # The mean of both ends: exact to second order along a trajectory that is no equilibrium.
        phi, gamma = held(0.5 * (before.a + after.a), 0.5 * (before.b + after.b), length)
        e, f = after.c @ phi, after.c @ gamma + after.d
        return Stepped(phi, gamma, e, f, before.c, before.d)

    def _differences(self, time: float, length: float) -> Stepped:
        reals = self.slave.channel("Real", [*self.states, *self.outputs])
        results = self.slave.channel("Real", self.outputs)
        inputs = [self.slave.channel("Real", [name]) for name in self.inputs]
        given = [_input(self.slave, name) for name in self.inputs]
        saved = take_snapshot(self.slave, self.states)
        states, n = list(saved.values), len(saved.values)
        point = np.array([*saved.values.values(), *given])

        def respond(values: Array) -> Array:
            moved = {name: float(x) for name, x, at in zip(states, values, point, strict=False) if x != at}
            saved.restore(moved)
            for channel, x in zip(inputs, values[n:], strict=True):
                channel.set([float(x)])
            before = results.get() if self.outputs else []
            self.slave.step(time, length)
            return np.array([*before, *reals.get()])

        try:
            jacobian, rough = differences(respond, point)
            if not states and not self.slave.interface.annotation:
                self._refuse_if_it_remembers(respond, point, time + length, length)
            respond(point)
        finally:
            saved.free()
        k = len(self.outputs)
        named = [*states, *self.inputs]
        return Stepped(
            phi=jacobian[k : k + n, :n],
            gamma=jacobian[k : k + n, n:],
            e=jacobian[k + n :, :n],
            f=jacobian[k + n :, n:],
            c=jacobian[:k, :n],
            d=jacobian[:k, n:],
            rough=tuple(f"{self.name}.{named[column]}" for column in rough),
        )

    def _refuse_if_it_remembers(
        self, respond: Callable[[Array], Array], point: Array, time: float, length: float
    ) -> None:
        """Two steps that differ in the first one's inputs only must end alike, where there is no state."""
        ends = []
        for values in (point, point + np.maximum(1.0, np.abs(point))):
            respond(values)
            for name, x in zip(self.inputs, point, strict=True):
                self.slave.channel("Real", [name]).set([float(x)])
            self.slave.step(time, length)
            ends.append(self.slave.channel("Real", self.outputs).get())
        if self.outputs and not np.allclose(ends[0], ends[1], rtol=1e-9, atol=1e-12):
            raise ScenarioError(
                f"{self.name}: {self.slave.interface.model} lists no states in ModelStructure/Derivatives, but its "
                "outputs remember former inputs: it cannot be linearized; export it with its states and "
                "providesDirectionalDerivative, or --swap another model in its place"
            )


def make_block(slave: Slave, model: Model) -> Block:
    """How an instance's matrices can be had.

    Raises:
        ScenarioError: not at all; the message names it and the remedy.
    """
    interface = slave.interface
    rates, offers = _derivatives(model)
    if not any(v.type == "Real" for v in interface.of("input")):
        return Block(slave, "source", {}, ())
    if offers and not interface.sampled:
        note = (
            ""
            if interface.annotation or rates
            else f"{slave.name}: {interface.model} lists no states; it is taken to have none"
        )
        return Block(slave, "derivatives", rates, (), note=note)
    if interface.annotation:
        native = interface.own_kind == "native" and isinstance(slave, FmuSlave)
        note = "" if native else f"{interface.model} is no native FMU here: finite differences over a step"
        return Block(slave, "differences", rates, tuple(n for n in state_names(slave) if n not in rates), note=note)
    if interface.can_save_state:
        listed = f"of its states {', '.join(rates)}" if rates else "of its inputs; it lists no states"
        note = (
            f"{slave.name}: {interface.model} gives no directional derivatives: finite differences over a step {listed}"
        )
        return Block(slave, "differences", rates, (), note=note)
    as_what = " as FMI 2.0 or 3.0" if interface.version == "1.0" else ""
    raise ScenarioError(
        f"{slave.name}: {interface.model} can be linearized in no way: it gives no directional derivatives and does "
        f"not save its state; export it{as_what} with providesDirectionalDerivative or canGetAndSetFMUstate, or --swap "
        "another model in its place"
    )


def _derivatives(model: Model) -> tuple[dict[str, str], bool]:
    """Names of continuous states with those of their rates, and whether the FMU gives directional derivatives."""
    rates: dict[str, str] = {}
    for variable in model.interface.variables.values():
        if variable.derivative is not None:
            rates.setdefault(variable.derivative, variable.name)
    return rates, model.interface.directional_derivatives and model.plain is None


def _directional(slave: Slave, unknowns: Sequence[str], knowns: Sequence[str]) -> Array:
    """Partial derivatives of ``unknowns`` with respect to ``knowns``, one call a column."""
    found = [slave.directional_derivatives(unknowns, [known], [1.0]) for known in knowns]
    return np.array(found).reshape(len(knowns), len(unknowns)).T


def _input(slave: Slave, name: str) -> float:
    return float(slave.channel("Real", [name]).get()[0])


def held(a: Any, b: Any, length: float) -> tuple[Array, Array]:
    """State after a step of x' = A x + B u with u held: x+ = phi x + gamma u."""
    n, m = b.shape
    both = np.zeros((n + m, n + m))
    both[:n, :n], both[:n, n:] = a, b
    result: Any = expm(both * length)
    return result[:n, :n], result[:n, n:]


def differences(respond: Callable[[Array], Array], point: Array) -> tuple[Array, list[int]]:
    """The Jacobian of a function by Ridders' extrapolated central differences, and its rough columns.

    Each entry is taken where its own error estimate is smallest. A column is rough where the quotients do not agree;
    entries that grow as the step shrinks are jumps, and count as zero: what switches is held.
    """
    size = len(respond(point))
    jacobian = np.zeros((size, len(point)))
    rough = []
    for column, at in enumerate(point):
        best, error, jumps = _column(respond, point, column, _FIRST_STEP * max(1.0, abs(float(at))))
        jacobian[:, column] = np.where(jumps, 0.0, best)
        largest = np.abs(best).max(initial=0.0)
        if jumps.any() or (error > _ROUGH * np.maximum(np.abs(best), 1e-3 * largest)).any():
            rough.append(column)
    return jacobian, rough


def _column(
    respond: Callable[[Array], Array], point: Array, column: int, first: float
) -> tuple[Array, Array, NDArray[np.bool_]]:
    quotients = []
    for halving in range(_HALVINGS):
        up, down = point.copy(), point.copy()
        up[column] += first * 0.5**halving
        down[column] -= first * 0.5**halving
        quotients.append((respond(up) - respond(down)) / (up[column] - down[column]))
    row, best = [quotients[0]], quotients[0]
    error = np.full_like(best, np.inf)
    for quotient in quotients[1:]:
        fresh, factor = [quotient], 1.0
        for k, older in enumerate(row):
            factor *= 4.0
            fresh.append(fresh[k] + (fresh[k] - older) / (factor - 1.0))
            doubt = np.maximum(np.abs(fresh[k + 1] - fresh[k]), np.abs(fresh[k + 1] - older))
            better = doubt < error
            best, error = np.where(better, fresh[k + 1], best), np.where(better, doubt, error)
        row = fresh
    jumps = np.abs(quotients[-1]) > 8.0 * np.abs(quotients[0])
    # What does not move in the first quotients is no jump but rounding in the last.
    scale = np.maximum(1.0, np.abs(respond(point)))
    return best, error, jumps & (np.abs(quotients[-1]) * first * 0.5**_HALVINGS > 1e-9 * scale)
