"""The document of list."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from ...scenario import Listed


@dataclass(frozen=True)
class ListDocument:
    """The shipped scenarios with their presets, and the components and master algorithms with what they are."""

    scenarios: list[Listed]
    components: dict[str, str]
    algorithms: dict[str, str]


def list_document(
    scenarios: Iterable[Listed], components: Mapping[str, str], algorithms: Mapping[str, str]
) -> ListDocument:
    """The document of what there is."""
    return ListDocument(list(scenarios), dict(components), dict(algorithms))
