"""The order in which instances step, derived from direct feed-through.

Where an output depends directly on an input of its FMU (a controller's force), that FMU steps before the receiver,
which then gets the value computed from this communication point. Otherwise (a plant's position) it steps after the
receiver, which thus gets the value *of* this communication point. Every connection then carries one time stamp.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from graphlib import CycleError

from .graphs import condensed, generations, graph_of, in_sequence
from .links import Link


@dataclass(frozen=True)
class Order:
    """The order, and the connections it cannot serve.

    Attributes:
        sequence: instance names as they step.
        late: one sentence per pair of instances whose connection is a step late or mixes time stamps.
    """

    sequence: tuple[str, ...]
    late: tuple[str, ...]


def derive_order(instances: Sequence[str], links: Iterable[Link], chosen: Sequence[str] = ()) -> Order:
    """The order of a Gauss-Seidel sweep.

    Args:
        instances: all of them; their sequence breaks ties.
        links: the connections; delayed ones do not constrain the order.
        chosen: the user's own order, which then is only checked.
    """
    bound = [link for link in links if not link.delay]
    sequence = tuple(chosen) if chosen else _sort(instances, [x for x in bound if x.source[0] != x.target[0]])
    return Order(sequence, tuple(_late(sequence, bound)))


def _before(link: Link) -> tuple[str, str]:
    """Which instance is to step first, which second."""
    a, b = link.source[0], link.target[0]
    return (a, b) if link.direct else (b, a)


def _sort(instances: Sequence[str], links: Sequence[Link]) -> tuple[str, ...]:
    rank = {name: k for k, name in enumerate(instances)}
    sequence: list[str] = []
    for generation in generations(condensed(graph_of(map(_before, links), instances))):
        groups = [sorted(group, key=rank.__getitem__) for group in generation]
        for group in sorted(groups, key=lambda members: rank[members[0]]):
            sequence.extend(_sort_cycle(group, links, rank))
    return tuple(sequence)


def _sort_cycle(members: list[str], links: Sequence[Link], rank: dict[str, int]) -> list[str]:
    """Inside a cycle something must be late; keep feed-through first, then the order of declaration."""
    if len(members) == 1:
        return members
    inside = set(members)
    edges = (_before(x) for x in links if x.direct and inside >= {x.source[0], x.target[0]})
    try:
        return in_sequence(graph_of(edges, members), key=rank.__getitem__)
    except CycleError:
        return members


def _late(sequence: Sequence[str], links: Sequence[Link]) -> Iterable[str]:
    at = {name: k for k, name in enumerate(sequence)}
    told: set[tuple[str, str]] = set()
    for link in links:
        first, second = _before(link)

        in_time = at[first] < at[second] or (first == second and not link.direct)
        if in_time or (link.source[0], link.target[0]) in told:
            continue
        told.add((link.source[0], link.target[0]))
        if link.direct:
            yield f"{link.target} receives {link.source} one communication step late: the order has a cycle there"
        else:
            late = f"{link.target} receives {link.source} of the end of the step instead of its begin"
            yield f"{late}: the order has a cycle there"
