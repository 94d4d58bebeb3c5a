"""Algebraic loops in the compiled loop: the same bits, words and counts as in Python."""

import sys

import numpy as np
import pytest
from railcosim.fmus.build import build
from railcosim.orchestrator.errors import CouplingError, FmuError
from railcosim.orchestrator.master import compiled
from railcosim.orchestrator.run.execution import run
from railcosim.orchestrator.system import Connection, Event, System

pytestmark = [
    pytest.mark.skipif(compiled.kernel is None, reason="installed without the compiled step loop"),
    pytest.mark.skipif(not sys.platform.startswith("linux"), reason="FMUs by hand are compiled for Linux here"),
]
EXPLICIT = pytest.mark.parametrize("algorithm", ["gauss-seidel", "jacobi"])


@pytest.fixture
def told(both, used, monkeypatch):
    """Both ways have the same values, the same errors, and count the same."""

    def go(system, **how):
        result = both(system, **how)
        count = len(used)
        fast = _coupling(system, **how)
        assert len(used) > count
        with monkeypatch.context() as patch:
            patch.setattr(compiled, "kernel", None)
            assert fast == _coupling(system, **how)
        return result

    return go


def _coupling(system, **how):
    try:
        return run(system, **how).coupling
    except (CouplingError, FmuError) as error:
        return str(error), error.run.coupling


@EXPLICIT
@pytest.mark.parametrize("derives", [True, False])
@pytest.mark.parametrize("f", range(6))
def test_bent_ones(told, bent, coupled, *, algorithm, derives, f):
    """With the FMUs' own derivatives and with differences; the equations hold."""
    start = [{"a": 0.5, "b": -0.75, "c": -1.0, "f": f}, {"a": -1.5, "b": 0.5, "c": 0.5, "f": f}]
    result = told(coupled(bent(derives=derives), *start, algorithm=algorithm))
    shape = [lambda x: x, np.tanh, lambda x: x**3, lambda x: np.clip(x, -2.0, 2.0), np.exp, np.cos][f]
    assert result.status == "completed"
    p, q, t = result["p.y"], result["q.y"], result.time
    assert p == pytest.approx(-1.0 + 0.5 * shape(q) - 0.75 * shape(0.25 * p) + t, rel=1e-9, abs=1e-9)
    assert q == pytest.approx(0.5 - 1.5 * shape(p) + 0.5 * shape(0.25 * p) + t, rel=1e-9, abs=1e-9)


WAYS = {
    "refresh": {"refresh": True},
    "a bias": {"events": [Event("p.u", "bias", 0.5, value=0.5, duration=0.5)]},
    "a gain": {"events": [Event("p.u", "connect", 0.5, source=Connection("q.y", "p.u", scale=-2.0), duration=1.0)]},
    "an output": {"events": [Event("p.y", "bias", 0.5, value=0.5, duration=0.5)]},
    "another source": {"events": [Event("p.u", "connect", 0.75, source=Connection("p.z", "p.u"), fade=0.5)]},
    "a parameter": {"events": [Event("p.a", "set", 0.5, value=2.0)]},
}


@EXPLICIT
@pytest.mark.parametrize("way", WAYS)
def test_events_and_refresh(told, bent, coupled, algorithm, way):
    """What is behind the loop follows it; a delay is no part of it."""
    how = dict(WAYS[way])
    events = how.pop("events", [])
    start = [{"a": -0.5, "c": -1.0}, {"a": 1.5, "b": 0.5, "c": 0.5}]
    system = coupled(bent(), *start, algorithm=algorithm, **how)
    for name, b in (("before", 1.0), ("after", 2.0), ("late", 1.0)):
        system.add(name, bent(), a=1.0, b=b)
    system.connections = [c for c in system.connections if c.target != "q.v"]
    system.connect("before.y", "q.v")
    system.connect("p.y", "after.u")
    system.connect("p.y", "late.u", delay=2)
    system.connect("late.y", "before.u", scale=0.01)
    system.events += events
    assert told(system).status == "completed"


def test_inputs_that_go_on(told, bent, coupled, able):
    start = [{"a": -0.5, "c": -1.0}, {"a": 1.5, "b": 0.5, "c": 0.5}]
    system = coupled(bent(), *start, extrapolation=1)
    system.add("lag", able)
    system.connect("p.y", "lag.u")
    system.connect("lag.x", "lag.v", scale=0.5)
    assert told(system).status == "completed"


@pytest.mark.parametrize("shown", ["no promise", "no function"])
def test_a_promise_without_a_function(told, bent, coupled, shown):
    model = bent(*["-DMUTE"] * (shown == "no function"))
    assert told(coupled(model, {"a": 3.0}, {"a": -2.0, "c": 1.0})).status == "completed"


@pytest.mark.parametrize("mode", [102, 103, 104, 109, 203, 204, 303, 304, 400])
@pytest.mark.parametrize("derives", [True, False])
def test_one_that_fails_in_between(both, bent, coupled, mode, derives):
    """An FMU that refuses derivatives is not asked for them; whatever else it refuses ends the run."""
    system = coupled(bent(derives=derives), {"a": 3.0, "mode": mode}, {"a": -2.0, "c": 1.0})
    result = both(system)
    goes_on = mode in (102, 103, 400) or (mode in (104, 109) and not derives)
    assert result.status == ("completed" if goes_on else "failed")
    if not goes_on:
        assert (result.error.instance, result.error.time) == ("p", 1.0 if mode < 200 else result.error.time)


@pytest.mark.parametrize(("f", "a", "c"), [(0, 1.0, 1.0), (4, 1.0, 0.0), (6, 1.0, -5.0)])
def test_no_solution(told, bent, f, a, c):
    """y = y + 1 + t; y = exp y + t; y = root of y, less 5: nothing to be found from 0.25 s on."""
    system = System(start_time=0.0, stop_time=1.0, step=0.25, algebraic_loops="solve")
    system.add("p", bent(), a=0.0, c=5.0, f=f)
    system.connect("p.y", "p.u")
    system.events.append(Event("p.a", "set", 0.25, value=a))
    system.events.append(Event("p.c", "set", 0.25, value=c))
    result = told(system)
    assert isinstance(result.error, CouplingError)


def test_a_solution_that_ceases_to_exist(told, bent):
    """y = exp y + t - 2.1 has none from t = 1.1 s on: the curve of exp y - y has its lowest point at 1."""
    system = System(stop_time=2.0, step=0.25, algebraic_loops="solve")
    system.add("p", bent(), a=1.0, c=-2.1, f=4)
    system.connect("p.y", "p.u")
    result = told(system)
    assert str(result.error).startswith("t = 1.25 s: the algebraic loop through p.y has no solution")
    assert result.time[-1] == 1.0


@EXPLICIT
def test_truth_values_and_whole_numbers(told, mine, bent, algorithm):
    """y = t, or 10 + t while y is above a level; upside down there is no solution at 5 s."""
    system = System(stop_time=8.0, step=1.0, algebraic_loops="solve", algorithm=algorithm)
    system.add("switch", mine("Switch"))
    system.add("level", mine("Level"), level=4.5)
    system.add("clock", mine("Clock"))
    system.connect("clock.t", "switch.w")
    system.connect("switch.y", "level.u")
    system.connect("level.on", "switch.on")
    result = told(system, kind="native")
    assert list(result["switch.y"]) == [t + 10.0 * (t > 4.5) for t in range(9)]
    system.instances["level"].start["upside_down"] = True
    system.stepping.start_time = 5.0
    system.add("bend", mine("Affine"), gain=-1.0)
    system.connections = [c for c in system.connections if c.target != "switch.w"]
    system.connect("clock.t", "bend.u", offset=-12.0)
    system.connect("bend.y", "switch.w")
    result = told(system, kind="native")
    assert isinstance(result.error, CouplingError)


def test_a_number_that_becomes_whole_and_is_none_on_the_way(both, bent):
    """y = 1 - 3 root of y, of which the first one tried below 0 is none, and goes to a whole number as 0."""
    system = System(stop_time=1.0, step=0.25, algebraic_loops="solve")
    system.add("p", bent(derives=False), a=0.0, c=1.0, f=6)
    system.events.append(Event("p.a", "set", 0.25, value=-3.0))
    system.connect("p.y", "p.u")
    system.connect("p.y", "p.m", threshold=0.5)
    result = both(system)
    y, t = result["p.y"][1:], result.time[1:]
    assert y == pytest.approx(1.0 + t - 3.0 * np.sqrt(y), rel=1e-9)
    assert list(result["p.n"][1:]) == list(np.ceil(y - 0.5) + 1.0)


def test_arrays(told, looped_arrays):
    """z = 0.5 z - 3 z + 1 through two elements of one array, asked for as a whole; y by elements of its own."""
    result = told(looped_arrays)
    assert result["it.z"] == pytest.approx(np.full(5, 1.0 / 3.5), rel=1e-9)
    assert result["it.y[2,3]"] == pytest.approx(np.full(5, -0.4), rel=1e-9)


@pytest.mark.parametrize("refresh", [True, False])
def test_steps_that_vary(told, varying, refresh):
    """`adaptive` solves where a step ends."""
    result = told(varying(step=0.5, refresh=refresh), kind="native")
    assert result["a.y"] == pytest.approx(result.time / 4.0, abs=1e-12)


def test_a_state_that_is_not_given_back_after_a_solution(told, varying, able):
    """It ends the run; what was solved in the step that failed of it is counted as in Python."""
    system = varying(able, start=4.0, stop=8.0, step=0.25)
    system.instances["last"].start["mode"] = 122
    error = told(system, kind="native").error
    assert (error.instance, error.status) == ("last", "discard")
    assert "fmi2FreeFMUstate failed" in str(error)


def test_steps_that_vary_and_no_solution(told, unsolvable):
    result = told(unsolvable, kind="native")
    assert isinstance(result.error, CouplingError)


@pytest.mark.parametrize("seed", [1, 2, 3, 4, 5, 7])
def test_drawn_ones_that_jump(told, bent, coupled, seed):
    """What is added to them grows by 5 in each step, so that every start is a poor one; some end without a solution."""
    rng = np.random.default_rng(seed)
    start = [
        {name: float(value) for name, value in zip("abc", rng.normal(size=3) * [2.0, 2.0, 1.0], strict=True)}
        | {"f": int(rng.integers(1, 6))}
        for _ in range(2)
    ]
    told(coupled(bent(derives=seed % 2 == 0), *start, stop=50.0, step=5.0))


@pytest.mark.parametrize("mode", [401, 402, 403, 404])
def test_what_ends_a_solution(told, bent, mode):
    """From 1 s on y = u + 1, or the FMU refuses what is tried to find slopes, or a step."""
    system = System(stop_time=2.0, step=0.25, algebraic_loops="solve")
    system.add("p", bent(derives=False), a=0.9, c=1.0, mode=mode)
    system.connect("p.y", "p.u")
    result = told(system)
    assert isinstance(result.error, CouplingError if mode == 401 else FmuError)
    assert result.time[-1] == 0.75


def test_a_solution_beyond_which_nothing_is_a_number(told, bent):
    """y = t + root of (2 - y) is begun at 1.75 s with what the step leads to, of which the root is none."""
    system = System(stop_time=3.0, step=0.25, algebraic_loops="solve")
    system.add("p", bent(), a=1.0, f=6)
    system.connect("p.y", "p.u", scale=-1.0, offset=2.0)
    result = told(system)
    assert isinstance(result.error, CouplingError)
    assert result.time[-1] == 1.5


def test_a_value_that_is_refused_late(told, bent):
    """Where nothing is left to be tried, it is begun once more with what came last."""
    system = System(stop_time=2.0, step=0.25, algebraic_loops="solve")
    system.add("p", bent(), a=1.0, c=-2.1, f=4, mode=405)
    system.connect("p.y", "p.u")
    assert isinstance(told(system).error, FmuError)


def test_an_older_value_of_the_loop_is_none_of_it(told, bent):
    """y = 3 y - 2 + t and the y of a point ago, which is given and not solved for."""
    system = System(stop_time=1.0, step=0.25, algebraic_loops="solve")
    system.add("p", bent(), a=3.0, b=0.5, c=-2.0)
    system.connect("p.y", "p.u")
    system.connect("p.y", "p.v", delay=1)
    y, t = (result := told(system))["p.y"], result.time
    assert y[1:] == pytest.approx(3.0 * y[1:] - 2.0 + t[1:] + 0.5 * y[:-1], rel=1e-9)


TWO_ROWS = """
class TwoRows(Component):
    u = Input("1", shape=(2,))
    v = Input("1", shape=(2,))
    y = Output("1")

    def outputs(self):
        return {"y": 0.25 * self.u[0] - 2.5 * self.v[1] + self.time}
"""


def test_a_value_that_moves_two_arrays(told, components):
    system = System(stop_time=1.0, step=0.25, algebraic_loops="solve")
    system.add("it", str(build(components(TWO_ROWS)("TwoRows"), kind="native", fmi="3")))
    for name in ("u[1]", "u[2]", "v[1]", "v[2]"):
        system.connect("it.y", f"it.{name}")
    result = told(system)
    assert result["it.y"] == pytest.approx(result.time / 3.25, rel=1e-9)


def test_what_is_no_number_in_a_circle_of_feed_through_ends_it_at_once(both, bent):
    """z = root of (1 - t) at last, which goes round."""
    system = System(stop_time=3.0, step=0.25, algorithm="jacobi", refresh=True)
    for name, start in (("p", {"a": 1.0, "f": 6}), ("q", {"a": 0.5}), ("clock", {})):
        system.add(name, bent(), **start)
    system.connect("p.y", "q.u")
    system.connect("q.y", "p.v")
    system.connect("clock.y", "p.u", scale=-1.0, offset=1.0)
    assert "output 'y' is nan" in str(both(system).error)
