"""What a component declares of its own variables: flags that make inputs matter, arrays that must rise."""

import pytest
from railcosim.orchestrator.system import System

BODY = """
from railcosim.components.maths import where


class Source(Base):
    y = Output("m")
    on = Output("1", bool)

    def outputs(self):
        return {"y": 1.0, "on": True}


class Listener(Base):
    there = Input("1", False, optional=True)
    near = Input("1", True, optional=True)
    signal = Input("m", flag=there)
    row = Input("m", shape=(2,), flag=there)
    ignored = Input("m", flag=there)
    close = Input("m", flag=near)
    y = Output("m")

    def outputs(self):
        signal = where(self.there, self.signal + self.row[0] + self.row[1], 0.0)
        return {"y": signal + where(self.near, self.close, 0.0)}
"""


@pytest.fixture
def told(components, resolve):
    """The problems of a listener with these start values and connections, as text."""
    mine = components(BODY)

    def run(starts, connections=()):
        system = System()
        system.add("source", mine("Source"))
        system.add(
            "b",
            mine("Listener"),
            **{name: value for name, value in ({"near": False} | starts).items() if value is not None},
        )
        for output, target in connections:
            system.connect(f"source.{output}", f"b.{target}")
        return [str(problem) for problem in resolve(system).problems]

    return run


def test_a_true_flag_makes_its_inputs_matter(told):
    """All that are used: `ignored` is not."""
    assert told({"there": True}) == [
        f"b.{name} is read, because b.there is true, and nothing feeds it; connect it, or set b.there = false"
        for name in ("signal", "row[1]", "row[2]")
    ]
    assert told({"there": True, "row": 0.0}, [("y", "signal")]) == []


def test_a_flag_that_is_true_by_itself_does_too(told):
    (problem,) = told({"near": None})
    assert problem.startswith("b.close is read, because b.near is true, and nothing feeds it")
    assert told({"near": None, "close": 3.0}) == []


def test_a_connected_flag_may_be_true(told):
    problems = told({"row": 0.0}, [("on", "there")])
    assert problems == [
        "b.signal is read, because b.there is connected, and nothing feeds it; connect it, or leave b.there unconnected"
    ]


def test_a_forgotten_flag_is_told_and_one_that_is_meant_is_not(told):
    (problem,) = told({}, [("y", "signal")])
    assert problem.startswith("b.signal is connected, but b.there is false by itself, so that it is not read; set ")
    assert told({"there": False}, [("y", "signal")]) == []
    assert told({}, [("y", "ignored")]) == []


def test_nothing_is_said_of_what_is_left_alone(told):
    assert told({}) == []


@pytest.mark.parametrize(
    ("starts", "said"),
    [
        ({"times": [0.0, 20.0, 10.0]}, ["s.times: its values must rise, and times[3] = 10 follows 20"]),
        ({"times": [0.0, 10.0, 10.0]}, ["s.times: its values must rise, and times[3] = 10 follows 10"]),
        ({"times[3]": 7.0}, ["s.times: its values must rise, and times[2] = 0 follows 0; give s.times values"]),
        ({}, ["s.times: its values must rise, and times[2] = 0 follows 0; give s.times values"]),
        ({"times": [0.0, 10.0]}, ["s.times: takes 3 values, 2 given"]),
        ({"times": [-1.0, 10.0, 20.0]}, []),
    ],
)
def test_breakpoints_that_do_not_rise_are_told(resolve, starts, said):
    """Given as an array, one by one, or not at all; where they are wrong otherwise, that alone."""
    system = System()
    system.add("s", "Schedule", {"points": 3}, **starts)
    assert [str(problem) for problem in resolve(system).problems] == said


CURVE = [{"position": 0.0, "gradient": 0.01, "radius": 300.0}]


@pytest.mark.parametrize(
    ("more", "start", "sources"),
    [
        ((), {}, ["line.curve_resistance"]),
        ((("line.curve_resistance", "train.curve_resistance"),), {}, ["line.curve_resistance"]),
        ((), {"curve_resistance": 0.0}, []),
    ],
)
def test_what_belongs_beside_an_input_comes_from_where_that_comes(resolve, more, start, sources):
    """Curves and tunnels, which only oppose motion, from the line that gives the slope; unless told otherwise."""
    system = System()
    system.add("line", "Line", build={"line": CURVE}, position=0.0)
    system.add("train", "PointMassTrain", **{"force": 0.0} | start)
    for source, target in (("line.line_resistance", "train.line_resistance"), *more):
        system.connect(source, target, scale=0.5)
    wiring = resolve(system)
    made = [link for link in wiring.links if link.target.variable == "curve_resistance"]
    assert [(str(link.source), link.scale) for link in made] == [(source, 0.5) for source in sources]
    note = (
        "train.curve_resistance takes line.curve_resistance, because train.line_resistance takes line.line_resistance"
    )
    assert (note in wiring.notes) == (bool(sources) and not more)
    assert wiring.problems == []


def test_nothing_comes_beside_an_input_where_its_source_has_no_such_output(resolve):
    """The slope from elsewhere than a line: curves and tunnels stay at their start value."""
    system = System()
    system.add("gust", "Gust")
    system.add("train", "PointMassTrain", force=0.0)
    system.connect("gust.acceleration", "train.line_resistance")
    wiring = resolve(system)
    assert [str(link.target) for link in wiring.links] == ["train.line_resistance"]
    assert not any("curve_resistance" in note for note in wiring.notes)
