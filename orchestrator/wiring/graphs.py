"""Directed graphs of instances or signals: what acts on each other, and the order of the rest.

A graph has for each node those that come after it. (networkx takes longer to load than a run takes.)
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping
from graphlib import TopologicalSorter
from heapq import heapify, heappop, heappush
from typing import TypeAlias, TypeVar

T = TypeVar("T", bound=Hashable)
Graph: TypeAlias = Mapping[T, Iterable[T]]


def graph_of(edges: Iterable[tuple[T, T]], nodes: Iterable[T] = ()) -> dict[T, dict[T, None]]:
    """The graph of some edges, each from a node to a later one, and of nodes that may have none; in their order."""
    graph: dict[T, dict[T, None]] = {node: {} for node in nodes}
    for before, after in edges:
        graph.setdefault(before, {})[after] = None
        graph.setdefault(after, {})
    return graph


def circles(graph: Graph[T]) -> Iterator[frozenset[T]]:
    """Its nodes in groups: those that lead to each other together, any other alone; later groups first.

    Source: R. Tarjan, Depth-first search and linear graph algorithms, SIAM J. Comput. 1 (1972), without recursion.
    """
    seen: dict[T, int] = {}
    lowest: dict[T, int] = {}
    open_: list[T] = []
    grouped: set[T] = set()
    for root in graph:
        path = [] if root in seen else [(root, iter(graph[root]))]
        while path:
            node, after = path[-1]
            if node not in seen:
                seen[node] = lowest[node] = len(seen)
                open_.append(node)
            for one in after:
                if one not in seen:
                    path.append((one, iter(graph[one])))
                    break
                if one not in grouped:
                    lowest[node] = min(lowest[node], lowest[one])
            else:
                path.pop()
                if path:
                    lowest[path[-1][0]] = min(lowest[path[-1][0]], lowest[node])
                if lowest[node] == seen[node]:
                    group = {open_.pop()}
                    while node not in group:
                        group.add(open_.pop())
                    grouped |= group
                    yield frozenset(group)


def condensed(graph: Graph[T]) -> dict[frozenset[T], dict[frozenset[T], None]]:
    """The graph of its `circles`, which has none itself."""
    group_of = {node: group for group in circles(graph) for node in group}
    edges = ((group_of[node], group_of[one]) for node, after in graph.items() for one in after)
    return graph_of(((a, b) for a, b in edges if a is not b), group_of.values())


def generations(graph: Graph[T]) -> Iterator[tuple[T, ...]]:
    """The nodes of a graph without circles: those that nothing comes before, then those that only these do, ...

    Raises:
        graphlib.CycleError: it has a circle.
    """
    sorter = _sorter(graph)
    while sorter.is_active():
        yield (ready := sorter.get_ready())
        sorter.done(*ready)


def in_sequence(graph: Graph[T], key: Callable[[T], int]) -> list[T]:
    """The nodes of a graph without circles, none before those that lead to it; of several the one of the least key.

    Args:
        graph: without circles.
        key: a number of its own for each node.

    Raises:
        graphlib.CycleError: it has a circle.
    """
    sorter, found = _sorter(graph), []
    ready = [(key(node), node) for node in sorter.get_ready()]
    heapify(ready)
    while ready:
        _, node = heappop(ready)
        found.append(node)
        sorter.done(node)
        for one in sorter.get_ready():
            heappush(ready, (key(one), one))
    return found


def leading_to(graph: Graph[T], ends: Iterable[T]) -> set[T]:
    """Some nodes of it and all that lead to them, whatever the way."""
    before: dict[T, list[T]] = {node: [] for node in graph}
    for node, after in graph.items():
        for one in after:
            before[one].append(node)
    found, waiting = set(), [end for end in ends if end in before]
    while waiting:
        node = waiting.pop()
        if node not in found:
            found.add(node)
            waiting += before[node]
    return found


def _sorter(graph: Graph[T]) -> TopologicalSorter[T]:
    sorter: TopologicalSorter[T] = TopologicalSorter(dict.fromkeys(graph, ()))
    for node, after in graph.items():
        for one in after:
            sorter.add(one, node)
    sorter.prepare()
    return sorter
