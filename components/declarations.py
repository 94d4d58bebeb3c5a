"""What a component declares: its parameters, inputs, outputs, states and everything the runtime keeps for it.

A declaration is written once, in the class body. The model description, the documentation page, the unit checks
and ``orchestrate describe`` all derive from it. On an instance the attribute of the same name is the *value*.
"""

from __future__ import annotations

from abc import ABC
from collections.abc import Callable, Sequence
from typing import Any, Literal, Self, overload

ScalarType = type[float] | type[int] | type[bool] | type[str]
Distribution = Literal["normal", "uniform"]


class Declaration(ABC):
    """A named line in a component's interface. On an instance it reads as the value, on the class as itself."""

    name: str = ""
    description: str

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    @overload
    def __get__(self, instance: None, owner: type) -> Self: ...
    @overload
    def __get__(self, instance: object, owner: type) -> Any: ...
    def __get__(self, instance: object, owner: type) -> Any:
        # A non-data descriptor: a value of the instance wins, at the speed of a plain attribute.
        if instance is None:
            return self
        raise AttributeError(self.unreadable(owner))

    def unreadable(self, owner: type) -> str:
        """Why an instance that has no value of it has none."""
        return (
            f"{owner.__name__}.{self.name} has no value to read: an output is what outputs() returns; "
            "equations that need it share a method of their own"
        )

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.name}>"


class Size(Declaration):
    """A build argument: how many of something (carriages, points). It fixes array shapes."""

    def __init__(self, default: int, *, minimum: int = 1, description: str = "") -> None:
        self.default = default
        self.minimum = minimum
        self.description = description

    def __add__(self, offset: int) -> SizeExpression:
        return SizeExpression(self, offset)

    def __sub__(self, offset: int) -> SizeExpression:
        return SizeExpression(self, -offset)


class SizeExpression:
    """A size plus a constant, such as ``carriages - 1`` couplers."""

    def __init__(self, size: Size, offset: int) -> None:
        self.size = size
        self.offset = offset


class Data(Declaration):
    """A build argument: data that is baked in (a profile, a fault schedule, a line), given as JSON.

    Args:
        default: the data used when none is given; it must build a working component.
        convert: turns the raw JSON data into what the equations read; raises ValueError on unusable data.
        description: what the data is, with units.
    """

    def __init__(self, default: Any, *, convert: Callable[[Any], Any] | None = None, description: str = "") -> None:
        self.default = default
        self.convert = convert
        self.description = description


Shape = Sequence[int | Size | SizeExpression]


class Variable(Declaration, ABC):
    """A declaration that holds values: scalar, or an array of the given shape.

    Args:
        unit: SI unit such as ``"m/s2"`` or ``"N/kg"``; ``"1"`` for a plain number; a `Data` to let the builder say.
        start: value before the simulation begins. A boolean or a text gives the variable its type, a number does not:
            without ``type = int`` it is real, so that a forgotten ``.0`` changes nothing.
        type: float, int, bool or str.
        shape: lengths of the axes: integers, a `Size` or a `Size` plus a constant. Empty for a scalar.
        minimum: smallest sensible value.
        maximum: largest sensible value.
        description: one line for the interface table.
    """

    def __init__(
        self,
        unit: str | Data = "1",
        start: Any = 0.0,
        *,
        type: ScalarType | None = None,
        shape: Shape = (),
        minimum: float | None = None,
        maximum: float | None = None,
        description: str = "",
    ) -> None:
        self.unit = unit
        self.start = start
        self.type: ScalarType = type or _type_of(start)
        self.shape = tuple(shape)
        self.minimum = minimum
        self.maximum = maximum
        self.description = description


class Parameter(Variable):
    """A value that does not change by itself; a ``tunable`` one may be set between steps, others before the start.

    The elements of a ``rising`` one must rise, such as breakpoints.
    """

    def __init__(
        self, unit: str | Data = "1", start: Any = 0.0, *, tunable: bool = False, rising: bool = False, **rest: Any
    ) -> None:
        super().__init__(unit, start, **rest)
        self.tunable = tunable
        self.rising = rising


class Input(Variable):
    """A signal from outside, constant during a communication step. ``optional`` ones may stay unconnected.

    With a ``flag``, a boolean input of the same component, the equations read it only where that is true: it may stay
    unconnected while the flag is false, and whoever connects it says what the flag is.

    One that belongs ``beside`` another input comes from where that one comes, unless it is connected itself.
    """

    def __init__(
        self,
        unit: str | Data = "1",
        start: Any = 0.0,
        *,
        optional: bool = False,
        flag: Input | None = None,
        beside: Input | None = None,
        **rest: Any,
    ) -> None:
        super().__init__(unit, start, **rest)
        self.optional = optional or flag is not None
        self.flag = flag
        self.beside = beside


class Output(Variable):
    """A computed signal: ``outputs`` returns it."""

    def __init__(self, unit: str | Data = "1", type: ScalarType = float, **rest: Any) -> None:
        super().__init__(unit, type(), type=type, **rest)


class State(Variable):
    """A continuous state: ``derivatives`` returns its rate. ``output = True`` makes it an output as well.

    ``standstill = True`` says that the rate may jump where the state is zero, as friction does where a speed turns:
    integration steps onto exactly zero instead of across it, and ``derivatives`` decides whether it stays there.
    """

    def __init__(
        self,
        unit: str | Data = "1",
        start: Any = 0.0,
        *,
        output: bool = False,
        standstill: bool = False,
        **rest: Any,
    ) -> None:
        super().__init__(unit, start, **rest)
        self.output = output
        self.standstill = standstill


class Memory(Variable):
    """A value kept from one sample to the next: ``update`` returns its successor. ``output = True`` shows it."""

    def __init__(self, unit: str | Data = "1", start: Any = 0.0, *, output: bool = False, **rest: Any) -> None:
        super().__init__(unit, start, **rest)
        self.output = output


class Tape(Variable):
    """Memory along one trip: reads what the trip before recorded at the same sample; ``update`` returns the new row.

    A component with a tape has the inputs ``trip`` (integer) and ``trip_time`` (s).
    """


class Noise(Declaration):
    """A reproducible random number, drawn anew every ``hold`` seconds: standard normal, or uniform on [0, 1).

    Args:
        hold: the `Parameter` (s) that says how long a value is held.
        distribution: ``"normal"`` or ``"uniform"``.
        shape: independent streams, one per element.
        description: one line for the documentation.
    """

    def __init__(
        self, hold: Parameter, distribution: Distribution = "normal", *, shape: Shape = (), description: str = ""
    ) -> None:
        self.hold = hold
        self.distribution = distribution
        self.shape = tuple(shape)
        self.description = description


def _type_of(start: Any) -> ScalarType:
    while isinstance(start, list | tuple) and start:
        start = start[0]
    for candidate in (bool, str):
        if isinstance(start, candidate):
            return candidate
    return float
