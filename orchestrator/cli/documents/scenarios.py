"""The documents of commands that look at a scenario: check, describe."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ...run import Checked
from ...scenario import import_notes
from ...system import Connection, Event, Instance, Stepping, System


@dataclass(frozen=True)
class CheckDocument:
    """A scenario without errors.

    Attributes:
        instances: how many. connections: how many, of scalars. step: in s.
        order: in which the instances step. stepping, study: how it would be run, in sentences.
        notes: what a user should know.
    """

    scenario: str
    title: str
    preset: str | None
    instances: int
    connections: int
    step: float
    algorithm: str
    order: list[str]
    stepping: list[str]
    study: list[str]
    notes: list[str]


def check_document(system: System, checked: Checked, stepping: Sequence[str], study: Sequence[str]) -> CheckDocument:
    """The document of a check.

    Args:
        system: that was checked.
        checked: what was found.
        stepping: how it would step, a line each.
        study: what `[study]` would run.
    """
    origin = system.provenance
    return CheckDocument(
        origin.name,
        origin.title,
        origin.preset,
        len(system.instances),
        len(checked.wiring.links),
        system.stepping.step,
        system.stepping.algorithm,
        list(checked.order.sequence),
        list(stepping),
        list(study),
        list(checked.notes),
    )


@dataclass(frozen=True)
class ScenarioDocument:
    """A scenario as it is written: instances and start values, connections, events, and what is made of results.

    Attributes:
        presets: by name, with what they say of themselves. published, references: values known before, as written.
        kind: always "scenario".
    """

    name: str
    title: str
    description: str
    source: str
    path: str
    preset: str | None
    presets: dict[str, str]
    seed: int
    stepping: Stepping
    instances: list[Instance]
    connections: list[Connection]
    events: list[Event]
    requirements: dict[str, str]
    metrics: dict[str, str]
    published: list[dict[str, Any]]
    references: list[dict[str, Any]]
    figures: list[dict[str, Any]]
    notes: list[str]
    kind: str = "scenario"


def scenario_document(system: System) -> ScenarioDocument:
    """The document of a scenario."""
    origin, judged = system.provenance, system.judged
    return ScenarioDocument(
        origin.name,
        origin.title,
        origin.description,
        origin.source,
        origin.path,
        origin.preset,
        {name: origin.preset_descriptions.get(name, "") for name in origin.presets},
        system.seed,
        system.stepping,
        list(system.instances.values()),
        system.connections,
        system.events,
        judged.requirements,
        judged.metrics,
        judged.published,
        judged.references,
        judged.figures,
        list(import_notes(system)),
    )
