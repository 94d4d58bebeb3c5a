"""The drawing of the wiring: a box stands right of what it listens to, what is late is dashed."""

import re
import xml.etree.ElementTree as ET

from railcosim.orchestrator.report.wiring import draw_wiring


def drawn(instances, wires, **record):
    told = {
        "instances": {name: {"model": f"Model<{name}>"} for name in instances},
        "connections": [{"source": f"{a}.y", "target": f"{b}.u", "delay": 0} for a, b in wires],
    }
    return ET.fromstring(draw_wiring(told | record))


def places(figure):
    return {
        box.find("text").text: (float(box.find("rect").get("x")), float(box.find("rect").get("y")))
        for box in figure.iter("g")
    }


def paths(figure):
    return {
        path.find("title").text: path.get("class") for path in figure.iter("path") if path.find("title") is not None
    }


def test_a_chain():
    found = places(drawn("abc", [("a", "b"), ("b", "c")]))
    assert found["a"][0] < found["b"][0] < found["c"][0]


def test_late_connections_are_dashed_and_break_loops():
    late = ["a.u receives b.y one communication step late: the order has a cycle there"]
    figure = drawn("ab", [("a", "b"), ("b", "a")], late=late, order=["a", "b"])
    assert paths(figure) == {"a to b: 1 connection": "wire", "b to a: 1 connection, late": "wire late"}
    assert sorted(places(figure)) == ["1. a", "2. b"]


def test_loops_and_twins():
    figure = drawn("abc", [("a", "b"), ("a", "b"), ("b", "a"), ("c", "c"), ("c", "unknown")], order=None)
    assert paths(figure) == {"a to b: 2 connections": "wire", "b to a: 1 connection": "wire"}
    assert len(set(places(figure).values())) == 3


def test_many_instances_are_drawn_by_group():
    names = [f"train[{k}]" for k in range(70)] + ["target"]
    figure = drawn(names, [("target", name) for name in names[:-1]] + [("train[1]", "train[2]")])
    assert places(figure).keys() == {"train", "target"}
    assert paths(figure) == {"target to train: 70 connections": "wire"}
    assert re.search("71 instances", figure.find("figcaption").text)


def test_long_names_are_cut_and_said():
    figure = drawn(["a" * 40], [])
    (box,) = figure.iter("g")
    assert box.find("text").text == "a" * 20 + "…"
    assert box.find("title").text.startswith("a" * 40)
