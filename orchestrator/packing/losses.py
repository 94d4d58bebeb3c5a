"""What of a system a format has no words for, and what other tools do otherwise, a line each."""

from __future__ import annotations

from collections.abc import Iterator

from ..fmi import is_fmu_name
from ..master import ALGORITHMS
from ..names import SignalName
from ..problems import Problem
from ..run import Checked
from ..wiring import Link, described

_LIKE_OTHERS = "jacobi"
"""How the fixed-step masters of libcosim, Ecos and FMPy step."""


def unsayable(checked: Checked, *, osp: bool) -> Iterator[Problem]:
    """What the format has no words for, neither the standard's nor an annotation's."""
    for name, instance in checked.system.instances.items():
        if instance.build and is_fmu_name(instance.model):
            what = f"structural parameters ({', '.join(instance.build)}) are not part of SSP 1.0"
            yield Problem(name, what, "give an FMU that has its sizes")
    for link in checked.wiring.links:
        ends, types = (link.target, link.source), _types(link, checked)
        if link.mapping is not None and types[0] != types[1]:
            yield Problem(described(link.connection), "a map from one type to another has no place in SSP", names=ends)
        elif osp and (link.mapping is not None or types[0] != types[1]):
            what = "a map" if link.mapping is not None else f"{types[0]} that feeds {types[1]}"
            yield Problem(described(link.connection), f"{what} has no place in an OspSystemStructure.xml", names=ends)
        elif osp and (link.scale, link.offset) != (1.0, 0.0) and types[0] != "Real":
            what = f"libcosim transforms Reals alone, not {types[0]}"
            yield Problem(described(link.connection), what, names=ends)


def _types(link: Link, checked: Checked) -> tuple[str, str]:
    source, target = (
        checked.models[end.instance].interface.variables[end.variable].type for end in (link.source, link.target)
    )
    return source, target


def losses(checked: Checked, *, osp: bool) -> Iterator[str]:
    """What other tools do otherwise with what is written, or not at all."""
    system, stepping = checked.system, checked.system.stepping
    if stepping.algorithm != _LIKE_OTHERS:
        yield f"algorithm {stepping.algorithm}: other tools step all instances at once, as {_LIKE_OTHERS} does"
    late = sorted({str(link.source.family) for link in checked.wiring.links if link.direct})
    if late and ALGORITHMS[stepping.algorithm].in_order:
        yield f"what passes directly through a model acts one step later there: {', '.join(late)}"
    for setting, usual in (("extrapolation", 0), ("algebraic_loops", "delay"), ("refresh", False)):
        if (value := getattr(stepping, setting)) != usual:
            yield f"{setting} = {str(value).lower()}: other tools do not do that"
    yield from _of_links(checked)
    slow = [name for name, one in system.instances.items() if one.step not in (None, stepping.step)]
    if slow:
        yield f"steps of their own ({', '.join(slow)}): of other tools libcosim alone takes them"
    if system.events:
        yield f"events: other tools do not have them, and {len(system.events)} of this system are missing there"
    for model in {id(model): model for model in checked.models.values()}.values():
        if model.interface.own_kind == "python":
            yield f"{model.interface.model} is a Python FMU: its host needs Python and NumPy"
        if model.interface.version not in ("1.0", "2.0"):
            yield f"{model.interface.model} is FMI {model.interface.version}: SSP 1.0 knows FMI 1.0 and 2.0"
    others = [name for name in system.provenance.presets if name != system.provenance.preset]
    if others:
        yield f"presets: what is in force is written; not {', '.join(others)}"
    if osp:
        yield "requirements, metrics and figures have no place in an OspSystemStructure.xml: export a .ssp to keep them"


def _of_links(checked: Checked) -> Iterator[str]:
    told: dict[str, None] = {}
    for link in checked.wiring.links:
        target, source = (str(SignalName.parse(str(end)).family) for end in (link.target, link.source))
        ends, types = f"{target} = {source}", _types(link, checked)
        if link.delay:
            told[f"delay = {link.delay} of {ends}: other tools hand the value on without it"] = None
        if types[0] != types[1]:
            told[f"{ends}: that {types[0]} feeds {types[1]} is refused by libcosim"] = None
        elif types[0] in ("String", "Enumeration"):
            told[f"{ends}: not every tool hands on {types[0]}"] = None
        if (link.scale, link.offset) != (1.0, 0.0) or link.mapping is not None:
            told[f"{ends}: FMPy and fmu-manipulation-toolbox hand values on without the transformation"] = None
    yield from told
