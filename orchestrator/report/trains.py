"""Which instances of a run are trains, and what their line is like: for the picture of the trains on the line."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..run import Results

_LIMITS = ("speed_limit",)
"""Outputs that tell the limit of the line where the train is."""
_CEILINGS = (*_LIMITS, "ceiling", "permitted_speed")
"""Outputs that no train should be faster than: limits, and the curve along which it has to brake to the next one."""


def trains_of(results: Results) -> list[dict[str, Any]]:
    """Whatever has a position, a speed and an acceleration: where its head and tail are, its length, its ceilings."""
    found = []
    for instance in dict.fromkeys(name.partition(".")[0] for name in results):
        head = [_first(results, f"{instance}.{what}") for what in ("position", "speed", "acceleration")]
        if None in head:
            continue
        carriages = [name for name in results if name.startswith(f"{instance}.position[")]
        found.append(
            {
                "name": instance,
                "position": head[0],
                "speed": head[1],
                "tail": carriages[-1] if carriages else None,
                "length": _length(results, instance),
                "limits": [name for name in results if _is_of(name, instance, _CEILINGS)],
                "strip": next((name for name in results if _is_of(name, instance, _LIMITS)), None),
            }
        )
    return found


def _first(results: Results, name: str) -> str | None:
    """A signal, or the first of an array."""
    return next((each for each in (name, f"{name}[1]") if each in results), None)


def _length(results: Results, instance: str) -> float:
    """Of the train in m; 0 where its model has none."""
    pitch = results.parameters.get(f"{instance}.vehicle_length", 0.0)
    vehicles = sum(name.startswith(f"{instance}.vehicle_force[") for name in results)
    return float(results.parameters.get(f"{instance}.length", float(pitch) * max(1, vehicles)))


def _is_of(name: str, instance: str, ceilings: tuple[str, ...]) -> bool:
    """Whether a signal limits this train: it is of an instance with the same number, or of one without."""
    owner, _, what = name.partition(".")
    return what in ceilings and owner.partition("[")[2] in ("", instance.partition("[")[2])


def gradients_of(record: Mapping[str, Any]) -> list[dict[str, float]]:
    """Where along the line which gradient begins: of the first model that was built with a line."""
    built = (value for told in record.get("instances", {}).values() for value in told.get("build", {}).values())
    for value in built:
        line = value.get("sections") if isinstance(value, Mapping) else value
        if isinstance(line, list) and line and all(isinstance(p, Mapping) and "position" in p for p in line):
            return [{"from": float(p["position"]), "gradient": float(p.get("gradient", 0.0))} for p in line]
    return []
