"""Groups and orders in directed graphs, beside networkx where its answer is the only one."""

from graphlib import CycleError

import networkx as nx
import numpy as np
import pytest
from railcosim.orchestrator.wiring import circles, condensed, generations, graph_of, in_sequence, leading_to


@pytest.fixture(params=range(20))
def both(request):
    """A random graph of numbers, of some seed, as both have it."""
    random = np.random.default_rng(request.param)
    nodes = int(random.integers(1, 13))
    edges = [(int(a), int(b)) for a, b in random.integers(0, nodes, (int(random.integers(0, 2 * nodes)), 2))]
    theirs = nx.DiGraph(edges)
    theirs.add_nodes_from(range(nodes))
    return graph_of(edges, range(nodes)), theirs


def test_circles_are_the_strongly_connected_components_later_ones_first(both):
    ours, theirs = both
    found = list(circles(ours))
    assert set(found) == set(map(frozenset, nx.strongly_connected_components(theirs)))
    place = {node: k for k, group in enumerate(found) for node in group}
    assert all(place[a] >= place[b] for a, b in theirs.edges)


def test_the_condensed_graph_has_no_circles_and_the_same_generations(both):
    ours, theirs = both
    mapped = nx.condensation(theirs)
    wanted = [{frozenset(mapped.nodes[g]["members"]) for g in groups} for groups in nx.topological_generations(mapped)]
    assert [set(groups) for groups in generations(condensed(ours))] == wanted


def test_of_several_that_could_be_next_the_least_is(both):
    ours, theirs = both
    if nx.is_directed_acyclic_graph(theirs):
        wanted = nx.lexicographical_topological_sort(theirs, key=lambda node: -node)
        assert in_sequence(ours, key=lambda node: -node) == list(wanted)
    else:
        with pytest.raises(CycleError):
            in_sequence(ours, key=lambda n: -n)


def test_what_leads_to_a_node_is_its_ancestors_and_itself(both):
    ours, theirs = both
    assert leading_to(ours, [0, 99]) == nx.ancestors(theirs, 0) | {0}


def test_a_long_chain_is_no_deep_recursion():
    chain = graph_of((k, k + 1) for k in range(5000))
    assert len(list(circles(chain))) == 5001
    assert in_sequence(chain, key=int) == list(range(5001))
