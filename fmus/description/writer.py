"""Component -> ``modelDescription.xml``: one writer for every kind of FMU and version of FMI (`Dialect`)."""

from __future__ import annotations

import importlib.metadata
import json
from typing import Any

from lxml import etree

from ...components.component import Component
from ...components.declarations import Input, Parameter
from ...components.errors import ComponentError
from ...components.tracing import Names
from ..annotation import TOOL, Annotation
from ..kinds import NOTE_OF_KIND, FmiVersion, FmuKind, Profile
from ..references import summary
from ..units import BASE, parse
from ..variables import scalar_variables
from .dialect import Described, Dialect, ModelExchange
from .fmi2 import Fmi2
from .fmi3 import Fmi3
from .structure import rates_of, structure, unknowns
from .text import arguments, number

_DIALECTS: dict[FmiVersion, Dialect] = {"2": Fmi2(), "3": Fmi3()}
_PROJECT = __name__.partition(".")[0]
_LOG_CATEGORIES = {
    "logAll": "all of these",
    "logStatusError": "what went wrong; always sent",
    "logStatusWarning": "what is doubtful; always sent",
    "logEvents": "what the instance does; sent while debug logging is on",
}


def write(
    component: Component,
    kind: FmuKind,
    digest: str,
    profile: Profile = "standard",
    fmi: FmiVersion = "2",
    *,
    exchange: ModelExchange | None = None,
) -> bytes:
    """The model description of a component's FMU.

    Args:
        component: built with its arguments; its values are the start values.
        kind: how it is packaged.
        digest: hash of everything in the FMU; it becomes the GUID, or the instantiation token.
        profile: of a native FMU; a real-time one saves no states.
        fmi: the version of FMI; only native FMUs are written in 3.0.
        exchange: where the FMU is for model exchange as well.

    Raises:
        ComponentError: a name that FMI does not allow, build arguments that are not JSON, or equations that cannot be
            depends.
    """
    cls, dialect = type(component), _DIALECTS[fmi]
    variables = scalar_variables(component)
    for name in (cls.__name__, *component.slots):
        if not name.isascii():
            raise ComponentError(f"{cls.__name__}: FMI allows ASCII letters, digits and _ in names; rename {name!r}")
    depends = structure(component)
    root = etree.Element(
        "fmiModelDescription",
        fmiVersion=dialect.version,
        modelName=cls.__name__,
        **{dialect.token: "{" + digest[:32] + "}"},
        description=summary(cls),
        version=digest[:12],
        license="MIT" if cls.__module__.startswith(f"{_PROJECT}.") else "",
        generationTool=f"{TOOL} {importlib.metadata.version(TOOL)}",
        variableNamingConvention="structured",
    )
    if not root.get("license"):
        del root.attrib["license"]
    native, saves = kind == "native", "false" if profile == "real-time" else "true"
    moves = any(v.causality == "input" and v.slot.type is float for v in variables)
    for part in ("ModelExchange", "CoSimulation") if exchange else ("CoSimulation",):
        simulates = part == "CoSimulation"
        capabilities = etree.SubElement(
            root, part, modelIdentifier=cls.__name__, needsExecutionTool="false" if native else "true"
        )
        capabilities.set(*(("canHandleVariableCommunicationStepSize", "true") if simulates else dialect.steps))
        for can in ("canGetAndSetFMU", "canSerializeFMU"):
            capabilities.set(f"{can}{dialect.states}", saves)
        if native:
            capabilities.set(dialect.derivatives, "true")
        dialect.complete(capabilities, native=native, interpolates=native and moves and simulates)
    rates = rates_of(variables) if native else ()
    units = {v.slot.unit for v in variables if v.slot.type is float} | {rate.unit for rate in rates}
    _write_units(root, units | dialect.units)
    if native:
        categories = etree.SubElement(root, "LogCategories")
        for name, description in _LOG_CATEGORIES.items():
            etree.SubElement(categories, "Category", name=name, description=description)
    etree.SubElement(root, "DefaultExperiment", startTime="0", stepSize=number(default_step(component)))
    annotation = _annotation(component, kind, digest, depends.used)
    told = unknowns(variables, rates, depends)
    dialect.write_model(root, Described(component, variables, rates, told, annotation, exchange))
    text: bytes = etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True)
    return text


def default_step(component: Component) -> float:
    """The communication step in s for whoever has no other wish."""
    values = component.present_values
    return float(type(component).recommended_step or values.get("sample_time") or values.get("max_step") or 0.1)


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


def _write_units(root: Any, names: set[str]) -> None:
    names = names - {"1"}
    if not names:
        return
    block = etree.SubElement(root, "UnitDefinitions")
    for name in sorted(names):
        meaning = parse(name)
        exponents = {base: str(e) for base, e in zip(BASE, meaning.exponents, strict=True) if e}
        scale = {} if meaning.factor == 1.0 else {"factor": number(meaning.factor)}
        shift = {} if meaning.offset == 0.0 else {"offset": number(meaning.offset)}
        etree.SubElement(etree.SubElement(block, "Unit", name=name), "BaseUnit", **exponents, **scale, **shift)
