"""`Component`: equations and their declared interface, without FMI, files or clocks."""

from __future__ import annotations

import inspect
import itertools
import math
from abc import ABC
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np

from .declarations import (
    Data,
    Declaration,
    Input,
    Memory,
    Noise,
    Output,
    Parameter,
    ScalarType,
    Shape,
    Size,
    SizeExpression,
    State,
    Tape,
    Variable,
)
from .errors import BuildArgumentError, ComponentError, UnknownNameError, did_you_mean, nearest

Values = dict[str, Any]
Method = Literal["initial", "derivatives", "outputs", "update", "keep"]
"""The methods in which a component's equations stand."""
MAX_LENGTH = 10_000
"""Longest axis of an array: each element becomes a variable of the FMU, and a slip of the pen would take for ever."""


@dataclass(frozen=True)
class Slot:
    """One declared variable of a built component: shape and unit resolved, start value in place.

    ``name`` is the attribute; ``scalars`` gives the FMI names of its elements, ``name[1]``, ``name[1,2]``, ...
    """

    name: str
    declaration: Variable
    unit: str
    shape: tuple[int, ...]
    start: Any

    @property
    def type(self) -> ScalarType:
        """The Python type of one element."""
        return self.declaration.type

    @property
    def scalars(self) -> tuple[str, ...]:
        """Names of the elements in row-major order, 1-based; the bare name of a scalar."""
        if not self.shape:
            return (self.name,)
        return tuple(f"{self.name}[{','.join(str(k + 1) for k in index)}]" for index in np.ndindex(*self.shape))


class Component(ABC):
    """Base class of everything that becomes an FMU.

    A subclass declares its interface in the class body and writes those of the methods ``initial``, ``derivatives``,
    ``outputs``, ``update`` and ``keep`` that it needs. The methods are pure: they read values from ``self`` and return
    a dict by name; they change nothing. On values use operators, slices,
    reshaping and `maths`, nothing else: the same lines run on floats, arrays and symbols.

    Keyword arguments give build arguments and values, so that a formula can be read off in one line:
    ``ComfortCruise(speed=5.0).outputs()["demand"]``.

    Raises:
        ComponentError: an unknown name, a value of the wrong shape or type, a size below its minimum.
    """

    __slots__ = ("__dict__", "__weakref__", "build_arguments", "slots")
    build_arguments: Values
    """`Size` and `Data` by name, as they were given."""
    slots: dict[str, Slot]
    """The declared variables by name."""

    source: ClassVar[str] = ""
    """Where the equations come from: author, year, equation numbers."""
    equations: ClassVar[tuple[str, ...]] = ()
    """What the methods compute, line by line: text, with formulas in LaTeX between dollar signs."""
    note: ClassVar[str] = ""
    """What a user must know wherever the component is shown (for example that it is reconstructed)."""
    requires: ClassVar[tuple[str, ...]] = ()
    """Packages beside NumPy that the equations import; such a component can only become a Python FMU."""
    recommended_step: ClassVar[float | None] = None
    """Longest advisable communication step in s, if the equations have one."""

    initial: Callable[[], Values]
    """Start values of `State` and `Memory` that follow from parameters, starts and inputs."""
    derivatives: Callable[[], Values]
    """Rates of all `State` variables."""
    outputs: Callable[[], Values]
    """All `Output` variables, y = g(x, memory, u, t)."""
    update: Callable[[], Values]
    """Next `Memory`, this sample's `Tape` row and any re-initialised `State`, from values at the sample's start."""
    keep: Callable[[], Any]
    """Whether the trip that just ended may replace the tape's content."""

    declarations: ClassVar[Mapping[str, Declaration]] = {}

    # Parameters of the runtime. Each belongs to the interface only where the component has what it governs.
    sample_time = Parameter("s", 0.0, minimum=0.0, description="sample period; 0 samples once per communication step")
    max_step = Parameter("s", 0.1, minimum=0.0, description="longest integration step inside a communication step")
    seed = Parameter(
        "1", 0, type=int, minimum=0, maximum=2**31 - 1, description="seed of this instance's random numbers"
    )
    tape_file = Parameter("1", "", description="file the tape is read from at the start and written to at the end")
    tape_duration = Parameter("s", 300.0, minimum=0.0, description="longest trip the tape can hold")
    tape_cutoff = Parameter("Hz", 0.0, minimum=0.0, description="zero-phase low-pass between trips; 0 is off")

    time: float = 0.0
    """Simulation time in s, available everywhere."""

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        found: dict[str, Declaration] = {}
        for base in reversed(cls.__mro__):
            found.update({k: v for k, v in vars(base).items() if isinstance(v, Declaration)})
        features = {kind: any(isinstance(d, kind) for d in found.values()) for kind in (State, Memory, Tape, Noise)}
        sampled = features[Memory] or features[Tape] or features[Noise]
        runtime = {
            "sample_time": sampled,
            "max_step": features[State],
            "seed": features[Noise],
            "tape_file": features[Tape],
            "tape_duration": features[Tape],
            "tape_cutoff": features[Tape],
        }
        own = {name: d for name, d in found.items() if runtime.get(name) is None}
        cls.declarations = own | {name: found[name] for name, wanted in runtime.items() if wanted}
        _check_declarations(cls)

    def __init__(self, /, **values: Any) -> None:
        cls = type(self)
        unknown = [name for name in values if name not in cls.declarations and name != "time"]
        if unknown:
            raise ComponentError(f"{cls.__name__} has no {nearest(unknown[0], [*cls.declarations, 'time'])}")
        place = self.present_values
        self.build_arguments = {}
        for name, declaration in cls.declarations.items():
            if isinstance(declaration, Size | Data):
                given = values.pop(name, declaration.default)
                self.build_arguments[name] = given
                place[name] = _build_argument(cls, declaration, given)
        self.slots = {}
        for name, declaration in cls.declarations.items():
            if isinstance(declaration, Variable):
                slot = self._slot(declaration)
                self.slots[name] = slot
                if not isinstance(declaration, Output):
                    place[name] = slot.start
            elif isinstance(declaration, Noise):
                shape = self._shape(declaration.shape)
                place[name] = np.zeros(shape) if shape else 0.0
        for name, value in values.items():
            place[name] = convert(_TIME, value, cls.__name__) if name == "time" else self._given(name, value)

    # ---------------------------------------------------------------- what the runtime needs to know

    @property
    def present_values(self) -> Values:
        """What the equations read on ``self``, by name and alive: a runtime that drives the component writes here.

        It holds build arguments as converted, variables other than outputs, random numbers, and ``time`` once a
        runtime has set it. While ``update`` runs it holds ``step``, the length of the sample in s. Values are not
        checked: the constructor and `Simulation.set` are for people.
        """
        return self.__dict__

    @property
    def step(self) -> float:
        """Length of the sample in s; only ``update`` may ask, because elsewhere it is not known."""
        try:
            length: float = self.present_values["step"]
        except KeyError:
            raise ComponentError(f"{type(self).__name__}: self.step is known only inside update()") from None
        return length

    def of(self, *kinds: type[Declaration]) -> Iterator[Slot]:
        """The slots declared as one of ``kinds``, in order of declaration."""
        return (slot for slot in self.slots.values() if isinstance(slot.declaration, kinds))

    @property
    def output_slots(self) -> tuple[Slot, ...]:
        """Everything another component may connect to: outputs, and states and memory declared as outputs."""
        return tuple(s for s in self.slots.values() if isinstance(s.declaration, Output) or _shown(s.declaration))

    @property
    def is_sampled(self) -> bool:
        """Whether the component has Memory, Tape or Noise, and therefore acts at samples."""
        return "sample_time" in self.declarations

    @property
    def noises(self) -> dict[str, Noise]:
        """The declared random numbers by name."""
        return {name: d for name, d in self.declarations.items() if isinstance(d, Noise)}

    if not TYPE_CHECKING:  # or a type checker would take any name for one that is there

        def __getattr__(self, name: str) -> Any:
            """Called for what is not there alone: a misspelt name, or an output, which has no value to read."""
            cls = type(self)
            if name in cls.declarations:
                raise UnknownNameError(cls.declarations[name].unreadable(cls))
            known = [*cls.declarations, "time", "step", *(n for n in dir(cls) if not n.startswith("__"))]
            raise UnknownNameError(f"{cls.__name__} has no {name!r}{did_you_mean(name, known)}")

    def __setattr__(self, name: str, value: Any) -> None:
        if name not in ("slots", "build_arguments"):
            raise ComponentError(
                f"{type(self).__name__}.{name} cannot be assigned: the methods are pure; "
                "give values to the constructor, and return what changes from update()"
            )
        super().__setattr__(name, value)

    def _given(self, name: str, value: Any) -> Any:
        owner = type(self).__name__
        if name not in self.slots:  # a random number, given to look at one case
            return convert(Slot(name, Input(), "1", np.shape(self.present_values[name]), 0.0), value, owner)
        if isinstance(self.slots[name].declaration, Output):
            raise ComponentError(f"{owner}.{name} is computed and cannot be set")
        slot = self.slots[name]
        converted = convert(slot, value, owner)
        if isinstance(slot.declaration, Parameter) and slot.declaration.rising:
            flat = converted.ravel().tolist()
            if not all(a < b for a, b in itertools.pairwise(flat)):
                raise ComponentError(f"{owner}.{name} must rise, not {flat!r}")
        return converted

    def _shape(self, shape: Shape) -> tuple[int, ...]:
        return tuple(_length(self, axis) for axis in shape)

    def _slot(self, declaration: Variable) -> Slot:
        name = declaration.name
        shape = self._shape(declaration.shape)
        unit = declaration.unit if isinstance(declaration.unit, str) else str(getattr(self, declaration.unit.name))
        blank = Slot(name, declaration, unit, shape, None)
        return Slot(name, declaration, unit, shape, convert(blank, declaration.start, type(self).__name__))


def evaluated(component: Component, method: Method) -> Any:
    """What one of a component's equation methods returns; nothing changes and every trip is kept where it has none."""
    if not hasattr(type(component), method):  # the instance would look for what might have been meant
        return True if method == "keep" else {}
    equations: Callable[[], Any] = getattr(component, method)
    return equations()


_TIME = Slot("time", Input("s"), "s", (), 0.0)


def convert(slot: Slot, value: Any, owner: str) -> Any:
    """Bring a value to a slot's type and shape; a scalar fills an array.

    Raises:
        ComponentError: wrong type, wrong shape, or a number that is not finite.
    """
    where = f"{owner}.{slot.name}"
    if slot.shape:
        try:
            array = np.asarray(value, dtype=None if isinstance(value, np.ndarray) else object)
        except ValueError:
            raise ComponentError(f"{where} has shape {slot.shape}, but the value given is ragged: {value!r}") from None
        if array.shape not in ((), slot.shape):
            raise ComponentError(f"{where} has shape {slot.shape}, but the value given has {array.shape}")
        flat = np.broadcast_to(array, slot.shape).flat
        elements = [_scalar(slot.type, item.item() if isinstance(item, np.generic) else item, where) for item in flat]
        return pack(slot, elements)
    if isinstance(value, np.ndarray | np.generic):
        if value.ndim:
            raise ComponentError(f"{where} is a scalar, but an array of shape {value.shape} was given")
        value = value.item()
    return _scalar(slot.type, value, where)


def pack(slot: Slot, elements: Any) -> Any:
    """Elements of the right type as a slot's value; arrays come out read-only, because equations change nothing."""
    if not slot.shape:
        return elements
    array = np.array(elements, dtype=object if slot.type is str else slot.type).reshape(slot.shape)
    array.flags.writeable = False
    return array


def _scalar(kind: ScalarType, value: Any, where: str) -> Any:
    accepted: tuple[Any, ...] = (float, int) if kind is float else (kind,)
    if not isinstance(value, accepted) or (kind is not bool and isinstance(value, bool)):
        raise ComponentError(f"{where} takes a {kind.__name__}, not {value!r}")
    if isinstance(value, float) and not math.isfinite(value):
        raise ComponentError(f"{where} takes a finite number, not {value!r}")
    return float(value) if kind is float else value


def _length(component: Component, axis: int | Size | SizeExpression) -> int:
    if isinstance(axis, int):
        return axis
    if isinstance(axis, Size):
        return int(getattr(component, axis.name))
    length = int(getattr(component, axis.size.name)) + axis.offset
    if length < 0:
        raise ComponentError(
            f"{type(component).__name__}: {axis.size.name} = {length - axis.offset} leaves an array "
            f"of length {length}; take at least {-axis.offset}"
        )
    return length


def _build_argument(cls: type, declaration: Size | Data, given: Any) -> Any:
    where = f"{cls.__name__}: build argument {declaration.name!r}"
    if isinstance(declaration, Size):
        if isinstance(given, bool) or not isinstance(given, int) or given < declaration.minimum:
            raise ComponentError(f"{where} takes a whole number of at least {declaration.minimum}, not {given!r}")
        if given > MAX_LENGTH:
            raise ComponentError(f"{where} is {given}; arrays have at most {MAX_LENGTH} elements on an axis")
        return given
    if declaration.convert is None:
        return given
    try:
        return declaration.convert(given)
    except ValueError as error:
        raise BuildArgumentError(declaration.name, f"{where} is unusable: {error}") from error
    except (TypeError, AttributeError, LookupError, OverflowError) as error:
        raise BuildArgumentError(declaration.name, f"{where} is unusable: {type(error).__name__}: {error}") from error


def _shown(declaration: Declaration) -> bool:
    return isinstance(declaration, State | Memory) and declaration.output


def _check_declarations(cls: type[Component]) -> None:
    for name, declaration in cls.declarations.items():
        where = f"{cls.__name__}.{name}"
        if not isinstance(inspect.getattr_static(cls, name), Declaration):
            raise ComponentError(
                f"{where} hides the declaration of that name; declare it anew, {name} = Parameter(...)"
            )
        if isinstance(declaration, Tape) and not _has_trip_inputs(cls):
            raise ComponentError(
                f"{where} is a tape, but the inputs 'trip' (type = int) and 'trip_time' (real) are not declared"
            )
        if isinstance(declaration, Noise) and cls.declarations.get(declaration.hold.name) is not declaration.hold:
            raise ComponentError(f"{where}: hold must be a Parameter of the same component")
        if isinstance(declaration, Input) and declaration.flag is not None:
            flag = cls.declarations.get(declaration.flag.name)
            if not isinstance(flag, Input) or flag.type is not bool or flag.shape:
                raise ComponentError(f"{where}: its flag must be a boolean Input of the same component, not an array")
        if isinstance(declaration, Parameter) and declaration.rising and not declaration.shape:
            raise ComponentError(f"{where}: only an array can rise; give it a shape")
        if isinstance(declaration, State | Tape) and declaration.type is not float:
            raise ComponentError(f"{where}: a {type(declaration).__name__} is a real number")
        taken = name in Component.__annotations__ or hasattr(Component, name)
        if taken and not isinstance(vars(Component).get(name), Declaration):
            raise ComponentError(f"{where}: the name belongs to Component; choose another")


def _has_trip_inputs(cls: type[Component]) -> bool:
    trip, trip_time = cls.declarations.get("trip"), cls.declarations.get("trip_time")
    if not (isinstance(trip, Input) and isinstance(trip_time, Input)):
        return False
    return not (trip.shape or trip_time.shape) and trip.type is int and trip_time.type is float
