"""`optimize`: the changes that make metrics least while requirements hold."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ...evaluation import split_metric
from ...system import System
from .evaluations import Evaluation, Evaluations
from .methods import add_known, open_study, point_of, tell_trial
from .space import Space

Told = Callable[[int, int], None]

_GROUP = 4
"""How many runs are asked for at once, whatever the number of workers."""
_HELD = 1e-12
"""A requirement that failed is missed by at least this, so that a margin of zero is no success."""


@dataclass(frozen=True)
class Optimization:
    """What an optimisation has found.

    Attributes:
        objectives: what was made least: texts as they were given, by the metric that they are.
        requirements: that had to hold. seed: of the search. runs: how many it took. failed: how many of them failed.
        evaluations: all of them, in order. best: those that hold all requirements and are beaten by no other: one, or
            with several objectives a Pareto front, by the first objective.
        errors: what failed runs said, each once.
    """

    objectives: Mapping[str, str]
    requirements: tuple[str, ...]
    seed: int
    runs: int
    failed: int
    evaluations: tuple[Evaluation, ...]
    best: tuple[Evaluation, ...]
    errors: tuple[str, ...] = ()

    def values(self, evaluation: Evaluation) -> list[float]:
        """What the objectives are in a run; NaN where one has no value."""
        return [evaluation.metrics.get(name, math.nan) for name in self.objectives]

    def is_held(self, evaluation: Evaluation) -> bool:
        """Whether a run has values and holds all requirements."""
        return _is_held(evaluation, self.requirements) and all(map(math.isfinite, self.values(evaluation)))


def read_objectives(system: System, texts: Sequence[str]) -> tuple[dict[str, str], dict[str, str]]:
    """The objectives by the metric that they are, and the metrics that the scenario does not have.

    Args:
        system: the scenario.
        texts: names of its metrics (`settling`, `gap_min[2]`), or expressions.
    """
    objectives: dict[str, str] = {}
    more: dict[str, str] = {}
    for text in texts:
        if split_metric(text)[0] in system.judged.metrics:
            objectives[text] = text
            continue
        name = f"objective_{len(objectives) + 1}"
        while name in system.judged.metrics:
            name += "_"
        objectives[name], more[name] = text, text
    return objectives, more


def minimize(
    space: Space,
    evaluations: Evaluations,
    objectives: Mapping[str, str],
    requirements: Sequence[str],
    *,
    budget: int,
    seed: int = 0,
    told: Told = lambda *_: None,
) -> Optimization:
    """Look for the changes that make metrics least; the first run is that of the scenario as it stands.

    One objective is searched for by the tree-structured Parzen estimator, several by NSGA-II.

    Args:
        space: what is varied.
        evaluations: the runs.
        objectives: metrics by flat name, with what they are called.
        requirements: that have to hold.
        budget: how many runs may be spent.
        seed: of the search.
        told: told after each run how many there were, of how many.
    """
    done: list[Evaluation] = []

    def run(many: Sequence[Mapping[str, Any]]) -> list[Evaluation]:
        found = []
        for evaluation in evaluations.run(many[: budget - len(done)]):
            found.append(evaluation)
            done.append(evaluation)
            told(len(done), budget)
        return found

    def values(evaluation: Evaluation) -> list[float]:
        return [math.nan] if evaluation.failed else [evaluation.metrics.get(name, math.nan) for name in objectives]

    (first,) = run([{}])
    study, axes = open_study(space, seed, len(objectives))
    if all(map(math.isfinite, values(first))):
        add_known(study, axes, space.origin(), values(first), _missed(first, requirements))
    while len(done) < budget:
        trials = [study.ask(axes) for _ in range(min(_GROUP, budget - len(done)))]
        points = [space.changes(point_of(trial.params, axes)) for trial in trials]
        for trial, evaluation in zip(trials, run(points), strict=True):
            finite = all(map(math.isfinite, values(evaluation)))
            for name, missed in (_missed(evaluation, requirements) if finite else {}).items():
                trial.set_constraint(name, missed)
            tell_trial(study, trial, values(evaluation) if finite else [math.nan])
    failed = [evaluation for evaluation in done if evaluation.failed]
    errors = tuple(dict.fromkeys(evaluation.error for evaluation in failed))
    best, must = _best(done, objectives, requirements), tuple(requirements)
    return Optimization(objectives, must, seed, len(done), len(failed), tuple(done), best, errors)


def _missed(evaluation: Evaluation, requirements: Sequence[str]) -> dict[str, float]:
    """By how much each requirement is missed, as Optuna wants it: 0 or less where it holds."""
    found = {}
    for name in requirements:
        score = evaluation.score(name)
        found[name] = min(-score, 0.0) if evaluation.verdicts.get(name) == "pass" else max(-score, _HELD)
    return found


def _is_held(evaluation: Evaluation, requirements: Sequence[str]) -> bool:
    return not evaluation.failed and all(evaluation.verdicts.get(name) == "pass" for name in requirements)


def _best(
    done: Sequence[Evaluation], objectives: Mapping[str, str], requirements: Sequence[str]
) -> tuple[Evaluation, ...]:
    """Those that no other beats: none is as good in all objectives and better in one. Of equals the first."""
    held: dict[tuple[float, ...], Evaluation] = {}
    for evaluation in done:
        values = tuple(evaluation.metrics.get(name, math.nan) for name in objectives)
        if _is_held(evaluation, requirements) and all(map(math.isfinite, values)):
            held.setdefault(values, evaluation)
    front = [
        values
        for values in held
        if not any(other != values and all(a <= b for a, b in zip(other, values, strict=True)) for other in held)
    ]
    return tuple(held[values] for values in sorted(front))
