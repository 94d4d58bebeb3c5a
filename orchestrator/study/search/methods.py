"""How a search moves in the cube: at random, by CMA-ES, by Optuna's tree-structured Parzen estimator, by gradients.

A method is asked for so many points and told what they are worth. Which points it asks for depends on its seed and on
what it was told, and on nothing else: not on how many workers there are.
"""

from __future__ import annotations

import math
import warnings
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .space import Space

Array = NDArray[np.float64]
Slope = Callable[[Array], Array]
"""The gradient of what is sought the least of, at a point, (size,)."""

_WIDTH = 0.3
"""Of the first steps of CMA-ES and of a descent, as a part of the cube."""
_NEAR = 0.01
"""Steps so small, as a part of the cube, count as stuck: digits of a margin that holds break nothing."""
_LITTLE = 1e-3
"""Which part of the largest slope counts as none."""
_MOST = 64
"""The largest population of CMA-ES: on a plateau it is stuck each time at once."""
_GROUP = 4
"""How many points the estimator is asked for at once: more would be worse chosen, fewer would leave workers idle."""
_RANDOM_GROUP = 16


def flat(point: Array) -> Array:
    """No slope."""
    return np.zeros_like(point)


class Method(ABC):
    """A way to look for the least score.

    Args:
        space: what is varied. seed: of its luck. first, score: the scenario's own point, and what it is worth.
        slope: of the score, for a method that uses it.
    """

    def __init__(self, space: Space, seed: int, first: Array, score: float, slope: Slope = flat) -> None:
        self._space, self._seed, self._first, self._score, self._slope = space, seed, first, score, slope
        self._luck = np.random.default_rng(seed)

    @abstractmethod
    def ask(self) -> list[Array]:
        """The next points, (size,) each."""

    @abstractmethod
    def tell(self, scores: Sequence[float]) -> None:
        """What the points that were asked for last are worth: less is nearer; NaN where a run failed."""


class Random(Method):
    """Uniformly in the cube: the control, which any other has to beat."""

    def ask(self) -> list[Array]:
        """The next points."""
        return list(self._luck.random((_RANDOM_GROUP, self._space.size)))

    def tell(self, scores: Sequence[float]) -> None:
        """It learns nothing."""


class CmaEs(Method):
    """Covariance matrix adaptation from the scenario's own point; started anew elsewhere, twice as wide, when stuck."""

    def __init__(self, space: Space, seed: int, first: Array, score: float, slope: Slope = flat) -> None:
        super().__init__(space, seed, first, score, slope)
        self._population = 4 + int(3 * math.log(space.size))
        self._strategy = self._start(first)

    def _start(self, at: Array) -> Any:
        import cma

        options = {
            "bounds": [0.0, 1.0],
            "tolx": _NEAR,
            "popsize": self._population,
            "randn": lambda *shape: self._luck.standard_normal(shape),
            "seed": math.nan,  # its luck is ours, not NumPy's for all
            "verbose": -9,
        }
        # One axis is too few for it: a second one that means nothing.
        start = np.append(at, [0.5] * (len(at) == 1))
        return cma.CMAEvolutionStrategy(start.tolist(), _WIDTH, options)

    def ask(self) -> list[Array]:
        """The next population."""
        if self._strategy.stop():
            self._population = min(2 * self._population, _MOST)
            self._strategy = self._start(self._luck.random(self._space.size))
        self._asked = self._strategy.ask()
        return [np.asarray(point)[: self._space.size] for point in self._asked]

    def tell(self, scores: Sequence[float]) -> None:
        """A failed run counts as the worst of the population."""
        worst = max((score for score in scores if not math.isnan(score)), default=0.0)
        self._strategy.tell(self._asked, [worst if math.isnan(score) else score for score in scores])


class Tpe(Method):
    """Optuna's tree-structured Parzen estimator over all axes at once."""

    def __init__(self, space: Space, seed: int, first: Array, score: float, slope: Slope = flat) -> None:
        super().__init__(space, seed, first, score, slope)
        self._study, self._axes = open_study(space, seed)
        if not math.isnan(score):
            add_known(self._study, self._axes, first, [score])

    def ask(self) -> list[Array]:
        """The next points."""
        self._trials = [self._study.ask(self._axes) for _ in range(_GROUP)]
        return [point_of(trial.params, self._axes) for trial in self._trials]

    def tell(self, scores: Sequence[float]) -> None:
        """A failed run counts for nothing."""
        for trial, score in zip(self._trials, scores, strict=True):
            tell_trial(self._study, trial, [score])


class Gradient(Method):
    """Projected descent by the score's slope from the scenario's own point; started anew elsewhere when stuck.

    All axes with a slope move by the same length: in the cube that is steepest, and a corner, where most requirements
    break, is few steps away. The length is doubled where a run was worth less, and else quartered. What is no number
    stays as it was drawn at the start.
    """

    def __init__(self, space: Space, seed: int, first: Array, score: float, slope: Slope = flat) -> None:
        super().__init__(space, seed, first, score, slope)
        self._length = _WIDTH
        self._direction = self._downwards(first, score)

    def _downwards(self, at: Array, score: float) -> Array | None:
        """Where to go from a point of the cube, -1, 0 or 1 along each axis; None where nowhere is lower."""
        self._at, self._score = at, score
        if math.isnan(score):
            return None
        slope = np.array(self._slope(at))
        slope[((at <= 0.0) & (slope > 0.0)) | ((at >= 1.0) & (slope < 0.0))] = 0.0
        most = float(np.abs(slope).max())
        return np.where(np.abs(slope) > _LITTLE * most, -np.sign(slope), 0.0) if 0.0 < most < math.inf else None

    def ask(self) -> list[Array]:
        """The next point of a descent, or where another begins."""
        if self._direction is None:
            self._asked = self._luck.random(self._space.size)
        else:
            self._asked = np.clip(self._at + self._length * self._direction, 0.0, 1.0)
        return [self._asked]

    def tell(self, scores: Sequence[float]) -> None:
        """A failed run is no step down, and no descent begins there."""
        if self._direction is None:
            self._length = _WIDTH
            self._direction = self._downwards(self._asked, scores[0])
        elif scores[0] < self._score:
            self._length = min(2.0 * self._length, 1.0)
            self._direction = self._downwards(self._asked, scores[0])
        else:
            self._length /= 4.0
            self._direction = None if self._length < _NEAR else self._direction


METHODS: dict[str, type[Method]] = {"cma-es": CmaEs, "tpe": Tpe, "random": Random, "gradient": Gradient}
"""The methods by name, the default one first."""
SLOPING = frozenset({"gradient"})
"""Those that need slopes."""


def open_study(space: Space, seed: int, objectives: int = 1) -> tuple[Any, Mapping[str, Any]]:
    """Optuna's study in memory, and its axes: numbers from 0 to 1, or which of so many things."""
    import optuna

    optuna.logging.set_verbosity(optuna.logging.ERROR)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", optuna.exceptions.ExperimentalWarning)
        if objectives == 1:
            sampler: Any = optuna.samplers.TPESampler(seed=seed, multivariate=True, constant_liar=True)
        else:
            sampler = optuna.samplers.NSGAIISampler(seed=seed)
    study = optuna.create_study(directions=["minimize"] * objectives, sampler=sampler)
    axes: dict[str, Any] = {
        key: optuna.distributions.CategoricalDistribution(list(range(count)))
        if count
        else optuna.distributions.FloatDistribution(0.0, 1.0)
        for key, count in zip(space.keys, space.choices, strict=True)
    }
    return study, axes


def point_of(params: Mapping[str, Any], axes: Mapping[str, Any]) -> Array:
    """The point of the cube that Optuna's values mean: of a choice the middle of its share."""
    return np.array(
        [
            (params[key] + 0.5) / len(axis.choices) if hasattr(axis, "choices") else params[key]
            for key, axis in axes.items()
        ]
    )


def tell_trial(study: Any, trial: Any, values: Sequence[float]) -> None:
    """Tell a study what a trial is worth; one that failed counts for nothing."""
    import optuna

    if any(map(math.isnan, values)):
        study.tell(trial, state=optuna.trial.TrialState.FAIL)
    else:
        study.tell(trial, list(values))


def add_known(
    study: Any,
    axes: Mapping[str, Any],
    point: Array,
    values: Sequence[float],
    constraints: Mapping[str, float] | None = None,
) -> None:
    """Let a study know a point that it has not asked for."""
    import optuna

    params = {
        key: min(int(share * len(axis.choices)), len(axis.choices) - 1) if hasattr(axis, "choices") else float(share)
        for (key, axis), share in zip(axes.items(), point, strict=True)
    }
    known = optuna.trial.create_trial(
        params=params, distributions=dict(axes), values=list(values), constraints=dict(constraints or {})
    )
    study.add_trial(known)
