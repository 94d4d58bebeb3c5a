"""Faults of a file, told once where a tool makes them everywhere."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable

_OWN = re.compile(r'"[^"]*"|\d+')
"""In what faults of one kind differ: names in double quotes, and numbers."""
_MOST = 12
"""Kinds of faults that are told of one file."""


class Faults:
    """The first of each kind, and how many there were: a million of them take no room."""

    def __init__(self) -> None:
        self._first: dict[str, str] = {}
        self._count = Counter[str]()

    def add(self, faults: Iterable[str]) -> None:
        """Note some, a sentence each."""
        for fault in faults:
            kind = _OWN.sub("", fault)
            self._first.setdefault(kind, fault)
            self._count[kind] += 1

    def join(self, others: Faults) -> None:
        """Note those of others."""
        for kind, first in others._first.items():
            self._first.setdefault(kind, first)
        self._count += others._count

    def told(self) -> list[str]:
        """A sentence for each kind."""
        told = [
            first + (f" (and {self._count[kind] - 1} more like it)" if self._count[kind] > 1 else "")
            for kind, first in list(self._first.items())[:_MOST]
        ]
        more = len(self._first) - len(told)
        return [*told, f"and {more} more kinds of faults"] if more > 0 else told
