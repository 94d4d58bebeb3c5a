"""The plan: everything a master does, as it does it; and what a page cannot do is refused in one message."""

import pytest
from railcosim.orchestrator import System
from railcosim.orchestrator.fmi import Workspace
from railcosim.orchestrator.report.live.plan import plan_of, refusals, told
from railcosim.orchestrator.run import assembled, check
from railcosim.orchestrator.system import Event


def planned(system):
    with Workspace() as workspace:
        checked = check(system, workspace, "native")
        assert refusals(system, checked) == []
        with assembled(checked) as master:
            return plan_of(checked, master)


def refused(system, kind="plain"):
    with Workspace() as workspace:
        return [str(problem) for problem in refusals(system, check(system, workspace, kind))]


@pytest.fixture
def driven(mine):
    """A wave, a lag behind it and a switch; connections of every kind."""

    def make(**how):
        system = System(**{"stop_time": 1.0, "step": 0.1} | how)
        system.add("wave", mine("Wave"))
        system.add("lag", mine("Lag"), x=0.25, gain=2.0)
        system.add("whole", mine("Whole"))
        system.add("switch", mine("Switch"), on=True)
        system.connect("wave.y", "lag.u", scale=2.0, offset=0.5)
        system.connect("lag.x", "switch.w", delay=2)
        system.connect("lag.x", "whole.n", threshold=0.5)
        return system

    return make


def test_a_plan(driven):
    plan = planned(driven(record=0.2))
    assert (plan["start"], plan["stop"], plan["step"], plan["steps"], plan["every"]) == (0.0, 1.0, 0.1, 10, 2)
    assert plan["depth"] == 3
    assert [each["name"] for each in plan["instances"]] == ["wave", "lag", "whole", "switch"]
    lag, whole, switch = plan["instances"][1:]
    signals = plan["signals"]
    (feed,) = lag["feeds"]
    assert [signals[k] for k in feed["sources"]] == ["wave.y"]
    assert (feed["scales"], feed["offsets"], feed["plain"], feed["kind"]) == ((2.0,), (0.5,), False, "Real")
    assert (whole["feeds"][0]["kind"], whole["feeds"][0]["thresholds"]) == ("Integer", (0.5,))
    assert switch["feeds"][0]["ages"] == (2,)
    assert [signals[part["begin"]] for part in lag["yields"]] == ["lag.x"]
    assert {start["kind"]: start["values"] for start in switch["starts"]} == {"Boolean": [1.0]}
    assert sorted(lag["starts"][0]["values"]) == [0.25, 2.0]


def test_operations_are_those_of_the_algorithm(driven):
    one_by_one, at_once = (planned(driven(algorithm=name)) for name in ("gauss-seidel", "jacobi"))
    assert [operation for operation, _, _ in one_by_one["operations"]] == [0, 1, 2] * 4
    assert one_by_one["operations"][::3] == [[0, k, 1] for k in one_by_one["sweep"]]
    assert [operation for operation, _, _ in at_once["operations"]] == [0] * 4 + [1] * 4 + [2] * 4


def test_steps_of_their_own(driven):
    system = driven()
    system.instances["lag"].step = 0.5
    plan = planned(system)
    assert [rate for _, k, rate in plan["operations"] if k == 1] == [5, 5, 5]
    assert plan["every"] == 1


def test_numbers_that_json_lacks():
    assert told([1, True, float("inf"), -float("inf")]) == [1.0, 1.0, "Infinity", "-Infinity"]
    assert told([float("nan")]) == ["NaN"]


@pytest.mark.parametrize(
    ("how", "said"),
    [
        (
            {"algorithm": "iterative"},
            "algorithm = iterative cannot be done by a live page; it does gauss-seidel, jacobi",
        ),
        ({"refresh": True}, "refresh cannot be done"),
        (
            {"events": [Event("lag.rate", "set", 0.5, 2.0)]},
            "[[events]] cannot be done by a live page; it has no events",
        ),
    ],
)
def test_what_a_page_cannot_do_is_refused(driven, how, said):
    (problem,) = refused(driven(**how))
    assert said in problem


def test_maps_are_refused(driven):
    system = driven()
    system.connections[-1].threshold = None
    system.connections[-1].source = "count.m"
    system.connections[-1].map = {"1": 2}
    system.add("count", system.instances["whole"].model)
    (problem,) = refused(system)
    assert problem.endswith("it maps values, which a live page does not")


def test_loops_are_refused(mine):
    system = System(stop_time=1.0, step=0.1)
    for name in ("a", "b"):
        system.add(name, mine("Pass"), gain=0.5)
    system.connect("a.y", "b.u")
    system.connect("b.y", "a.u")
    (problem,) = refused(system)
    assert "algebraic loop" in problem


def test_texts_and_other_versions_are_refused(hostile, by_hand):
    system = System(stop_time=1.0, step=0.1)
    system.add("it", hostile(), deed="none")
    system.add("other", hostile())
    system.add("third", str(by_hand(3)))
    system.connect("it.said", "other.word")
    said = " / ".join(refused(system, "auto"))
    assert "it.said: it is a text, which a live page does not read" in said
    assert "it.deed: it is set to a text, which a live page does not do" in said
    assert "it hands a text on, which a live page does not" in said
    assert "is FMI 3.0, and a live page steps FMI 2.0 alone" in said
