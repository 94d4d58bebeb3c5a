"""Algebraic loops: where values depend on themselves at one instant, found in the dependencies that the FMUs list."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from ...fmi import Interface
from ...wiring import Link, circles, graph_of, is_direct, leading_to


def find_loops(
    interfaces: Mapping[str, Interface], links: Iterable[Link], *, doubtful: bool = False
) -> list[tuple[str, ...]]:
    """The algebraic loops of a system: for each the connected outputs that depend on each other, by full name.

    An output whose FMU lists no dependencies counts as `wiring.is_direct` has it: of another maker as independent, of
    ours as dependent on all inputs. Delayed connections break a loop.

    Args:
        interfaces: of the instances.
        links: scalar connections.
        doubtful: whether every output without a list counts as dependent on all inputs, as the standard has it.
    """
    links = [link for link in links if not link.delay]
    inputs: dict[str, set[str]] = {}
    edges: list[tuple[tuple[str, str, str], tuple[str, str, str]]] = []
    for link in links:
        edges.append((("output", *link.source), ("input", *link.target)))
        inputs.setdefault(link.target[0], set()).add(link.target[1])
    for instance, name in {link.source for link in links}:
        interface = interfaces[instance]
        output = interface.variables[name]
        if output.causality != "output":
            continue
        listed = output.dependencies
        fed = inputs.get(instance, set())
        depends = (fed if interface.annotation or doubtful else set()) if listed is None else fed & listed
        edges += ((("input", instance, i), ("output", instance, name)) for i in depends)
    order = {tuple(link.source): k for k, link in reversed(list(enumerate(links)))}
    found = []
    for members in circles(graph_of(edges)):
        outputs = sorted((node[1:] for node in members if node[0] == "output"), key=order.__getitem__)
        if len(members) > 1:
            found.append(tuple(".".join(output) for output in outputs))
    return sorted(found)


def find_feeders(interfaces: Mapping[str, Interface], links: Iterable[Link], members: Iterable[str]) -> set[str]:
    """Instances through which what members of a loop are given passes at once, from input to output.

    Sampled ones are none: what they give is of their last sample.
    """
    links = [
        link
        for link in links
        if not link.delay
        and is_direct(interfaces[link.source[0]], interfaces[link.source[0]].variables[link.source[1]])
        and not interfaces[link.source[0]].sampled
    ]
    within = set(members)
    return leading_to(graph_of((link.source[0], link.target[0]) for link in links), within) - within
