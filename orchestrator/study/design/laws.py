"""The distributions that people write, such as `normal(400e3, 20e3)`, drawn by SciPy.

SciPy is imported where it is used: importing its distributions costs more than most commands take.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import ScenarioError
from ...problems import Problem, suggestion

_CALL = re.compile(r"([A-Za-z_]\w*)\s*\(([^()]*)\)")


@dataclass(frozen=True)
class _Kind:
    """What a distribution takes, what must hold of it, and SciPy's distribution."""

    takes: tuple[str, ...]
    holds: Callable[..., bool]
    must: str
    frozen: Callable[..., Any]
    may_be_infinite: tuple[str, ...] = ()
    is_whole: bool = False


def _uniform(low: float, high: float) -> Any:
    from scipy import stats

    return stats.uniform(low, high - low)


def _loguniform(low: float, high: float) -> Any:
    from scipy import stats

    return stats.loguniform(low, high)


def _normal(mean: float, sd: float) -> Any:
    from scipy import stats

    return stats.norm(mean, sd)


def _triangular(low: float, mode: float, high: float) -> Any:
    from scipy import stats

    return stats.triang((mode - low) / (high - low), low, high - low)


def _truncnormal(mean: float, sd: float, low: float, high: float) -> Any:
    from scipy import stats

    return stats.truncnorm((low - mean) / sd, (high - mean) / sd, mean, sd)


def _integers(low: float, high: float) -> Any:
    from scipy import stats

    return stats.randint(int(low), int(high) + 1)


def _are_whole(low: float, high: float) -> bool:
    return low < high and low.is_integer() and high.is_integer() and max(abs(low), abs(high)) <= 2**53


_KINDS = {
    "uniform": _Kind(("low", "high"), lambda low, high: low < high, "low < high", _uniform),
    "loguniform": _Kind(("low", "high"), lambda low, high: 0 < low < high, "0 < low < high", _loguniform),
    "normal": _Kind(("mean", "sd"), lambda _, sd: sd > 0, "sd > 0", _normal),
    "triangular": _Kind(
        ("low", "mode", "high"),
        lambda low, mode, high: low <= mode <= high and low < high,
        "low <= mode <= high, and low < high",
        _triangular,
    ),
    "truncnormal": _Kind(
        ("mean", "sd", "low", "high"),
        lambda _, sd, low, high: sd > 0 and low < high,
        "sd > 0 and low < high",
        _truncnormal,
        may_be_infinite=("low", "high"),
    ),
    "integers": _Kind(("low", "high"), _are_whole, "whole numbers, low < high, up to 2**53", _integers, is_whole=True),
}
LAWS = tuple(_KINDS)
"""The names of the distributions."""


@dataclass(frozen=True)
class Law:
    """A distribution of one number: its name and its numbers, in the order people write them.

    Raises:
        ScenarioError: there is none of that name, or these are not its numbers.
    """

    name: str
    numbers: tuple[float, ...]

    def __post_init__(self) -> None:
        kind = _KINDS.get(self.name)
        if kind is None:
            near = suggestion(self.name, LAWS) or f"there are {', '.join(LAWS)}; quote a text"
            raise ScenarioError(Problem("", f"there is no distribution '{self.name}'", near))
        form = f"{self.name}({', '.join(kind.takes)})"
        if len(self.numbers) != len(kind.takes):
            raise ScenarioError(Problem("", f"has {len(self.numbers)} of {len(kind.takes)} numbers", f"write {form}"))
        for word, value in zip(kind.takes, self.numbers, strict=True):
            if math.isnan(value):
                raise ScenarioError(f"{word} of {form} is no number")
            if math.isinf(value) and word not in kind.may_be_infinite:
                raise ScenarioError(f"{word} of {form} must be finite")
        if not kind.holds(*self.numbers):
            raise ScenarioError(Problem("", f"{form} needs {kind.must}"))

    @classmethod
    def read(cls, text: str) -> Law | None:
        """`normal(400e3, 20e3)`; None where the text has not the form of a distribution.

        Raises:
            ScenarioError: it has, and is none.
        """
        match = _CALL.fullmatch(text)
        if match is None:
            return None
        words = [word.strip() for word in match[2].split(",")]
        try:
            numbers = tuple(map(float, words))
        except ValueError:
            bad = next(word for word in words if not _is_number(word))
            raise ScenarioError(Problem("", f"'{bad}' is no number", "quote a text that is no distribution")) from None
        return cls(match[1], numbers)

    def at(self, shares: NDArray[np.float64]) -> NDArray[Any]:
        """The numbers below which given shares of the distribution lie: its quantile function.

        Args:
            shares: (n,), from 0 to 1.

        Returns:
            (n,), float64; int64 of whole numbers.
        """
        drawn: NDArray[Any] = self._frozen.ppf(shares)
        return drawn.astype(np.int64) if _KINDS[self.name].is_whole else drawn

    @cached_property
    def _frozen(self) -> Any:
        return _KINDS[self.name].frozen(*self.numbers)

    def __str__(self) -> str:
        return f"{self.name}({', '.join(repr(value).removesuffix('.0') for value in self.numbers)})"


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True
