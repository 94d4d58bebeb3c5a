"""Sentences about several instances."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

_SHOWN = 6


def cannot(names: Sequence[str], what: str) -> Iterable[str]:
    """One refusal that names them all, if there are any."""
    if names:
        yield f"{listed(names)}: {what}"


def listed(names: Sequence[str]) -> str:
    """The first few of them, and how many more there are."""
    return ", ".join(names[:_SHOWN]) + (f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else "")
