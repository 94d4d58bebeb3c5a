"""What an FMU shows: its variables, units and capabilities, read from ``modelDescription.xml``."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal, NamedTuple

from ...fmus.annotation import Annotation
from ...fmus.kinds import FmuKind
from ..names import SignalName, Slice, plainly

Type = Literal["Real", "Integer", "Boolean", "String", "Enumeration"]


@dataclass(frozen=True)
class Unit:
    """A unit definition: value in SI = factor * value + offset; ``exponents`` over kg, m, s, A, K, mol, cd, rad."""

    name: str
    exponents: tuple[int, ...] | None
    factor: float = 1.0
    offset: float = 0.0


class Sort(NamedTuple):
    """What many variables of an FMU have in common."""

    type: Type
    causality: str
    variability: str
    initial: str | None
    unit: str | None = None
    minimum: float | None = None
    maximum: float | None = None
    nominal: float | None = None
    choices: tuple[tuple[str, int], ...] = ()
    relative: bool = False
    fmi_type: str = ""
    negated: bool = False
    media: str = ""
    longest: int | None = None


class Variable(NamedTuple):
    """One scalar variable of an FMU.

    ``dependencies`` holds, for an output, the variables it depends on directly; None where the FMU does not say.
    ``derivative`` names the state that it is the rate of. ``choices`` are the items of an enumeration, name and value.
    ``relative``: a difference, to which the offset of its unit does not apply. ``fmi_type`` is its type in FMI 3.0
    (``"Float32"``), empty in other versions. ``negated``: what the FMU keeps is its negative (FMI 1.0).
    ``media`` and ``longest``: of a Binary variable, whose values are texts of hexadecimal digits here: its MIME type,
    and how many bytes it may have.
    ``element``: of an FMI 3.0 array, whose elements share its reference: the array's name, and the place from 0.

    An FMU may have a million of them: what many have in common is kept once, as their ``sort``.
    """

    name: str
    reference: int
    sort: Sort
    start: Any = None
    description: str = ""
    dependencies: frozenset[str] | None = None
    derivative: str | None = None
    element: tuple[str, int] | None = None

    @property
    def type(self) -> Type:
        """Of its values, in the terms of FMI 2.0."""
        return self.sort.type

    @property
    def causality(self) -> str:
        """What it is for."""
        return self.sort.causality

    @property
    def variability(self) -> str:
        """When it may change."""
        return self.sort.variability

    @property
    def initial(self) -> str | None:
        """How its first value comes about."""
        return self.sort.initial

    @property
    def unit(self) -> str | None:
        """By name."""
        return self.sort.unit

    @property
    def minimum(self) -> float | None:
        """That the FMU is made for."""
        return self.sort.minimum

    @property
    def maximum(self) -> float | None:
        """That the FMU is made for."""
        return self.sort.maximum

    @property
    def nominal(self) -> float | None:
        """The size it usually has."""
        return self.sort.nominal

    @property
    def choices(self) -> tuple[tuple[str, int], ...]:
        """The items of an enumeration."""
        return self.sort.choices

    @property
    def relative(self) -> bool:
        """Whether it is a difference."""
        return self.sort.relative

    @property
    def fmi_type(self) -> str:
        """In FMI 3.0."""
        return self.sort.fmi_type

    @property
    def negated(self) -> bool:
        """Whether the FMU keeps its negative."""
        return self.sort.negated

    @property
    def media(self) -> str:
        """The MIME type of a Binary variable; empty where the FMU does not say."""
        return self.sort.media

    @property
    def longest(self) -> int | None:
        """How many bytes a Binary variable may have; None where the FMU does not say."""
        return self.sort.longest

    @property
    def is_binary(self) -> bool:
        """Whether its values are bytes, written as hexadecimal digits."""
        return self.fmi_type == "Binary"

    @property
    def settable(self) -> bool:
        """Whether a start value may be set before initialization."""
        if self.variability == "constant":
            return False
        return self.causality in ("input", "parameter") or self.initial in ("exact", "approx")

    @property
    def whole_range(self) -> tuple[int, int] | None:
        """The least and the largest value that the FMU can hold in a whole number; None for other types."""
        if self.type not in ("Integer", "Enumeration"):
            return None
        named = re.fullmatch(r"(U?)Int(\d+)", self.fmi_type)
        bits = int(named[2]) if named else 64 if self.fmi_type else 32
        return (0, 2**bits - 1) if named and named[1] else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)


_RECONSTRUCTED = ("Reconstructed", "Re-derived")
"""How the note of one of our own FMUs begins whose source had lost its formulas."""


@dataclass(frozen=True)
class Interface:
    """Everything the orchestrator needs to know of an FMU before it is loaded.

    Attributes:
        model: the model's name. variables: by name, in the order of the file. units: by name.
        arrays: names of scalars by the bare array name (``"force"`` -> ``"force[1]"``, ...).
        annotation: what one of our own FMUs says beyond the standard; None for one of another maker.
        version: of the FMI standard, ``"1.0"``, ``"2.0"`` or ``"3.0"``.
        event_mode: whether its events may be handled by its importer (FMI 3.0).
        output_derivatives: the highest order of them that it gives.
        left_out: what variables are that the FMU has and we do not take, by name: ``"a clock"``.
        structure: the structural parameters that were given other values than the file's, with these (FMI 3.0).
        warnings: what is wrong with the file though it can be used.
    """

    model: str
    identifier: str
    guid: str
    variables: Mapping[str, Variable]
    units: Mapping[str, Unit]
    arrays: Mapping[str, tuple[str, ...]]
    description: str = ""
    generator: str = ""
    default_step: float | None = None
    default_stop: float | None = None
    default_tolerance: float | None = None
    version: str = "2.0"
    can_save_state: bool = False
    can_serialize_state: bool = False
    directional_derivatives: bool = False
    interpolates_inputs: bool = False
    variable_step: bool = True
    single_instance: bool = False
    needs_tool: bool = False
    event_mode: bool = False
    output_derivatives: int = 0
    annotation: Annotation | None = None
    left_out: Mapping[str, str] = field(default_factory=dict)
    structure: Mapping[str, Any] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()

    @property
    def remarks(self) -> Iterator[str]:
        """What a user should know of it before numbers are made with it, a sentence each."""
        yield from self.warnings
        silent = [variable.name for variable in self.of("output") if variable.dependencies is None]
        if silent and self.of("input"):
            names, taken = ", ".join(silent[:4]), "all" if self.annotation else "no"
            yield f"{self.model} lists no dependencies of {names}; {taken} direct feed-through is assumed"
        if not self.of("output"):
            yield f"{self.model} has no outputs: nothing of it is recorded but what is connected"
        if self.needs_tool and not self.annotation:
            yield f"{self.model} says that it needs the tool it was made with ({self.generator or 'unnamed'})"

    @cached_property
    def optional_inputs(self) -> frozenset[str]:
        """Inputs that may stay unconnected without a word."""
        return frozenset(self.annotation.optional_inputs if self.annotation else ())

    @cached_property
    def flags(self) -> Mapping[str, str]:
        """For inputs of one of our own FMUs that are read only where a boolean input is true, its name."""
        return self.annotation.flags if self.annotation else {}

    @cached_property
    def beside(self) -> Mapping[str, str]:
        """For inputs of one of our own FMUs that come from where another input comes, its name."""
        return self.annotation.beside if self.annotation else {}

    @cached_property
    def rising(self) -> tuple[str, ...]:
        """Array parameters of one of our own FMUs whose elements must rise."""
        return self.annotation.rising if self.annotation else ()

    def start_name(self, name: str) -> str:
        """What holds the start value of a variable, an array or a part of one: in our FMUs that is a parameter."""
        array, bracket, index = name.partition("[")
        started = self.annotation is not None and array in self.annotation.started
        return f"{array}_start{bracket}{index}" if started else name

    @cached_property
    def unused_inputs(self) -> frozenset[str]:
        """Inputs that one of our own FMUs computes nothing from."""
        return frozenset(self.annotation.unused_inputs if self.annotation else ())

    @property
    def own_kind(self) -> FmuKind | None:
        """How one of our own FMUs is packaged."""
        return self.annotation.kind if self.annotation else None

    @property
    def label(self) -> str:
        """The model's name, and that its equations are reconstructed where one of our own FMUs says so."""
        reconstructed = self.annotation is not None and self.annotation.note.startswith(_RECONSTRUCTED)
        return f"{self.model} (reconstructed)" if reconstructed else self.model

    @property
    def sampled(self) -> bool:
        """Whether it is one of our sampled blocks."""
        return self.annotation is not None and self.annotation.sampled

    @property
    def recommended_step(self) -> float | None:
        """Longest advisable communication step in s, where one of our own FMUs has one."""
        return self.annotation.recommended_step if self.annotation else None

    @cached_property
    def inputs(self) -> frozenset[str]:
        """The names of all inputs."""
        return frozenset(v.name for v in self.of("input"))

    @cached_property
    def wholes(self) -> Mapping[str, tuple[str, ...]]:
        """All elements of each FMI 3.0 array, in the order of their places."""
        found: dict[str, list[str]] = {}
        for name, variable in self.variables.items():
            if variable.element is not None:
                found.setdefault(variable.element[0], []).append(name)
        return {array: tuple(names) for array, names in found.items()}

    def of(self, *causalities: str) -> tuple[Variable, ...]:
        """The variables of the given causalities, in order."""
        return tuple(v for v in self.variables.values() if v.causality in causalities)

    def scalars(self, name: str) -> tuple[str, ...] | None:
        """The scalar names behind a name: itself, an array's elements or some of them (``a[1,2:4]``), or None.

        An index may be written with blanks or without, and those of one array in one pair of brackets or in several.
        """
        if name in self.variables:
            return (name,)
        if name in self.arrays:
            return self.arrays[name]
        if ":" in name:
            return self._slice(name)
        written = self._plainly.get(plainly(name))
        return None if written is None else (written,)

    @cached_property
    def _plainly(self) -> Mapping[str, str]:
        """Names of elements by how a scenario may write them."""
        return {plainly(name): name for name in reversed(list(self.variables)) if "[" in name or " " in name}

    def _slice(self, name: str) -> tuple[str, ...] | None:
        """The scalars of ``a[1,2:4]`` or ``cell[:].t``, in the order of their indices."""
        wanted = Slice.parse(name)
        chosen = [] if wanted is None else wanted.among(self._plainly)
        return tuple(self._plainly[plain] for _, plain in chosen) or None

    def elements_beside(self, name: str) -> str:
        """A remedy for an element that is not there: which there are; empty where it is an element of no array."""
        array = name[: name.rfind("[")] if ":" in name else SignalName("", name).array
        there = self.arrays.get(array, ())
        if not there:
            return ""
        return f"there are {there[0]!r} to {there[-1]!r}" if len(there) > 1 else f"there is {there[0]!r}"

    def why_left_out(self, name: str) -> str:
        """A clause to append to an error about a name that is no variable: the FMU may have it all the same."""
        what = self.left_out.get(name)
        return f": in the FMU it is {what}, which is not supported" if what else ""
