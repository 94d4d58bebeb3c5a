"""What can be changed in a live page: the parameters of the models, as their declarations have them."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from typing import Any

from ...fmi import Variable
from ...names import SignalName
from ...run import Checked

_FIRST = 8
"""So many are shown at first; the others are found by name."""


def controls_of(checked: Checked) -> list[dict[str, Any]]:
    """A control for each parameter; one for all instances of a group where they have the same value.

    Those that the scenario's presets and its study change come first, then those that it gives a value.
    """
    varied, found = _varied(checked.system.provenance.text), []
    for (group, variable), members in _families(checked).items():
        if len({value for _, _, value in members}) == 1:
            found.append(_control(f"{group}.{variable}", members, varied, checked))
        else:
            found += [_control(f"{name}.{variable}", [(name, *rest)], varied, checked) for name, *rest in members]
    found.sort(key=lambda control: control["rank"])
    for k, control in enumerate(found):
        control["first"] = k < _FIRST and control.pop("rank") < 2
        control.pop("rank", None)
    return found


def _families(checked: Checked) -> dict[tuple[str, str], list[tuple[str, Variable, Any]]]:
    """Instance, parameter and value of the same parameter of all instances of a group."""
    families: dict[tuple[str, str], list[tuple[str, Variable, Any]]] = {}
    for name, model in checked.models.items():
        for variable in model.interface.of("parameter"):
            value = checked.wiring.starts[name].get(variable.name, variable.start)
            if variable.type in ("Real", "Integer", "Boolean") and value is not None and variable.settable:
                key = (SignalName(name).group, variable.name)
                families.setdefault(key, []).append((name, variable, float(value)))
    return families


def _control(name: str, members: list[Any], varied: frozenset[str], checked: Checked) -> dict[str, Any]:
    _, variable, value = members[0]
    given = all(each.name in checked.wiring.starts[instance] for instance, each, _ in members)
    signal, of = SignalName.parse(name), list(checked.models)
    names = {f"{signal.group}.{signal.array}", f"{signal.group}.{signal.variable}"}
    own = variable.name.endswith("_start") or variable.name in ("seed", "sample_time", "max_step")
    return {
        "name": name,
        "targets": [[of.index(instance), each.reference] for instance, each, _ in members],
        "parameters": [f"{instance}.{each.name}" for instance, each, _ in members],
        "kind": variable.type,
        "value": value,
        **dict(zip(("low", "high"), _range(variable, value), strict=True)),
        "least": variable.minimum,
        "most": variable.maximum,
        "unit": variable.unit or "",
        "description": variable.description,
        "fixed": variable.variability == "fixed",
        "rank": 0 if names & varied else 1 if given and not own else 2,
    }


def _range(variable: Variable, value: float) -> tuple[float, float]:
    """From where to where a slider goes: between declared bounds, or up to three times the value."""
    low, high = sorted((0.0, 3.0 * value)) if value else (-1.0, 1.0)
    least, most = variable.minimum, variable.maximum
    if least is not None and most is not None:
        return least, most
    return (low if least is None else max(low, least)), (high if most is None else min(high, most))


def _varied(text: str) -> frozenset[str]:
    """What presets and the study of a scenario change: ``"cruise.alpha"``."""
    return frozenset(_names(tomllib.loads(text))) if text else frozenset()


def _names(scenario: Mapping[str, Any]) -> Iterator[str]:
    for changed in (*scenario.get("presets", {}).values(), scenario.get("study", {}).get("vary", {})):
        for name in changed:
            signal = SignalName.parse(name)
            yield f"{signal.group}.{signal.variable}"
