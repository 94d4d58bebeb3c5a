"""Component -> ``modelDescription.xml``: one writer for every kind of FMU."""

from __future__ import annotations

import importlib.metadata
import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from lxml import etree

from ..components.component import Component
from ..components.declarations import Input, Parameter, State
from ..components.errors import ComponentError
from ..components.tracing import (
    Names,
    TracingError,
    dependencies,
    initial_dependencies,
    rate_dependencies,
    start_name,
    used_inputs,
)
from .annotation import TOOL, Annotation
from .annotation import write as write_annotation
from .kinds import NOTE_OF_KIND, FmuKind, Profile
from .references import summary
from .units import BASE, parse
from .variables import ScalarVariable, scalar_variables

SOURCE = "all.c"
"""The source file of a native FMU that includes the others. Named after the model it could hide one of them."""
_ELEMENT = {float: "Real", int: "Integer", bool: "Boolean", str: "String"}
_POWERS = ("", "2", "3")
"""Of seconds, in the units of states."""
_LOG_CATEGORIES = {
    "logAll": "all of these",
    "logStatusError": "what went wrong; always sent",
    "logStatusWarning": "what is doubtful; always sent",
    "logEvents": "what the instance does; sent while debug logging is on",
}


@dataclass(frozen=True)
class Structure:
    """What depends on what, found by running the equations; None where they cannot be depends.

    Attributes:
        direct: for each scalar output, the inputs and states it depends on at one instant.
        rates: the same for the rate of each scalar state.
        initial: for each scalar that is computed at the start, what it follows from.
        used: the inputs that anything is computed from at all.
    """

    direct: Mapping[str, Names] | None
    rates: Mapping[str, Names] | None
    initial: Mapping[str, Names] | None
    used: Names | None


def structure(component: Component) -> Structure:
    """Trace a component; one that reads values as plain numbers (a Python-only one) keeps its dependencies unknown."""
    try:
        computed, initial = initial_dependencies(component)
        rates = rate_dependencies(component)
        started = {**computed, **initial}
        return Structure(dependencies(component), rates, started, _used(component))
    except TracingError:
        if not component.requires:
            raise
        return Structure(None, None, None, None)


def _used(component: Component) -> Names | None:
    """The inputs that are used; None where ``update`` or ``keep`` reads values as plain numbers, as it may."""
    try:
        return used_inputs(component)
    except TracingError:
        return None


def write(component: Component, kind: FmuKind, digest: str, profile: Profile = "standard") -> bytes:
    """The model description of a component's FMU.

    Args:
        component: built with its arguments; its values are the start values.
        kind: how it is packaged.
        digest: hash of everything in the FMU; it becomes the GUID.
        profile: of a native FMU; a real-time one saves no states.

    Raises:
        ComponentError: a name that FMI does not allow, build arguments that are not JSON, or equations that cannot be
            depends.
    """
    cls = type(component)
    variables = scalar_variables(component)
    for name in (cls.__name__, *component.slots):
        if not name.isascii():
            raise ComponentError(f"{cls.__name__}: FMI allows ASCII letters, digits and _ in names; rename {name!r}")
    depends = structure(component)
    root = etree.Element(
        "fmiModelDescription",
        fmiVersion="2.0",
        modelName=cls.__name__,
        guid="{" + digest[:32] + "}",
        description=summary(cls),
        version=digest[:12],
        license="MIT" if cls.__module__.startswith(__package__.rpartition(".")[0]) else "",
        generationTool=f"{TOOL} {importlib.metadata.version(TOOL)}",
        variableNamingConvention="structured",
    )
    if not root.get("license"):
        del root.attrib["license"]
    capabilities = etree.SubElement(
        root,
        "CoSimulation",
        modelIdentifier=cls.__name__,
        needsExecutionTool="true" if kind == "python" else "false",
        canHandleVariableCommunicationStepSize="true",
        canNotUseMemoryManagementFunctions="true",
        canGetAndSetFMUstate="true" if profile == "standard" else "false",
        canSerializeFMUstate="true" if profile == "standard" else "false",
    )
    rates = _rates(variables) if kind == "native" else ()
    if kind == "native":
        capabilities.set("providesDirectionalDerivative", "true")
        if any(v.causality == "input" and v.slot.type is float for v in variables):
            capabilities.set("canInterpolateInputs", "true")
        files = etree.SubElement(capabilities, "SourceFiles")
        etree.SubElement(files, "File", name=SOURCE)
    _write_units(root, {v.slot.unit for v in variables if v.slot.type is float} | {rate.unit for rate in rates})
    if kind == "native":
        categories = etree.SubElement(root, "LogCategories")
        for name, description in _LOG_CATEGORIES.items():
            etree.SubElement(categories, "Category", name=name, description=description)
    etree.SubElement(root, "DefaultExperiment", startTime="0", stepSize=_number(default_step(component)))
    write_annotation(_annotation(component, kind, digest, depends.used), root)
    block = etree.SubElement(root, "ModelVariables")
    for variable in variables:
        _write_variable(block, variable, component)
    for rate in rates:
        _write_rate(block, rate)
    _write_structure(root, variables, rates, depends)
    text: bytes = etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True)
    return text


def default_step(component: Component) -> float:
    """The communication step in s for whoever has no other wish."""
    values = component.present_values
    return float(type(component).recommended_step or values.get("sample_time") or values.get("max_step") or 0.1)


def arguments(component: Component) -> str:
    """The build arguments as JSON.

    Raises:
        ComponentError: one is not JSON data.
    """
    try:
        return json.dumps(component.build_arguments, sort_keys=True)
    except (TypeError, ValueError) as error:
        raise ComponentError(
            f"{type(component).__name__}: build arguments are JSON data (numbers, texts, lists, dicts): {error}"
        ) from error


def _annotation(component: Component, kind: FmuKind, digest: str, used: Names | None) -> Annotation:
    cls = type(component)
    inputs = [(slot, slot.declaration) for slot in component.of(Input)]
    every = [name for slot, _ in inputs for name in slot.scalars]
    return Annotation(
        component=cls.__name__,
        arguments=json.loads(arguments(component)),
        digest=digest,
        kind=kind,
        kind_note=NOTE_OF_KIND[kind],
        source=cls.source,
        note=cls.note,
        requires=cls.requires,
        optional_inputs=tuple(n for s, d in inputs if isinstance(d, Input) and d.optional for n in s.scalars),
        flags={n: d.flag.name for s, d in inputs if isinstance(d, Input) and d.flag for n in s.scalars},
        beside={s.name: d.beside.name for s, d in inputs if isinstance(d, Input) and d.beside},
        rising=tuple(s.name for s in component.of(Parameter) if getattr(s.declaration, "rising", False)),
        started=tuple(dict.fromkeys(v.slot.name for v in scalar_variables(component) if v.is_start)),
        unused_inputs=() if used is None else tuple(name for name in every if name not in used),
        recommended_step=cls.recommended_step,
        sampled=component.is_sampled,
    )


@dataclass(frozen=True)
class Rate:
    """The variable ``der(x)`` of a scalar state: it has a value reference after all others."""

    state: ScalarVariable
    reference: int

    @property
    def name(self) -> str:
        """As FMI's structured naming has it."""
        return f"der({self.state.name})"

    @property
    def unit(self) -> str:
        """The state's unit per second: m/s, m/s2, m/s3."""
        unit, per, power = self.state.slot.unit.rpartition("/s")
        return f"{unit}{per}{int(power or 1) + 1}" if per and power in _POWERS else f"{self.state.slot.unit}/s"


def _rates(variables: tuple[ScalarVariable, ...]) -> tuple[Rate, ...]:
    states = (v for v in variables if isinstance(v.slot.declaration, State) and not v.is_start)
    return tuple(Rate(state, len(variables) + k) for k, state in enumerate(states))


def _write_rate(block: Any, rate: Rate) -> None:
    variable = etree.SubElement(
        block,
        "ScalarVariable",
        name=rate.name,
        valueReference=str(rate.reference),
        description=f"rate of {rate.state.name}",
        causality="local",
        variability="continuous",
        initial="calculated",
    )
    etree.SubElement(variable, "Real", unit=rate.unit, derivative=str(rate.state.reference + 1))


def _write_units(root: Any, names: set[str]) -> None:
    names = names - {"1"}
    if not names:
        return
    block = etree.SubElement(root, "UnitDefinitions")
    for name in sorted(names):
        meaning = parse(name)
        exponents = {base: str(e) for base, e in zip(BASE, meaning.exponents, strict=True) if e}
        scale = {} if meaning.factor == 1.0 else {"factor": _number(meaning.factor)}
        shift = {} if meaning.offset == 0.0 else {"offset": _number(meaning.offset)}
        etree.SubElement(etree.SubElement(block, "Unit", name=name), "BaseUnit", **exponents, **scale, **shift)


def initial_kind(variable: ScalarVariable) -> str | None:
    """FMI ``initial``: parameters are exact, start values among them; inputs have none."""
    declaration = variable.slot.declaration
    if isinstance(declaration, Input):
        return None
    return "exact" if variable.is_parameter else "calculated"


def _write_variable(block: Any, variable: ScalarVariable, component: Component) -> None:
    declaration, slot = variable.slot.declaration, variable.slot
    attributes = {
        "name": variable.name,
        "valueReference": str(variable.reference),
        "description": variable.description,
        "causality": variable.causality,
        "variability": variable.variability,
    }
    initial = initial_kind(variable)
    if initial is not None:
        attributes["initial"] = initial
    element = etree.SubElement(
        etree.SubElement(block, "ScalarVariable", **{k: v for k, v in attributes.items() if v}), _ELEMENT[slot.type]
    )
    if slot.type is float and slot.unit != "1":
        element.set("unit", slot.unit)
    if slot.type in (float, int):
        for bound, value in (("min", declaration.minimum), ("max", declaration.maximum)):
            if value is not None:
                element.set(bound, _number(value) if slot.type is float else str(int(value)))
    if initial != "calculated":
        value = component.present_values[slot.name]
        element.set("start", _text(value if variable.element is None else np.ravel(value)[variable.element]))


def _write_structure(
    root: Any, variables: tuple[ScalarVariable, ...], rates: tuple[Rate, ...], depends: Structure
) -> None:
    """Outputs, Derivatives and InitialUnknowns; states are knowns only where their rates are listed."""
    block = etree.SubElement(root, "ModelStructure")
    index = {v.name: str(v.reference + 1) for v in variables} | {rate.name: str(rate.reference + 1) for rate in rates}
    inputs = {v.name for v in variables if v.causality == "input"}
    states = {rate.state.name for rate in rates}
    exact = {v.name for v in variables if v.is_parameter}
    computed = [v.name for v in variables if initial_kind(v) == "calculated"]
    started = {v.name: start_name(v.name) for v in variables if v.is_kept and start_name(v.name) in exact}
    shown = [v.name for v in variables if v.causality == "output"]
    of_rates = None if depends.rates is None else {f"der({name})": names for name, names in depends.rates.items()}
    unknowns = [name for name in computed if name in shown or name in states]
    initial = None if depends.initial is None or of_rates is None else {**of_rates, **depends.initial}
    for tag, members, sources, knowns in (
        ("Outputs", shown, depends.direct, inputs | states),
        ("Derivatives", [rate.name for rate in rates], of_rates, inputs | states),
        ("InitialUnknowns", [*unknowns, *(rate.name for rate in rates)], initial, inputs | exact),
    ):
        if not members:
            continue
        parent = etree.SubElement(block, tag)
        for name in members:
            entry = etree.SubElement(parent, "Unknown", index=index[name])
            if tag == "InitialUnknowns" and name in started:
                entry.set("dependencies", index[started[name]])
            elif sources is not None:
                from_what = sources.get(name, frozenset())
                if tag == "InitialUnknowns":
                    from_what = frozenset(started.get(source, source) for source in from_what)
                known = from_what & knowns
                entry.set("dependencies", " ".join(sorted((index[n] for n in known), key=int)))


def _text(value: Any) -> str:
    if isinstance(value, bool | np.bool_):
        return "true" if value else "false"
    return value if isinstance(value, str) else _number(value)


def _number(value: Any) -> str:
    return str(int(value)) if isinstance(value, int | np.integer) else repr(float(value))
