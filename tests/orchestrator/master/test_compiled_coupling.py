"""Compiled: inputs that go on, feed-through that is refreshed, steps that are repeated. The same bits as in Python."""

import re
import sys

import numpy as np
import pytest
from railcosim.orchestrator.errors import CouplingError
from railcosim.orchestrator.master import compiled
from railcosim.orchestrator.master.plans.ability import can_be_restored
from railcosim.orchestrator.run.execution import execute
from railcosim.orchestrator.system import Connection, Event, System

pytestmark = [
    pytest.mark.skipif(compiled.kernel is None, reason="installed without the compiled step loop"),
    pytest.mark.skipif(not sys.platform.startswith("linux"), reason="FMUs by hand are compiled for Linux here"),
]


def system_of(model, links, stop=2.0, offset=1.0, **how):
    """Instances a, b and so on, connected by (source, target, scale) with an offset."""
    system = System(stop_time=stop, step=0.25, **how)
    for name in sorted({end[0] for link in links for end in link[:2]}):
        system.add(name, model, v=0.5, u=1.0)
    for source, target, scale in links:
        system.connect(source, target, scale=scale, offset=offset)
    return system


@pytest.mark.parametrize("mode", [91, 92])
@pytest.mark.parametrize("order", [1, 2])
def test_derivatives_that_are_refused(both, able, mode, order):
    """From 5 s on b takes none, or the first alone: the order that is left is used and told."""
    system = system_of(able, [("a.x", "b.u", 2.0), ("b.x", "a.u", -1.0)], 8.0, extrapolation=order)
    system.instances["b"].start["mode"] = mode
    result = both(system)
    refused = {91: {2: {"b": 1}}, 92: {1: {"b": 0}, 2: {"b": 0}}}[mode].get(order)
    told = execute(system).coupling.get("extrapolation", {})
    assert (result.status, told.get("orders")) == ("completed", refused)


def test_a_value_that_is_not_finite_once_it_is_refreshed(both, able):
    """What a gives to b overflows there, and y shows it at once."""
    system = system_of(able, [("a.x", "b.v", 0.6e308)], refresh=True)
    system.instances["a"].start["u"] = 5.0
    result = both(system)
    assert str(result.error) == "b, t = 1 s: output 'y' is inf"


def test_a_circle_that_does_not_settle_is_left_as_it_was(both, able):
    """y of both is x + v, and v the other's y: what the step gave stands, which is one step late."""
    system = system_of(able, [("a.y", "b.v", 0.5), ("b.y", "a.v", 0.5)], algorithm="jacobi", refresh=True)
    result = both(system)
    assert result.status == "completed"
    solved = result["a.x"] + 0.5 * result["b.y"] + 1.0
    assert abs(result["a.y"] - solved)[1:].min() > 1e-3


def test_one_that_refuses_to_be_refreshed(both, species):
    """In the first step, and is left alone from then on; it has to be read before it is set, in a step."""
    system = System(stop_time=2.0, step=0.25, refresh=True)
    for name in ("shy", "plain"):
        system.add(name, species(["u"], *["-DSHY"] * (name == "shy")), b=-0.1, c=0.3, d=0.5, start=1.0)
    system.connect("plain.y", "shy.u")
    system.connect("shy.y", "plain.u", delay=1)
    assert both(system).status == "completed"
    assert set(execute(system).coupling["refresh"]["refused"]) == {"shy"}


def test_one_that_fails_when_it_is_refreshed(both, able):
    """It has been refreshed before, so that this is no refusal."""
    system = system_of(able, [("a.x", "b.v", 0.5)], 8.0, refresh=True)
    system.instances["b"].start["mode"] = 33
    result = both(system)
    assert (result.error.instance, result.error.time, result.time[-1]) == ("b", 5.0, 4.75)


@pytest.mark.parametrize("acceleration", ["none", "aitken", "anderson"])
def test_several_unknowns(both, able, acceleration):
    """x of each after a step is x + 0.25 (u - x), with u of the one after it: a linear system for every step."""
    names, scales = "abcdefgh", [1.1, -0.7, 1.3, -0.9, 1.2, 0.8, -1.4, 1.5]
    links = [(f"{names[(k + 1) % 8]}.x", f"{name}.u", scales[k]) for k, name in enumerate(names)]
    system = system_of(able, links, 0.5, algorithm="iterative", acceleration=acceleration, tolerance=1e-12)
    result = both(system)
    matrix = np.roll(np.diag(scales), 1, axis=1)
    x = np.array([result[f"{name}.x"][0] for name in names])
    for k in range(1, len(result.time)):
        x = np.linalg.solve(np.eye(8) - 0.25 * matrix, 0.75 * x + 0.25)
        assert [result[f"{name}.x"][k] for name in names] == pytest.approx(x, rel=1e-10)


@pytest.mark.parametrize(
    ("gain", "how"),
    [
        (1e9, {"acceleration": "none"}),
        (1e9, {"max_iterations": 1}),
        (1e9, {"tolerance": 1e-300}),
        (1e12, {"tolerance": 1e-310}),
    ],
)
def test_what_leads_nowhere(both, able, gain, how):
    """Values that outgrow all tolerance, and too few iterations: the same words from both."""
    links = [("a.x", "b.u", gain), ("b.x", "a.u", gain)]
    result = both(system_of(able, links, **({"algorithm": "iterative", "tolerance": 1e-9} | how)))
    assert isinstance(result.error, CouplingError)
    assert len(result.time) == 1


def test_an_fmu_that_fails_with_a_later_guess(both, able):
    """What was guessed first leads to a value that with the gain is beyond all numbers."""
    links = [("a.x", "b.u", 1e200), ("b.x", "a.u", 1e200)]
    result = both(system_of(able, links, algorithm="iterative", acceleration="none"))
    assert re.search(r"with the next guess an FMU fails \([ab], t = 0.25 s: output 'x' is inf\)", str(result.error))


def test_an_fmu_that_fails_of_what_it_begins_with_is_to_blame(both, able):
    system = system_of(able, [("a.x", "b.u", 0.5), ("b.x", "a.u", 0.5)], 6.0, algorithm="iterative")
    system.instances["b"].start["mode"] = 3
    error = both(system).error
    assert (error.instance, error.time, error.status) == ("b", 5.0, "error")


def test_sampled_ones_step_first(both, mine):
    """They act on what the step begins with."""
    system = System(stop_time=2.0, step=0.25, algorithm="iterative")
    system.add("course", mine("Course"), b=1.0)
    system.add("sampled", mine("Keep"))
    system.add("lag", mine("Lag"))
    system.connect("course.y", "sampled.u")
    system.connect("sampled.seen", "lag.u")
    result = both(system, kind="python")
    assert result.status == "completed"


def test_what_is_no_fmu_is_not_restored():
    assert not can_be_restored(object())


@pytest.mark.parametrize("status", [2, 3, 4, 9])
@pytest.mark.parametrize("first", [100, 110, 120])
def test_a_state_that_is_refused(both, able, first, status):
    """Saved, come back to, given back."""
    system = system_of(able, [("a.x", "b.u", 0.5), ("b.x", "a.u", 0.5)], 8.0, algorithm="iterative")
    system.instances["b"].start["mode"] = first + status
    result = both(system)
    assert (result.error.instance, result.time[-1]) == ("b", 4.75 if first == 120 else 5.0)


WAYS = {
    "extrapolation": {"extrapolation": 2},
    "refresh": {"refresh": True},
    "both": {"extrapolation": 1, "refresh": True},
    "iterative": {"algorithm": "iterative", "tolerance": 1e-6},
    "iterative, extrapolation": {"algorithm": "iterative", "tolerance": 1e-6, "extrapolation": 1},
    "adaptive": {"algorithm": "adaptive", "tolerance": 0.05},
    "adaptive, extrapolation": {"algorithm": "adaptive", "tolerance": 0.05, "extrapolation": 1},
}


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("fade", [None, 0.75])
def test_inputs_that_are_connected_anew(both, able, way, fade):
    """For a while, again and again and for ever, beside a bias; b follows c and then a again, and c from 2.1 s on b."""
    links = [("a.x", "b.u", 2.0), ("b.x", "a.u", -1.0), ("a.x", "c.u", 0.5), ("b.x", "a.v", 0.25)]
    system = system_of(able, links, 4.0, **WAYS[way])
    there = {"b.u": ("c.x", 0.5, {"duration": 0.5, "every": 1.5}), "c.u": ("b.y", 2.1, {})}
    there["a.v"] = ("c.x", 1.0, {"duration": 1.0})
    for signal, (source, at, how) in there.items():
        connection = Connection(source, signal, scale=0.75)
        system.events.append(Event(signal, "connect", at, source=connection, fade=fade, **how))
    system.events.append(Event("b.u", "bias", 1.25, value=0.5, duration=1.0))
    result = both(system)
    assert result.status == "completed"
    plain = both(system_of(able, links, 4.0, **WAYS[way]))
    assert result["c.x"][-1] != plain["c.x"][-1]
