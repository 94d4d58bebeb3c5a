"""The documents of commands that search: falsify, optimize."""

from __future__ import annotations

from dataclasses import dataclass

from ...evaluation import Verdict
from ...study.search import Falsification, Falsified, Optimized


@dataclass(frozen=True)
class FalsifyDocument:
    """A search for a run that breaks a requirement.

    Attributes:
        found: how the search went. verdict: of the counterexample, run by itself; null where there is none.
        scenario: its file. changes: what it changes, in words.
    """

    found: Falsification
    verdict: Verdict | None
    scenario: str | None
    changes: list[str]
    directory: str
    figures: list[str]


def falsify_document(result: Falsified) -> FalsifyDocument:
    """The document of a search."""
    return FalsifyDocument(
        result.found,
        result.verdict,
        None if result.scenario is None else str(result.scenario),
        list(result.changes),
        str(result.directory),
        [str(path) for path in result.figures],
    )


@dataclass(frozen=True)
class BestDocument:
    """One of the best: its run, its scenario's file, the objectives' values, and what it changes, in words."""

    run: int
    scenario: str
    values: list[float]
    changes: list[str]


@dataclass(frozen=True)
class OptimizeDocument:
    """A search for the least.

    Attributes:
        objectives: what was to be least. requirements: that had to hold. failed: how many runs did.
        best: one, or the points of the Pareto front.
    """

    objectives: list[str]
    requirements: list[str]
    runs: int
    failed: int
    errors: list[str]
    best: list[BestDocument]
    directory: str
    figures: list[str]


def optimize_document(result: Optimized) -> OptimizeDocument:
    """The document of a search."""
    found = result.found
    best = [
        BestDocument(one.run, str(path), found.values(one), list(changes))
        for one, path, changes in zip(found.best, result.scenarios, result.changes, strict=True)
    ]
    return OptimizeDocument(
        list(found.objectives.values()),
        list(found.requirements),
        found.runs,
        found.failed,
        list(found.errors),
        best,
        str(result.directory),
        [str(path) for path in result.figures],
    )
