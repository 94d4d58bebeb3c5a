"""FMI 2.0: scalars, known by their place in the list of variables."""

from __future__ import annotations

from typing import Any, final

from lxml import etree

from ...components.component import Component
from ..annotation import write as write_annotation
from ..variables import ScalarVariable
from .dialect import Described, Dialect, ModelExchange
from .structure import Rate, initial_kind
from .text import attributes, of_type, start_of

SOURCE = "all.c"
"""The source file of a native FMU that includes the others. Named after the model it could hide one of them."""
_ELEMENT = {float: "Real", int: "Integer", bool: "Boolean", str: "String"}
_TAGS = {"outputs": "Outputs", "derivatives": "Derivatives", "initial": "InitialUnknowns"}


@final
class Fmi2(Dialect):
    """FMI 2.0."""

    version, token, states, derivatives = "2.0", "guid", "state", "providesDirectionalDerivative"
    steps = ("completedIntegratorStepNotNeeded", "true")

    def complete(self, capabilities: Any, *, native: bool, interpolates: bool) -> None:
        """No memory is asked for; inputs take derivatives; sources stand in the description."""
        capabilities.set("canNotUseMemoryManagementFunctions", "true")
        if interpolates:
            capabilities.set("canInterpolateInputs", "true")
        if native:
            etree.SubElement(etree.SubElement(capabilities, "SourceFiles"), "File", name=SOURCE)

    def write_model(self, root: Any, model: Described) -> None:
        """Annotation, variables, structure."""
        if model.exchange:
            root.set("numberOfEventIndicators", str(model.exchange.indicators))
        write_annotation(model.annotation, root, "2")
        block = etree.SubElement(root, "ModelVariables")
        for variable in model.variables:
            _write_variable(block, variable, model.component, model.exchange)
        for rate in model.rates:
            _write_rate(block, rate)
        index = {variable.name: str(variable.reference + 1) for variable in model.variables}
        index |= {rate.name: str(rate.reference + 1) for rate in model.rates}
        structure = etree.SubElement(root, "ModelStructure")
        for what, members in model.unknowns.items():
            parent = etree.SubElement(structure, _TAGS[what]) if members else None
            for name, sources in members:
                entry = etree.SubElement(parent, "Unknown", index=index[name])
                if sources is not None:
                    entry.set("dependencies", " ".join(sorted((index[n] for n in sources), key=int)))


def _write_variable(block: Any, variable: ScalarVariable, component: Component, exchange: ModelExchange | None) -> None:
    initial = initial_kind(variable)
    named = {"name": variable.name, "valueReference": str(variable.reference)}
    element = etree.SubElement(block, "ScalarVariable", **named, **attributes(variable, initial))
    value = etree.SubElement(element, _ELEMENT[variable.slot.type], **of_type(variable))
    if initial != "calculated":
        value.set("start", start_of(variable, component))
    if exchange and exchange.puts_back(variable):
        value.set("reinit", "true")


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
