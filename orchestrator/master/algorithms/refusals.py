"""Sentences about several instances."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from ...problems import Problem

_SHOWN = 6


def cannot(names: Sequence[str], what: str, remedy: str) -> Iterable[Problem]:
    """One refusal that names them all, if there are any."""
    if names:
        yield Problem(listed(names), what, remedy)


def listed(names: Sequence[str]) -> str:
    """The first few of them, and how many more there are."""
    return ", ".join(names[:_SHOWN]) + (f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else "")
