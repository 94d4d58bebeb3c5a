"""The document of list."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from ...driving import ListedCase
from ...scenario import Listed


@dataclass(frozen=True)
class ListDocument:
    """The shipped scenarios with their presets, cases of driving, and components and master algorithms, explained."""

    scenarios: list[Listed]
    drives: list[ListedCase]
    components: dict[str, str]
    algorithms: dict[str, str]


def list_document(
    scenarios: Iterable[Listed],
    drives: Iterable[ListedCase],
    components: Mapping[str, str],
    algorithms: Mapping[str, str],
) -> ListDocument:
    """The document of what there is."""
    return ListDocument(list(scenarios), list(drives), dict(components), dict(algorithms))
