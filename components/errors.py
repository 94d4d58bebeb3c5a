"""The errors of a component's declaration, building and use; and the nearest name to a misspelt one, for messages."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class ComponentError(ValueError):
    """A component was declared, built or used wrongly; the message names it, the variable and the remedy."""


class BuildArgumentError(ComponentError):
    """A build argument is unusable; ``argument`` is its name."""

    def __init__(self, argument: str, message: str) -> None:
        super().__init__(message)
        self.argument = argument


class UnknownNameError(ComponentError, AttributeError):
    """Equations read something that their component does not have."""


def did_you_mean(word: str, valid: Iterable[str], *, cutoff: float = 0.6) -> str:
    """A clause to append to an error: ``"; did you mean 'x'?"`` with the nearest valid name, or nothing."""
    nearest = difflib.get_close_matches(word, list(valid), n=1, cutoff=cutoff)
    return f"; did you mean '{nearest[0]}'?" if nearest else ""


def nearest(name: str, known: Iterable[str]) -> str:
    """A misspelt name in quotes, with the nearest known one, or else with all of them."""
    known = list(known)
    return f"{name!r}{did_you_mean(name, known) or '; it has ' + ', '.join(sorted(known))}"
