"""The description and the page of a packed FMU."""

from __future__ import annotations

import html
import importlib.metadata
from collections.abc import Mapping, Sequence
from typing import Any

from lxml import etree

from ..fmi import Unit
from ..master import ALGORITHMS
from ..run import Checked
from ..system import System
from ..times import digits
from .exposure import Exposed

_EXPONENTS = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
_VARIABILITY = {"parameter": "fixed"}


def describe(system: System, checked: Checked, exposed: Mapping[Exposed, int], name: str, digest: str) -> bytes:
    """``modelDescription.xml``.

    Args:
        system: what was packed.
        checked: its models and start values.
        exposed: the variables and their value references in the container.
        name: of the model and its library.
        digest: hash of everything inside.
    """
    root = etree.Element(
        "fmiModelDescription",
        fmiVersion="2.0",
        modelName=name,
        guid="{" + digest[:32] + "}",
        description=system.provenance.title or system.provenance.name,
        version=digest[:12],
        generationTool=(
            f"railcosim {importlib.metadata.version('railcosim')}, "
            f"FMUContainer {importlib.metadata.version('fmu_manipulation_toolbox')}"
        ),
        variableNamingConvention="structured",
    )
    etree.SubElement(
        root,
        "CoSimulation",
        modelIdentifier=name,
        needsExecutionTool="false",
        canHandleVariableCommunicationStepSize="true",
        canNotUseMemoryManagementFunctions="true",
    )
    units = _units(checked, list(exposed))
    if units:
        definitions = etree.SubElement(root, "UnitDefinitions")
        for unit in units.values():
            _define(definitions, unit)
    etree.SubElement(
        root,
        "DefaultExperiment",
        startTime=repr(float(system.stepping.start_time)),
        stopTime=repr(float(system.stepping.stop_time)),
        stepSize=repr(float(system.stepping.step)),
    )
    tool = etree.SubElement(etree.SubElement(root, "VendorAnnotations"), "Tool", name="railcosim")
    etree.SubElement(
        tool,
        "pack",
        scenario=system.provenance.name,
        preset=system.provenance.preset or "",
        algorithm=system.stepping.algorithm,
        digest=digest,
    )
    _variables(root, checked, exposed, units)
    return bytes(etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True))


def _units(checked: Checked, exposed: Sequence[Exposed]) -> dict[str, Unit]:
    """Units of what is shown; one that two models define differently is left out."""
    units: dict[str, Unit] = {}
    unclear = set()
    for shown in exposed:
        unit = checked.models[shown.instance].interface.units.get(shown.variable.unit or "")
        if unit is not None and units.setdefault(unit.name, unit) != unit:
            unclear.add(unit.name)
    return {name: unit for name, unit in units.items() if name not in unclear}


def _define(definitions: Any, unit: Unit) -> None:
    element = etree.SubElement(definitions, "Unit", name=unit.name)
    if unit.exponents is None:
        return
    base = {name: str(n) for name, n in zip(_EXPONENTS, unit.exponents, strict=True) if n}
    base |= {k: repr(v) for k, v, usual in (("factor", unit.factor, 1.0), ("offset", unit.offset, 0.0)) if v != usual}
    etree.SubElement(element, "BaseUnit", base)


def _variables(root: Any, checked: Checked, exposed: Mapping[Exposed, int], units: Mapping[str, Unit]) -> None:
    variables = etree.SubElement(root, "ModelVariables")
    structure = etree.SubElement(root, "ModelStructure")
    outputs = [k for k, shown in enumerate(exposed) if shown.causality == "output"]
    # Without inputs nothing passes directly through; with inputs it is not known what does.
    known = {} if any(shown.causality == "input" for shown in exposed) else {"dependencies": ""}
    for shown, reference in exposed.items():
        _variable(variables, shown, reference, checked, units)
    for section, facts in (("Outputs", known), ("InitialUnknowns", {})):
        if outputs:
            listed = etree.SubElement(structure, section)
            for k in outputs:
                etree.SubElement(listed, "Unknown", {"index": str(k + 1)} | facts)


def _variable(variables: Any, shown: Exposed, reference: int, checked: Checked, units: Mapping[str, Unit]) -> None:
    inner = shown.variable
    kind = "Integer" if inner.type == "Enumeration" else inner.type
    facts = {
        "name": shown.name,
        "valueReference": str(reference),
        "description": inner.description,
        "causality": shown.causality,
        "variability": _VARIABILITY.get(shown.causality, "continuous" if kind == "Real" else "discrete"),
    }
    if shown.causality != "input":
        facts["initial"] = "calculated" if shown.causality == "output" else "exact"
    element = etree.SubElement(variables, "ScalarVariable", {k: v for k, v in facts.items() if v})
    typed = {"unit": inner.unit} if inner.unit in units and inner.unit else {}
    for name, bound in (("min", inner.minimum), ("max", inner.maximum)):
        if bound is not None and kind in ("Real", "Integer"):
            typed[name] = repr(bound) if kind == "Real" else str(int(bound))
    if shown.causality != "output":
        value = checked.wiring.starts[shown.instance].get(inner.name, inner.start)
        typed["start"] = start_text(kind, value)
    etree.SubElement(element, kind, typed)


def start_text(kind: str, value: Any) -> str:
    """A start value as it is written in XML."""
    if kind == "Boolean":
        return "true" if value else "false"
    return repr(float(value)) if kind == "Real" else str(value)


def page(system: System, checked: Checked, exposed: Sequence[Exposed]) -> str:
    """The documentation inside: what is packed, how it steps, what it shows."""
    instances = "".join(
        f"<tr><td><code>{html.escape(name)}</code></td><td>{html.escape(model.interface.model)}</td>"
        f"<td><code>{model.digest[:12]}</code></td></tr>"
        for name, model in checked.models.items()
    )
    shown = "".join(
        f"<tr><td><code>{html.escape(each.name)}</code></td><td>{each.causality}</td>"
        f"<td>{html.escape(each.variable.unit or '')}</td><td>{html.escape(each.variable.description)}</td></tr>"
        for each in exposed
    )
    how = (
        f"in the order {', '.join(checked.order.sequence)}, each with what the others gave last"
        if ALGORITHMS[system.stepping.algorithm].in_order
        else "all at once; what passes directly through a model acts one step late"
    )
    came, step = system.provenance, system.stepping.step
    return (
        f'<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><title>{html.escape(came.name)}</title></head>'
        f"<body><h1>{html.escape(came.title or came.name)}</h1><p>{html.escape(came.description)}</p>"
        f"<p>Preset: {html.escape(came.preset or 'none')}{', modified' if came.modified else ''}. "
        f"{html.escape(system.stepping.algorithm)}: the models step every {digits(step)} s, {html.escape(how)}. "
        f"The importing tool's step is a whole multiple of that.</p>"
        f"<h2>Models</h2><table><tr><th>instance</th><th>model</th><th>digest</th></tr>{instances}</table>"
        f"<h2>Variables</h2><table><tr><th>name</th><th>causality</th><th>unit</th><th>description</th></tr>{shown}"
        "</table></body></html>\n"
    )
