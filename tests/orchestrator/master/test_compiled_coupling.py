"""Compiled: inputs that go on, feed-through that is refreshed, steps that are repeated. The same bits as in Python."""

import sys

import numpy as np
import pytest
from railcosim.orchestrator.errors import CouplingError
from railcosim.orchestrator.master import compiled
from railcosim.orchestrator.run.execution import execute
from railcosim.orchestrator.system import System

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


@pytest.mark.parametrize("acceleration", ["none", "aitken", "anderson"])
def test_several_unknowns(both, able, acceleration):
    """x of each after a step is x + 0.25 (u - x), with u of the others: a linear system for every step."""
    links = [("a.x", "b.u", 1.1), ("b.x", "c.u", -0.7), ("c.x", "d.u", 1.3), ("d.x", "a.u", -0.9), ("c.x", "b.v", 1.0)]
    system = system_of(able, links, algorithm="iterative", acceleration=acceleration, tolerance=1e-12)
    result = both(system)
    matrix = np.zeros((4, 4))
    for source, target, scale in links[:4]:
        matrix["abcd".index(target[0]), "abcd".index(source[0])] = scale
    x = np.array([result[f"{name}.x"][0] for name in "abcd"])
    for k in range(1, len(result.time)):
        x = np.linalg.solve(np.eye(4) - 0.25 * matrix, 0.75 * x + 0.25)
        assert [result[f"{name}.x"][k] for name in "abcd"] == pytest.approx(x, rel=1e-10)


@pytest.mark.parametrize("how", [{"acceleration": "none"}, {}, {"max_iterations": 1}])
def test_what_leads_nowhere(both, able, how):
    """Values that outgrow all tolerance, and too few iterations: the same words from both."""
    tolerance = 1e-300 if not how else 1e-9
    links = [("a.x", "b.u", 1e9), ("b.x", "a.u", 1e9)]
    how = {"algorithm": "iterative", "tolerance": tolerance, **how}
    result = both(system_of(able, links, **how))
    assert isinstance(result.error, CouplingError)
    assert len(result.time) == 1


@pytest.mark.parametrize("status", [2, 3, 4, 9])
@pytest.mark.parametrize("first", [100, 110, 120])
def test_a_state_that_is_refused(both, able, first, status):
    """Saved, come back to, given back."""
    system = system_of(able, [("a.x", "b.u", 0.5), ("b.x", "a.u", 0.5)], 8.0, algorithm="iterative")
    system.instances["b"].start["mode"] = first + status
    result = both(system)
    assert (result.error.instance, result.time[-1]) == ("b", 4.75 if first == 120 else 5.0)
