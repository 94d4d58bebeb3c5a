"""`OspSystemStructure.xml`: the system structure of libcosim (Open Simulation Platform), version 0.1."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from lxml import etree

from ..run import Checked
from .parts import Part

_SPACE = "http://opensimulationplatform.com/MSMI/OSPSystemStructure"


def osp_structure(checked: Checked, parts: Mapping[str, Part]) -> bytes:
    """The document; FMUs stand beside it.

    Args:
        checked: what is written.
        parts: its instances, by name.
    """
    stepping = checked.system.stepping
    root = etree.Element(f"{{{_SPACE}}}OspSystemStructure", nsmap={None: _SPACE}, version="0.1")
    for name, time in (("StartTime", stepping.start_time), ("EndTime", stepping.stop_time)):
        _below(root, name).text = repr(float(time))
    _below(root, "BaseStepSize").text = repr(float(stepping.step))
    _below(root, "Algorithm").text = "fixedStep"
    simulators = _below(root, "Simulators")
    for part in parts.values():
        facts = {"name": part.name, "source": part.source}
        if part.instance.step is not None:
            facts["stepSize"] = repr(float(part.instance.step))
        values = _below(_below(simulators, "Simulator", facts), "InitialValues")
        for variable, text in part.values():
            kind = "Integer" if variable.type == "Enumeration" else variable.type
            value = str(part.starts[variable.name]) if variable.type == "Enumeration" else text
            _below(_below(values, "InitialValue", {"variable": variable.name}), kind, {"value": value})
    transformed = [link for link in checked.wiring.links if (link.scale, link.offset) != (1.0, 0.0)]
    if transformed:
        functions = _below(root, "Functions")
        for k, link in enumerate(transformed):
            given = {"name": f"transformation_{k}", "factor": repr(link.scale), "offset": repr(link.offset)}
            _below(functions, "LinearTransformation", given)
    if checked.wiring.links:
        connections = _below(root, "Connections")
    for link in checked.wiring.links:
        source, target = (
            {"simulator": parts[end.instance].name, "name": end.variable} for end in (link.source, link.target)
        )
        if link in transformed:
            function = f"transformation_{transformed.index(link)}"
            for outer, end in ((source, "in"), (target, "out")):
                pair = _below(connections, "SignalConnection")
                _below(pair, "Variable", outer)
                _below(pair, "Signal", {"function": function, "name": end})
            continue
        pair = _below(connections, "VariableConnection")
        _below(pair, "Variable", source)
        _below(pair, "Variable", target)
    return bytes(etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True))


def _below(parent: Any, name: str, attributes: Mapping[str, str] | None = None) -> Any:
    return etree.SubElement(parent, f"{{{_SPACE}}}{name}", dict(attributes or {}))
