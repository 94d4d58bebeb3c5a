"""FMI 3.0: arrays, known by the value reference of their first element."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, final

from lxml import etree

from ...components.component import Component
from ...components.tracing import start_name
from ..annotation import write as write_annotation
from ..variables import ScalarVariable
from .dialect import Described, Dialect, ModelExchange
from .structure import Rate, Unknowns, initial_kind
from .text import attributes, of_type, starts_of

_ELEMENT = {float: "Float64", int: "Int32", bool: "Boolean", str: "String"}
_TAGS = {"outputs": "Output", "derivatives": "ContinuousStateDerivative", "initial": "InitialUnknown"}


@final
class Fmi3(Dialect):
    """FMI 3.0."""

    version, token, states, derivatives = "3.0", "instantiationToken", "State", "providesDirectionalDerivatives"
    steps = ("needsCompletedIntegratorStep", "false")
    units = frozenset({"s"})

    def complete(self, capabilities: Any, *, native: bool, interpolates: bool) -> None:
        """Nothing: there are no derivatives of inputs, and sources have a description of their own."""

    def write_model(self, root: Any, model: Described) -> None:
        """Variables, the time among them, and the event indicators; structure; annotation."""
        exchange = model.exchange
        block = etree.SubElement(root, "ModelVariables")
        for variable in model.variables:
            if not variable.element:
                _write_variable(block, variable, model.component, exchange)
        for rate in model.rates:
            if not rate.state.element:
                _write_rate(block, rate)
        reference = len(model.variables) + len(model.rates)
        etree.SubElement(
            block,
            "Float64",
            name="time",
            valueReference=str(reference),
            description="time of the last communication point" + (", or that the importer has set" if exchange else ""),
            causality="independent",
            variability="continuous",
            unit="s",
        )
        _write_structure(root, model.variables, model.rates, model.unknowns)
        if exchange and exchange.indicators:
            _write_indicators(root, block, exchange.indicators, str(reference + 1))
        write_annotation(model.annotation, root, "3")


def name_of(variable: ScalarVariable) -> str:
    """The name of a scalar, or of the array that an element belongs to."""
    if variable.element is None:
        return variable.name
    return start_name(variable.slot.name) if variable.is_start else variable.slot.name


def _write_variable(block: Any, variable: ScalarVariable, component: Component, exchange: ModelExchange | None) -> None:
    """A scalar, or with its first element an array."""
    initial, kind = initial_kind(variable), variable.slot.type
    named = {"name": name_of(variable), "valueReference": str(variable.reference)}
    element = etree.SubElement(block, _ELEMENT[kind], **named, **attributes(variable, initial), **of_type(variable))
    if exchange and exchange.puts_back(variable):
        element.set("reinit", "true")
    _write_dimensions(element, variable)
    if initial == "calculated":
        return
    starts = starts_of(variable, component)
    if kind is not str:
        element.set("start", " ".join(starts))
    for start in starts if kind is str else ():
        etree.SubElement(element, "Start", value=start)


def _write_dimensions(element: Any, variable: ScalarVariable) -> None:
    """Constant ones: the equations in C are those of the sizes that the FMU was built with."""
    for size in variable.slot.shape:
        etree.SubElement(element, "Dimension", start=str(size))


def _write_rate(block: Any, rate: Rate) -> None:
    name = name_of(rate.state)
    element = etree.SubElement(
        block,
        "Float64",
        name=f"der({name})",
        valueReference=str(rate.reference),
        description=f"rate of {name}",
        causality="local",
        variability="continuous",
        initial="calculated",
        unit=rate.unit,
        derivative=str(rate.state.reference),
    )
    _write_dimensions(element, rate.state)


def _write_indicators(root: Any, block: Any, count: int, reference: str) -> None:
    """The event indicators are one array, with a name that no component can give; they depend on anything."""
    element = etree.SubElement(
        block,
        "Float64",
        name="event.indicators",
        valueReference=reference,
        description="each changes its sign where a choice changes, or where something comes to rest or sets off",
        causality="local",
        variability="continuous",
        initial="calculated",
    )
    etree.SubElement(element, "Dimension", start=str(count))
    etree.SubElement(root.find("ModelStructure"), "EventIndicator", valueReference=reference)


def _write_structure(
    root: Any, variables: tuple[ScalarVariable, ...], rates: tuple[Rate, ...], unknowns: Mapping[str, Unknowns]
) -> None:
    """An array depends on all that its elements depend on."""
    first = {v.name: v.reference - (v.element or 0) for v in variables}
    first |= {rate.name: rate.reference - (rate.state.element or 0) for rate in rates}
    block = etree.SubElement(root, "ModelStructure")
    for what, members in unknowns.items():
        together: dict[int, set[int] | None] = {}
        for name, sources in members:
            known = together.setdefault(first[name], set())
            if sources is None or known is None:
                together[first[name]] = None
            else:
                known |= {first[n] for n in sources}
        for reference, found in together.items():
            entry = etree.SubElement(block, _TAGS[what], valueReference=str(reference))
            if found is not None:
                entry.set("dependencies", " ".join(map(str, sorted(found))))
