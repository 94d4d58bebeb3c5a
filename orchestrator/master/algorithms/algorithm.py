"""What a master algorithm is: what it needs, what it can, and how it takes a communication step."""

from __future__ import annotations

import inspect
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, ClassVar, final

from ...fmi import Interface
from ...problems import Problem
from ...system import System
from ...wiring import Wiring
from ..coupling import Coupling
from .iteration import Iteration

ALGORITHMS: dict[str, type[Algorithm]] = {}
"""All of them, by name."""


@dataclass(frozen=True)
class Fit:
    """How an algorithm fits a system.

    Attributes:
        problems: why it cannot be had with these FMUs, each with the way out.
        notes: what a user should know of it though it is no error.
        steps: how instances would step, a line each, where that is not one after the other.
    """

    problems: Sequence[Problem] = ()
    notes: Sequence[str] = ()
    steps: Sequence[str] = ()


class Algorithm(ABC):
    """How instances exchange values and take communication steps.

    A class is abstract, or final and has a name, by which scenarios and the command line know it from then on.

    Args:
        coupling: the instances, their values, and what happens to these on the way.

    Attributes:
        name: as a scenario says it.
        in_order: whether instances step one after the other, in the order that direct feed-through asks for.
        is_sweeping: whether an instance is given what others have computed in the same step.
        varies_step: whether it chooses its steps, at most as long as the system's; every point is recorded then.
        takes_own_steps: whether instances may take longer steps of their own.
        takes_threads: whether instances can step in parallel.
        solves_loops: whether what is exchanged agrees at the end of each step, algebraic loops included.
        is_of_end: whether the inputs of a step are those of its end; sampled components act on those of its begin.
    """

    name: ClassVar[str]
    in_order: ClassVar[bool] = False
    is_sweeping: ClassVar[bool] = True
    varies_step: ClassVar[bool] = False
    takes_own_steps: ClassVar[bool] = False
    takes_threads: ClassVar[bool] = False
    solves_loops: ClassVar[bool] = False
    is_of_end: ClassVar[bool] = False

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        if "name" in vars(cls):
            ALGORITHMS[cls.name] = cls

    def __init__(self, coupling: Coupling) -> None:
        self.coupling = coupling

    # ---------------------------------------------------------------- before there are instances

    @classmethod
    @final
    def summary(cls) -> str:
        """What it does, in a sentence."""
        return inspect.cleandoc(cls.__doc__ or "").partition("\n")[0]

    @classmethod
    @abstractmethod
    def fit(cls, system: System, interfaces: Mapping[str, Interface], wiring: Wiring) -> Fit:
        """How it fits a system; found out before there are instances."""

    # ---------------------------------------------------------------- on the way

    @abstractmethod
    def report(self) -> dict[str, Any]:
        """How it went, for the record of the run, its ``summary`` for people; empty where there is nothing to tell."""

    @abstractmethod
    def save(self) -> Any:
        """What it carries from one communication point to the next, as JSON-ready values."""

    @abstractmethod
    def restore(self, saved: Any) -> None:
        """Go on where `save` was called."""


class FixedStep(Algorithm):
    """All communication steps are the system's, and nothing is carried from one to the next."""

    @abstractmethod
    def take(self, number: int, time: float, length: float) -> None:
        """Take a step.

        Args:
            number: of the communication point that it begins at.
            time: of that point, in s.
            length: of the step, in s.

        Raises:
            FmuError: an FMU failed.
            CouplingError: what is exchanged does not settle.
        """

    @final
    def save(self) -> None:
        """Nothing."""

    @final
    def restore(self, saved: Any) -> None:
        """Nothing has been saved."""


class VariableStep(Algorithm):
    """It chooses its communication steps."""

    varies_step = True

    def __init__(self, coupling: Coupling) -> None:
        super().__init__(coupling)
        self.length = 0.0
        """How long the next step should be, in s; 0 for as long as may be."""

    @abstractmethod
    def advance(self, time: float, until: float, longest: float) -> float:
        """Take one step.

        Args:
            time: where it begins, in s.
            until: what it may reach and not pass, in s.
            longest: how long it may be, in s.

        Returns:
            The time that it ends at, in s.

        Raises:
            FmuError: an FMU failed.
            CouplingError: what is exchanged cannot be kept within its tolerance.
        """

    @final
    def save(self) -> float:
        """The length of the next step."""
        return self.length

    @final
    def restore(self, saved: Any) -> None:
        """Go on with that length."""
        self.length = float(saved)


class Operation(IntEnum):
    """What is done to an instance; of outputs all are read, or those that depend directly on inputs, or the rest.

    Of steps that may be taken back: inputs are set to the present values as those of the step's end; those that have
    just been set are noted, and shown again. A state is saved, come back to and given back, and so is another one.
    """

    SET = 0
    STEP = 1
    GET = 2
    GET_DIRECT = 3
    GET_REST = 4
    SET_OF_END = 5
    NOTE = 6
    SHOW = 7
    SAVE = 8
    RESTORE = 9
    FORGET = 10
    SAVE_END = 11
    RESTORE_END = 12
    FORGET_END = 13


@dataclass(frozen=True)
class Batch:
    """Operations on some instances: the first on each, then the next on each.

    What a batch does to one instance it may do at the same time as to another.
    """

    operations: tuple[Operation, ...]
    names: tuple[str, ...]


@dataclass(frozen=True)
class Repeated:
    """A batch that is repeated, instance by instance, from the states before it until what is passed on agrees."""

    batch: Batch
    iteration: Iteration


class Programmed(FixedStep):
    """A program of operations, the same in each step: the compiled loop can take it over."""

    @abstractmethod
    def program(self) -> Sequence[Batch | Repeated]:
        """What is done in a step, in this order."""

    @abstractmethod
    def note_steps(self, count: int) -> None:
        """So many steps have been taken by the compiled loop."""


class Explicit(Programmed):
    """A program in which nothing is repeated: others than the compiled loop can take it over, too."""

    takes_own_steps = True

    def __init__(self, coupling: Coupling) -> None:
        super().__init__(coupling)
        rates = coupling.settings.rates
        self._operations = [
            (operation, coupling.slaves[name], rates.get(name, 1))
            for batch in self.batches()
            for operation in batch.operations
            for name in batch.names
        ]

    @final
    def report(self) -> dict[str, Any]:
        """There is nothing to tell."""
        return {}

    @final
    def program(self) -> Sequence[Batch]:
        """The batches."""
        return self.batches()

    @final
    def note_steps(self, count: int) -> None:
        """Nobody asks."""

    @abstractmethod
    def batches(self) -> Sequence[Batch]:
        """What is done in a step, in this order."""

    @final
    def take(self, number: int, time: float, length: float) -> None:
        """Take a step, as `FixedStep.take` says."""
        exchange, end = self.coupling.exchange, time + length
        for operation, slave, rate in self._operations:
            if operation == Operation.GET:
                if rate == 1:
                    exchange.read_finite(slave, end)
                    continue
                # With a step of its own, direct outputs act at once, the others are of that step's end.
                if number % rate == 0:
                    exchange.read_finite(slave, end, direct=True)
                if number % rate == rate - 1:
                    exchange.read_finite(slave, end, direct=False)
            elif number % rate == 0:
                if operation == Operation.SET:
                    self.coupling.write(slave.name, time, rate * length)
                else:
                    slave.step(time, rate * length)
