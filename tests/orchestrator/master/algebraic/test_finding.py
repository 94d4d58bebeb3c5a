"""Algebraic loops: how they are found."""

from types import SimpleNamespace

import networkx as nx
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from railcosim.fmus.annotation import Annotation
from railcosim.orchestrator.master.algebraic import find_feeders, find_loops
from railcosim.orchestrator.names import SignalName
from railcosim.orchestrator.system import Connection
from railcosim.orchestrator.wiring import Link


def output(*dependencies, causality="output"):
    listed = None if dependencies == (None,) else frozenset(dependencies)
    return SimpleNamespace(dependencies=listed, causality=causality)


def model(ours=True, **outputs):
    return SimpleNamespace(annotation=Annotation() if ours else None, variables=outputs)


def link(source, target, delay=0):
    a, b = SignalName.parse(source), SignalName.parse(target)
    return Link(a, b, 1.0, 0.0, delay, False, Connection(source, target, delay))


def test_two_feed_through_blocks_in_a_circle():
    models = {"a": model(y=output("u")), "b": model(y=output("u"))}
    circle = [link("a.y", "b.u"), link("b.y", "a.u")]
    assert find_loops(models, circle) == [("a.y", "b.y")]
    assert find_loops(models, [circle[0], link("b.y", "a.u", delay=1)]) == []
    assert find_loops(models, circle[:1]) == []


def test_memory_in_the_circle_breaks_it():
    models = {"a": model(y=output("u")), "b": model(y=output())}
    assert find_loops(models, [link("a.y", "b.u"), link("b.y", "a.u")]) == []


def test_a_loop_is_of_signals_not_of_instances():
    """Two instances give to each other, but no value comes back to itself."""
    models = {"a": model(y=output("u"), z=output("v")), "b": model(y=output("u"), z=output("v"))}
    once = [link("a.y", "b.u"), link("b.y", "a.v")]
    assert find_loops(models, once) == []
    assert find_loops(models, [*once, link("a.z", "b.v"), link("b.z", "a.u")]) == [("a.y", "b.y", "a.z", "b.z")]


def test_an_instance_that_feeds_itself():
    assert find_loops({"a": model(y=output("u"))}, [link("a.y", "a.u")]) == [("a.y",)]


def test_several_loops_are_told_apart():
    models = {name: model(y=output("u")) for name in "abcd"}
    links = [link("c.y", "d.u"), link("d.y", "c.u"), link("a.y", "b.u"), link("b.y", "a.u")]
    assert find_loops(models, links) == [("a.y", "b.y"), ("c.y", "d.y")]


@pytest.mark.parametrize(("ours", "doubtful", "found"), [(True, False, 1), (False, False, 0), (False, True, 1)])
def test_what_an_output_without_a_list_counts_as(ours, doubtful, found):
    models = {"a": model(ours=ours, y=output(None))}
    assert len(find_loops(models, [link("a.y", "a.u")], doubtful=doubtful)) == found


def test_what_is_no_output_depends_on_nothing():
    models = {"a": model(p=output(None, causality="parameter"))}
    assert find_loops(models, [link("a.p", "a.u")], doubtful=True) == []


@settings(max_examples=150, deadline=None)
@given(
    st.lists(st.tuples(st.integers(0, 5), st.integers(0, 5)), max_size=9, unique_by=lambda pair: pair[1]),
    st.lists(st.booleans(), min_size=6, max_size=6),
)
def test_loops_are_the_circles_of_the_graph(pairs, direct):
    """Of blocks with one input and one output each, of which some pass their input on at once."""
    models = {f"m{k}": model(y=output(*(["u"] if direct[k] else []))) for k in range(6)}
    links = [link(f"m{a}.y", f"m{b}.u") for a, b in pairs]
    graph = nx.DiGraph([(a, b) for a, b in pairs if direct[a] and direct[b]])
    expected = {frozenset(f"m{k}.y" for k in circle) for circle in nx.simple_cycles(graph)}
    assert {frozenset(loop) for loop in find_loops(models, links)} == expected


def test_feeders_are_what_passes_on_at_once_and_not_at_samples():
    def block(*dependencies, sampled=False):
        return SimpleNamespace(sampled=sampled, variables={"y": output(*dependencies)}, inputs=frozenset("u"))

    models = {name: block("u") for name in "abcdef"} | {"s": block("u", sampled=True), "m": block()}
    pairs = [("a", "b"), ("b", "a"), ("c", "a"), ("d", "c"), ("m", "d"), ("e", "m"), ("b", "f"), ("s", "c"), ("e", "s")]
    links = [link(f"{x}.y", f"{y}.u") for x, y in pairs]
    assert find_feeders(models, links, "ab") == {"c", "d"}
    assert find_feeders(models, [*links, link("f.y", "d.u", delay=1)], "ab") == {"c", "d"}
    assert find_feeders(models, [], "ab") == set()
