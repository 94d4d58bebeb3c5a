"""The smallest change from nominal that still breaks a requirement, as far as single steps find it.

In this order, as long as the requirement stays broken: all numbers together towards their nominal values, by bisection;
each change left out, whole signals first; each number that is left towards its nominal value, by bisection; and again,
until nothing more can be left out. What remains is minimal in this sense: no single change of it can be left out. That
there is no smaller set, and none elsewhere, is not said.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from .space import Space

_HALVINGS = 7
"""A number is as near to its nominal value as a hundredth of its deviation."""

Breaks = Callable[[Mapping[str, Any]], bool]


class _SpentError(Exception):
    """No more runs may be spent."""


def shrink(space: Space, changes: Mapping[str, Any], breaks: Breaks, budget: int) -> dict[str, Any]:
    """The smallest change that still breaks the requirement.

    Args:
        space: what is varied.
        changes: that break it.
        breaks: whether others do; costs a run.
        budget: how many runs may be spent.
    """
    return _Shrinking(space, dict(changes), breaks, budget).result()


class _Shrinking:
    def __init__(self, space: Space, changes: dict[str, Any], breaks: Breaks, budget: int) -> None:
        self._space, self._breaks, self._left = space, breaks, budget
        self._changes = {key: value for key, value in changes.items() if value != space.nominal.get(key)}

    def result(self) -> dict[str, Any]:
        try:
            self._approach(list(self._changes))
            left = len(self._changes) + 1
            while len(self._changes) < left:
                left = len(self._changes)
                self._leave_out()
                for key in list(self._changes):
                    self._approach([key])
        except _SpentError:
            pass
        return self._changes

    def _try(self, changes: dict[str, Any]) -> bool:
        """Take changes where they still break the requirement."""
        if not self._space.allows(changes):
            return False
        if self._left <= 0:
            raise _SpentError
        self._left -= 1
        if not self._breaks(changes):
            return False
        self._changes = changes
        return True

    def _leave_out(self) -> None:
        groups = [signal.keys for signal in self._space.signals] + [[key] for key in self._changes]
        for keys in groups:
            rest = {key: value for key, value in self._changes.items() if key not in keys}
            if len(rest) < len(self._changes):
                self._try(rest)

    def _approach(self, keys: list[str]) -> None:
        """Bring numbers as near to their nominal values as the requirement stays broken, all by the same share."""
        far = {key: self._changes[key] for key in keys if self._is_real(key)}
        nearest, share = 0.0, 1.0
        for _ in range(_HALVINGS if far else 0):
            middle = 0.5 * (nearest + share)
            nominal = self._space.nominal
            moved = {key: nominal[key] + middle * (value - nominal[key]) for key, value in far.items()}
            if self._try({**self._changes, **moved}):
                share = middle
            else:
                nearest = middle

    def _is_real(self, key: str) -> bool:
        """Whether a change is of a real number, whose nominal value is known."""
        return key in self._space.nominal and isinstance(self._changes.get(key), float)
