"""The closed loop of a scenario as a linear model around one point of its run: x' = A x + B u, y = C x + D u.

Every FMU gives its own matrices (`blocks`); the connections join them. A system of continuous parts gives a
continuous model of ideal exchange: what passes straight through a block is eliminated, algebraic loops are solved.
Where a block is sampled, or a connection delayed, the model is that of one communication step (`composition`), in the
very order in which the master exchanges values.
"""

from __future__ import annotations

import importlib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import networkx as nx
import numpy as np

from ..errors import FmuError, ScenarioError
from ..fmi import Kind, Workspace
from ..fmi.binding import forget_paths
from ..master import ALGORITHMS, Explicit, Master, Operation, settle
from ..names import SignalName, parted
from ..problems import Problem, suggestion
from ..run import Checked, Progress, assembled, check
from ..system import System
from ..times import digits
from ..wiring import unmet_samples
from .blocks import Array, Continuous, Stepped, make_block
from .composition import Composition


@dataclass(frozen=True, eq=False)
class Linearization:
    """A linear model of a closed loop: deviations from one point of a run.

    Attributes:
        a, b, c, d: the matrices.
        states, inputs, outputs: full names. An input is a deviation that is added: to what an FMU's input receives, or
            to what an output gives.
        step: None for a continuous model, else the communication step in s of a discrete one.
        time: the point of the run, s. system: the scenario.
        values: what states and outputs are at that point, by full name. units: units of states, inputs and outputs.
        notes: what a user should know.
    """

    a: Array
    b: Array
    c: Array
    d: Array
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    step: float | None
    time: float
    system: System
    values: Mapping[str, float]
    units: Mapping[str, str]
    notes: tuple[str, ...] = ()

    def state_space(self) -> Any:
        """As a `control.StateSpace` with named signals where python-control is installed, else SciPy's state space."""
        try:
            control = importlib.import_module("control")  # optional
        except ImportError:
            from scipy import signal  # noqa: PLC0415

            step = {} if self.step is None else {"dt": self.step}
            return signal.StateSpace(self.a, self.b, self.c, self.d, **step)
        names = {"states": self.states, "inputs": self.inputs, "outputs": self.outputs}
        # python-control reads a dot in a name as "signal of a subsystem".
        named: Any = {key: [name.replace(".", "_") for name in each] for key, each in names.items()}
        return control.ss(self.a, self.b, self.c, self.d, 0.0 if self.step is None else self.step, **named)


def linearize(
    system: System,
    at: float,
    *,
    inputs: Sequence[str] = (),
    outputs: Sequence[str] = (),
    kind: Kind = "auto",
    sampled: bool = False,
    progress: Progress | None = None,
) -> Linearization:
    """Run a system to a time, and linearize its closed loop there.

    Args:
        system: from `load`, or built by hand.
        at: the time in s, a communication point.
        inputs: signals to which a deviation is added, such as ``"train[1].disturbance"`` or ``"target.value"``; ``[:]``
            stands for all indices. Left out: every input called ``disturbance``, and the signals of sources.
        outputs: signals to look at; left out: every state that is shown.
        kind: as for `run`; native FMUs give exact derivatives, others finite differences.
        sampled: give the model of one communication step even where all parts are continuous.
        progress: as for `run`.

    Raises:
        ScenarioError: the system cannot run, or a model can be linearized in no way.
        FmuError: a model failed.
    """
    steps = (at - system.stepping.start_time) / system.stepping.step
    if not 0.0 <= steps < np.inf or abs(steps - round(steps)) > 1e-6:
        raise ScenarioError(
            f"the time to linearize at, {at:g} s, is no communication point: take a whole number of steps of "
            f"{digits(system.stepping.step)} s from {digits(system.stepping.start_time)} s on"
        )
    nothing: dict[str, Any] = {"metrics": {}, "requirements": {}, "published": [], "references": [], "figures": []}
    # The step that is differentiated may end after the scenario's own stop time.
    stop = max(system.stepping.stop_time, system.stepping.start_time + (round(steps) + 2) * system.stepping.step)
    system = system.changed(**nothing, stop_time=stop, record=None)
    with Workspace() as workspace:
        try:
            checked = check(system, workspace, kind)
            _check_samples(system, checked)
            with assembled(checked) as master:
                master.initialize(system.stepping.start_time, stop)
                _advance(master, system, round(steps), progress)
                return Loop(system, checked, master, inputs, outputs).linearize(sampled)
        finally:
            forget_paths(workspace.folder)


def _check_samples(system: System, checked: Checked) -> None:
    """Every step must be like any other, or there is no model of one."""
    interfaces = {name: model.interface for name, model in checked.models.items()}
    problems = [unmet.problem for unmet in unmet_samples(system, interfaces, checked.wiring.starts)]
    if problems:
        raise ScenarioError(problems)


def _advance(master: Master, system: System, count: int, progress: Progress | None) -> None:
    every = max(1, count // 100)

    def observe(k: int, _: Any) -> bool:
        if progress is not None and count:
            progress(master.time, system.stepping.start_time + count * system.stepping.step)
        return True

    if count:
        master.run(system.stepping.start_time, system.stepping.step, count, every, observe)


class Loop:
    """A running master on its way to a linear model."""

    def __init__(
        self, system: System, checked: Checked, master: Master, inputs: Sequence[str], outputs: Sequence[str]
    ) -> None:
        self.system, self.master = system, master
        self.notes = list(checked.notes)
        self.time = master.time
        self.blocks = {name: make_block(slave, checked.models[name]) for name, slave in master.slaves.items()}
        self.notes += dict.fromkeys(block.note for block in self.blocks.values() if block.note)
        if system.events:
            self.notes.append("events act on the way; signals that they change at that time are taken as unchanged")
        types = {
            (name, v.name): v.type for name, slave in master.slaves.items() for v in slave.interface.variables.values()
        }
        links = master.exchange.links.values()
        real = [x for x in links if types[x.target] == "Real" and types[x.source] == "Real"]
        self.links = {link.target: link for link in real}
        self.inputs = self._chosen_inputs(inputs)
        self.outputs = self._chosen_outputs(outputs)
        self._choose_signals()

    # ---------------------------------------------------------------- what is looked at

    def _chosen_inputs(self, wanted: Sequence[str]) -> list[SignalName]:
        valid = [
            SignalName(name, v.name)
            for name, block in self.blocks.items()
            for v in block.slave.interface.of("input", "output")
            if v.type == "Real"
        ]
        if wanted:
            return _resolve(wanted, valid, "--inputs")
        disturbances = [s for s in valid if s[1] == "disturbance" and s not in self._given_outputs()]
        read = {link.source for target, link in self.links.items() if target not in disturbances}
        return disturbances + [s for s in valid if s in read and self.blocks[s[0]].way == "source"]

    def _given_outputs(self) -> set[SignalName]:
        return {
            SignalName(name, v.name) for name, block in self.blocks.items() for v in block.slave.interface.of("output")
        }

    def _chosen_outputs(self, wanted: Sequence[str]) -> list[SignalName]:
        """Outputs, and states that are none: for both there are derivatives."""
        moving = {name: b for name, b in self.blocks.items() if b.way != "source"}
        shown = [s for s in self._given_outputs() if self._is_real(s)]
        valid = [s for name in moving for s in sorted(shown, key=self._rank) if s[0] == name]
        hidden = [SignalName(n, s) for n, b in moving.items() for s in b.states if (n, s) not in valid]
        if wanted:
            return _resolve(wanted, [*valid, *hidden], "--outputs")
        return [s for s in valid if s[1] in moving[s[0]].states] or valid

    def _is_real(self, signal: SignalName) -> bool:
        return self.blocks[signal[0]].slave.interface.variables[signal[1]].type == "Real"

    def _rank(self, signal: SignalName) -> int:
        return list(self.blocks[signal[0]].slave.interface.variables).index(signal[1])

    def _choose_signals(self) -> None:
        """Of each block the inputs that something reaches, and the outputs that somebody reads."""
        for target in dict.fromkeys([*self.links, *self.inputs]):
            block = self.blocks[target[0]]
            if block.slave.interface.variables[target[1]].causality == "input":
                block.inputs.append(target[1])
        for source in dict.fromkeys([*(link.source for link in self.links.values()), *self.outputs, *self.inputs]):
            block = self.blocks[source[0]]
            if block.slave.interface.variables[source[1]].causality != "input":
                block.outputs.append(source[1])

    # ---------------------------------------------------------------- the two models

    def linearize(self, sampled: bool) -> Linearization:
        """The continuous model where every part is continuous and no step is asked for, else that of a step."""
        stepped = [name for name, block in self.blocks.items() if not block.is_continuous]
        delayed = [str(target) for target, link in self.links.items() if link.delay]
        if not (stepped or delayed or sampled):
            return self._continuous()
        why = []
        if stepped:
            why.append(f"sampled or stepped: {_families(stepped)}")
        if delayed:
            why.append(f"delayed: {_families(delayed)}")
        if why:
            self.notes.append(f"the model is that of one communication step ({'; '.join(why)})")
        return self._discrete()

    def _continuous(self) -> Linearization:
        settle(self.master.exchange, self.master.coupling.sequence, self.master.time)
        sizes = {name: (block.states, block.inputs, block.outputs) for name, block in self.blocks.items()}
        x, u, y = ([SignalName(n, s) for n, names in sizes.items() for s in names[k]] for k in range(3))
        a, b = np.zeros((len(x), len(x))), np.zeros((len(x), len(u)))
        c, d = np.zeros((len(y), len(x))), np.zeros((len(y), len(u)))
        at = [0, 0, 0]
        for block in self.blocks.values():
            own = block.continuous()
            i, j, k = (slice(at[n], at[n] + len(sizes[block.name][n])) for n in range(3))
            a[i, i], b[i, j], c[k, i], d[k, j] = own.a, own.b, own.c, own.d
            at = [i.stop, j.stop, k.stop]
        link, at_output, at_input = self._exchange(u, y)
        # u = L (y + P e) + Q e and y = C x + D u: what passes straight through is solved for.
        mixing = np.eye(len(y)) - d @ link
        self._check_loops(d @ link, mixing, y)
        drive = link @ at_output + at_input
        inner = np.linalg.solve(mixing, np.hstack([c, d @ drive]))
        from_x, from_e = inner[:, : len(x)], inner[:, len(x) :]
        rows = [y.index(signal) for signal in self.outputs]
        closed: Any = a + b @ link @ from_x, b @ (link @ from_e + drive), from_x[rows], from_e[rows] + at_output[rows]
        return self._result(Continuous(*closed), [str(signal) for signal in x], None)

    def _exchange(self, u: Sequence[SignalName], y: Sequence[SignalName]) -> tuple[Array, Array, Array]:
        """Which output feeds which input (times its scale), and where the chosen inputs are added."""
        place = {signal: k for k, signal in enumerate(y)}
        link = np.zeros((len(u), len(y)))
        at_output, at_input = np.zeros((len(y), len(self.inputs))), np.zeros((len(u), len(self.inputs)))
        for row, target in enumerate(u):
            if target in self.links:
                link[row, place[self.links[target].source]] = self.links[target].scale
        for column, signal in enumerate(self.inputs):
            if signal in place:
                at_output[place[signal], column] = 1.0
            else:
                at_input[u.index(signal), column] = 1.0
        return link, at_output, at_input

    def _check_loops(self, through: Array, mixing: Array, y: Sequence[SignalName]) -> None:
        """Note algebraic loops, and refuse those without a unique solution."""
        graph = nx.DiGraph((int(j), int(i)) for i, j in np.argwhere(through))
        for members in map(sorted, nx.strongly_connected_components(graph)):
            if len(members) == 1 and not through[members[0], members[0]]:
                continue
            names = ", ".join(str(y[k]) for k in members[:6]) + (", ..." if len(members) > 6 else "")
            inside = mixing[np.ix_(members, members)]
            if 1.0 / np.linalg.cond(inside) < 1e-13:
                raise ScenarioError(
                    f"the algebraic loop through {names} has no unique solution; put a component with a state into it"
                )
            self.notes.append(f"the algebraic loop through {names} is solved")

    def _discrete(self) -> Linearization:
        """One communication step, in the master's own order; registers keep what is read a step late."""
        algorithm = self.master.algorithm
        if not isinstance(algorithm, Explicit) or self.master.coupling.settings.rates:
            able = " or ".join(name for name, one in ALGORITHMS.items() if issubclass(one, Explicit))
            raise ScenarioError(
                f"the linear model of one communication step is that of {able} with one step for all; choose "
                "--algorithm gauss-seidel, and no step of an instance's own"
            )
        known = list(self.master.values)
        steps = [(op, name) for batch in algorithm.batches() for op in batch.operations for name in batch.names]
        matrices, states = Composition(self, self._step_models(steps), steps).result()
        self.master.values[:] = known
        return self._result(matrices, states, self.system.stepping.step)

    def _step_models(self, steps: Sequence[tuple[Operation, str]]) -> dict[str, Stepped]:
        """Of each block that of a step at the values at which the master would take it."""
        exchange, models, length = self.master.exchange, {}, self.system.stepping.step
        for operation, name in steps:
            if operation == Operation.SET:
                exchange.write(name, self.time)
            elif operation == Operation.STEP:
                models[name] = self.blocks[name].step(self.time, length)
            else:
                exchange.read_finite(self.master.slaves[name], self.time + length)
        rough = [name for model in models.values() for name in model.rough]
        if rough:
            self.notes.append(f"no slope here, what switches is held: {_families(rough)}")
        return models

    def _result(self, matrices: Continuous, states: Sequence[str], step: float | None) -> Linearization:
        if not np.isfinite(matrices.a).all():
            raise FmuError("a derivative is not finite", time=self.time)
        hidden = (SignalName(n, s) for n, block in self.blocks.items() for s in block.states)
        signals = [*self.inputs, *self.outputs, *hidden]
        units = {str(s): unit for s in signals if (unit := self.blocks[s[0]].slave.interface.variables[s[1]].unit)}
        return Linearization(
            matrices.a,
            matrices.b,
            matrices.c,
            matrices.d,
            tuple(states),
            tuple(str(signal) for signal in self.inputs),
            tuple(str(signal) for signal in self.outputs),
            step,
            self.time,
            self.system,
            self._values(),
            units,
            tuple(dict.fromkeys(self.notes)),
        )

    def _values(self) -> dict[str, float]:
        known = dict(zip(self.master.signals, self.master.values, strict=True))
        return {str(s): float(known[str(s)]) for s in self.outputs if str(s) in known}


def _resolve(wanted: Sequence[str], valid: Sequence[SignalName], option: str) -> list[SignalName]:
    """The signals behind names; ``[:]`` stands for all indices, commas part several in one text.

    Raises:
        ScenarioError: some name stands for nothing; the nearest one is suggested.
    """
    found: dict[SignalName, None] = {}
    problems = []
    names = {str(signal): signal for signal in valid}
    for name in parted(wanted):
        pattern = re.compile(re.escape(name).replace(re.escape("[:]"), r"\[[-\d, ]+\]") + r"(\[[-\d, ]+\])*")
        hits = [signal for full, signal in names.items() if full == name] or [
            signal for full, signal in names.items() if pattern.fullmatch(full)
        ]
        found |= dict.fromkeys(hits)
        if not hits:
            none = "there is no such signal with a slope"
            problems.append(Problem(f"{option} {name}", none, suggestion(name, names)))
    if problems:
        raise ScenarioError(problems)
    return list(found)


def _families(names: Sequence[str]) -> str:
    """``cruise[1], cruise[2]`` as ``cruise[:]``."""
    return ", ".join(dict.fromkeys(re.sub(r"\[\d+\]", "[:]", name) for name in names))
