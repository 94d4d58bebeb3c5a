"""The nearest name to a misspelt one, for every message that has one to suggest. Imports nothing of this project."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


def did_you_mean(word: str, valid: Iterable[str], *, cutoff: float = 0.6) -> str:
    """A clause to append to an error: ``"; did you mean 'x'?"`` with the nearest valid name, or nothing."""
    nearest = difflib.get_close_matches(word, list(valid), n=1, cutoff=cutoff)
    return f"; did you mean '{nearest[0]}'?" if nearest else ""


def nearest(name: str, known: Iterable[str]) -> str:
    """A misspelt name in quotes, with the nearest known one, or else with all of them."""
    known = list(known)
    return f"{name!r}{did_you_mean(name, known) or '; it has ' + ', '.join(sorted(known))}"
