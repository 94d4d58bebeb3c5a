"""`falsify`: the search for the run that breaks a requirement."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from .evaluations import Evaluation, Evaluations
from .methods import METHODS, Slope, flat
from .shrinking import shrink
from .space import Space

Told = Callable[[int, int, float], None]
"""Told of each run: how many there were, of how many, and the least margin so far, in the unit of what is compared."""


@dataclass(frozen=True)
class Falsification:
    """What a search has found.

    Attributes:
        requirement: that was to be broken. method, seed: of the search.
        runs: how many the search took; those that made the counterexample small are counted apart in ``shrinking``.
        failed: how many of all runs could not be judged.
        nearest: the run with the least margin; the one that breaks the requirement where it is broken.
        found: whether it is broken.
        changes: the smallest change from nominal that was found to break it; empty where nothing was.
        errors: what failed runs said, each once.
    """

    requirement: str
    method: str
    seed: int
    runs: int
    shrinking: int
    failed: int
    nearest: Evaluation | None
    found: bool
    changes: Mapping[str, Any] = field(default_factory=dict)
    errors: tuple[str, ...] = ()


def search(
    space: Space,
    evaluations: Evaluations,
    requirement: str,
    *,
    budget: int,
    method: str = "cma-es",
    seed: int = 0,
    shrinking: int | None = None,
    slope: Slope = flat,
    told: Told | None = None,
) -> Falsification:
    """Look for changes that break a requirement; the first run is that of the scenario as it stands.

    Args:
        space: what is varied.
        evaluations: the runs.
        requirement: by name.
        budget: how many runs may be spent on the search, the first one included.
        method: one of `METHODS`.
        seed: of the method's luck.
        shrinking: how many runs may be spent on making small what is found; as many as on the search by default.
        slope: of the requirement's margin, where the method needs it.
        told: told of each run.
    """
    nearest: Evaluation | None = None
    least = math.inf
    count = 0

    def judged(evaluation: Evaluation) -> float:
        nonlocal nearest, least, count
        count += 1
        score = evaluation.score(requirement)
        if evaluation.breaks(requirement) or score < least:
            nearest, least = evaluation, score
        if told is not None:
            told(count, budget, math.nan if nearest is None else nearest.margins.get(requirement, math.nan))
        return score

    def is_broken() -> bool:
        return nearest is not None and nearest.breaks(requirement)

    first = judged(next(evaluations.run([{}])))
    moving = METHODS[method](space, seed, space.origin(), first, slope)
    while count < budget and not is_broken():
        points = moving.ask()
        scores = []
        for evaluation in evaluations.run([space.changes(point) for point in points][: budget - count]):
            scores.append(judged(evaluation))
            if is_broken():
                break
        if len(scores) == len(points):
            moving.tell(scores)
    found, spent = is_broken(), len(evaluations.done)
    changes: Mapping[str, Any] = {}
    if nearest is not None and found:

        def breaks(tried: Mapping[str, Any]) -> bool:
            return next(evaluations.run([tried])).breaks(requirement)

        changes = shrink(space, nearest.changes, breaks, budget if shrinking is None else shrinking)
    failed = [evaluation for evaluation in evaluations.done if evaluation.failed]
    errors = tuple(dict.fromkeys(evaluation.error for evaluation in failed))
    more = len(evaluations.done) - spent
    return Falsification(requirement, method, seed, count, more, len(failed), nearest, found, changes, errors)
