"""Every published case, run as its command would run it, in one table."""

from __future__ import annotations

from dataclasses import dataclass

from ..errors import ScenarioError
from ..problems import Problem, suggestion
from ..scenario import load, shipped
from ..system import System


@dataclass(frozen=True)
class Case:
    """A scenario with one of its presets, and the command that runs it."""

    system: System
    command: str


def published_cases(paper: str | None = None) -> list[Case]:
    """The cases that carry published values or references; those of one paper if asked for.

    Args:
        paper: a scenario's name, the beginning of one, or a word of its source ("Wang").

    Raises:
        ScenarioError: no case matches.
    """
    names = [name for name, _ in shipped()]
    found = []
    for name in names:
        base = load(name)
        entries = [*base.judged.published, *base.judged.references]
        if not entries or (paper is not None and not _matches(paper, name, base.provenance.source)):
            continue
        presets = dict.fromkeys(entry.get("preset", base.provenance.default_preset) for entry in entries)
        for preset in presets:
            plain = preset is None or preset == base.provenance.default_preset
            command = f"orchestrate run {name}" + ("" if plain else f" --preset {preset}")
            found.append(Case(load(name, preset=preset), command))
    if not found:
        none = f"no published case belongs to {paper!r}"
        raise ScenarioError(Problem("", none, suggestion(paper or "", names)))
    return found


def _matches(paper: str, name: str, source: str) -> bool:
    return name.startswith(paper) or paper.lower() in source.lower()
