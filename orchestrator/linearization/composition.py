"""One communication step of a whole system, out of the linear steps of its blocks and the master's order."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Protocol

import numpy as np

from ..master import Master, Operation
from ..names import SignalName
from ..wiring import Link
from .blocks import Array, Block, Continuous, Stepped


class Parts(Protocol):
    """What is composed: the blocks of a master, the real connections between them, and the signals that are chosen."""

    master: Master
    blocks: dict[str, Block]
    links: dict[SignalName, Link]
    inputs: list[SignalName]
    outputs: list[SignalName]


class Composition:
    """One communication step of the whole system out of the steps of its blocks.

    Every quantity is a row over (states at the begin, chosen inputs); a row is passed on as the master passes values.
    """

    def __init__(self, loop: Parts, models: Mapping[str, Stepped], steps: Sequence[tuple[Operation, str]]) -> None:
        self.loop, self.models, self.steps = loop, models, steps
        self.states = [SignalName(n, s) for n, block in loop.blocks.items() for s in block.states]
        self.registers: list[tuple[SignalName, int]] = []
        self._register()
        self.width = len(self.states) + len(self.registers)
        self.rows = np.eye(self.width, self.width + len(loop.inputs))
        self.fresh: dict[SignalName, Array] = {}

    def _register(self) -> None:
        """What is read of former communication points and does not follow from the states: (signal, how old)."""
        stepped: set[str] = set()
        for operation, name in self.steps:
            if operation == Operation.GET:
                stepped.add(name)
            for target in self._targets(name) if operation == Operation.SET else ():
                link = self.loop.links[target]
                age = self._age(link, link.source[0] in stepped)
                if age is not None:
                    # A value k points old needs all the younger ones to pass through.
                    kept = [(link.source, k) for k in range(age + 1) if self._must_keep(link.source, k)]
                    self.registers += [register for register in kept if register not in self.registers]
        rank = {slave.name: k for k, slave in enumerate(self.loop.master.coupling.sequence)}
        self.registers.sort(key=lambda r: (rank[r[0][0]], r[0][1], r[1]))

    def _targets(self, name: str) -> list[SignalName]:
        return [s for i in self.loop.blocks[name].inputs if (s := SignalName(name, i)) in self.loop.links]

    def _age(self, link: Link, is_fresh: bool) -> int | None:
        """How many communication points before the begin of the step the value read was recorded; None: just now."""
        age = self.loop.master.exchange.age(link)
        if age is None:
            return None if is_fresh else 0
        return age

    def _must_keep(self, signal: SignalName, age: int) -> bool:
        """A present value that states determine is computed from them."""
        block = self.loop.blocks[signal[0]]
        if block.way == "source":
            return False
        return age > 0 or self._passes(signal)

    def _passes(self, signal: SignalName) -> bool:
        block = self.loop.blocks[signal[0]]
        k = block.outputs.index(signal[1])
        return bool(self.models[signal[0]].d[k].any())

    # ---------------------------------------------------------------- rows

    def _state_rows(self, name: str) -> Array:
        return self.rows[[k for k, (n, _) in enumerate(self.states) if n == name]]

    def _added(self, signal: SignalName, row: Array) -> Array:
        """With the deviation that is added to this signal, if one is."""
        if signal not in self.loop.inputs:
            return row
        row = row.copy()
        row[self.width + self.loop.inputs.index(signal)] += 1.0
        return row

    def _recorded(self, signal: SignalName, age: int) -> Array:
        """A recorded value, ``age`` points before the begin of the step."""
        if (signal, age) in self.registers:
            return np.asarray(self.rows[len(self.states) + self.registers.index((signal, age))])
        if self.loop.blocks[signal[0]].way == "source":
            return np.zeros(self.rows.shape[1])
        model, block = self.models[signal[0]], self.loop.blocks[signal[0]]
        return np.asarray(model.c[block.outputs.index(signal[1])] @ self._state_rows(signal[0]))

    def _input_rows(self, name: str, stepped: Collection[str]) -> Array:
        block = self.loop.blocks[name]
        rows = np.zeros((len(block.inputs), self.rows.shape[1]))
        for k, variable in enumerate(block.inputs):
            target = SignalName(name, variable)
            if target in self.loop.links:
                link = self.loop.links[target]
                age = self._age(link, link.source[0] in stepped)
                row = self.fresh[link.source] if age is None else self._recorded(link.source, age)
                rows[k] = link.scale * self._added(link.source, row)
            rows[k] = self._added(target, rows[k])
        return rows

    def result(self) -> tuple[Continuous, list[str]]:
        """The composed matrices, and the names of the states."""
        loop, stepped = self.loop, set[str]()
        following = np.zeros_like(self.rows)
        seen: dict[SignalName, Array] = {}
        given: dict[str, Array] = {}
        for operation, name in self.steps:
            if operation == Operation.SET:
                given[name] = self._input_rows(name, stepped)
            elif operation == Operation.GET:
                stepped.add(name)
            else:
                model, block = self.models[name], loop.blocks[name]
                x, u = self._state_rows(name), given[name]
                following[[k for k, (n, _) in enumerate(self.states) if n == name]] = model.phi @ x + model.gamma @ u
                after, before = model.e @ x + model.f @ u, model.c @ x + model.d @ u
                for k, output in enumerate(block.outputs):
                    signal = SignalName(name, output)
                    self.fresh[signal] = after[k]
                    seen[signal] = self._added(signal, before[k])
        for k, (signal, age) in enumerate(self.registers, len(self.states)):
            following[k] = self.fresh[signal] if age == 0 else self._recorded(signal, age - 1)
        outputs = np.array([seen[signal] for signal in loop.outputs]).reshape(-1, self.rows.shape[1])
        names = [".".join(s) for s in self.states]
        names += [
            f"{'.'.join(s)} (recorded)" if age == 0 else f"{'.'.join(s)} ({age} earlier)" for s, age in self.registers
        ]
        n = self.width
        return Continuous(following[:, :n], following[:, n:], outputs[:, :n], outputs[:, n:]), names
