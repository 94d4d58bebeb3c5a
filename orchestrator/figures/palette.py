"""Which colour a thing has: the same in all panels of a figure, and a line with a name of its own in all figures."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from .curves import Curve
from .style import colour

Figure = Sequence[Sequence[Curve]]
"""The curves of a figure, panel by panel."""


class Palette:
    """Colours of things.

    Members of a family (trains) are coloured by their rank in the figure. A name takes the first colour that no name
    has with which it shares a figure.
    """

    def __init__(self, figures: Iterable[Figure]) -> None:
        self._places: dict[str, int] = {}
        shared: dict[str, set[str]] = {}
        for figure in figures:
            names = list(dict.fromkeys(c.thing for panel in figure for c in panel if isinstance(c.thing, str)))
            for name in names:
                shared.setdefault(name, set()).update(names)
        for name, others in shared.items():
            taken = {self._places[other] for other in others if other in self._places}
            self._places[name] = next(k for k in range(len(taken) + 1) if k not in taken)

    def place(self, name: str) -> int:
        """Which colour a name has."""
        return self._places[name]


def ranks(figure: Figure) -> dict[tuple[int, ...], tuple[int, int]]:
    """The rank of each numbered thing of a figure, and among how many: those with as many numbers."""
    found: dict[tuple[int, ...], tuple[int, int]] = {}
    shown = {c.thing for panel in figure for c in panel if isinstance(c.thing, tuple)}
    for length in {len(thing) for thing in shown}:
        alike = sorted(thing for thing in shown if len(thing) == length)
        found |= {thing: (rank, len(alike)) for rank, thing in enumerate(alike)}
    return found


def member_colour(curve: Curve, found: Mapping[tuple[int, ...], tuple[int, int]]) -> Any:
    """The colour of a member of a family."""
    assert isinstance(curve.thing, tuple)
    return colour(*found[curve.thing])
