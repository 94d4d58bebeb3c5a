"""Events under the master algorithms that repeat, adapt, extrapolate or solve, and in processes of their own."""

import math

import numpy as np
import pytest
from railcosim.orchestrator.run.execution import run
from railcosim.orchestrator.system import Event, System


@pytest.fixture
def spring(mine):
    """Two lags that follow each other, x1(0) = 1 and x2(0) = 0: x1 + x2 = 1, x1 - x2 = exp(-2 t)."""

    def make(*events, **how):
        system = System(**{"stop_time": 2.0, "step": 0.1} | how, events=list(events))
        system.add("a", mine("Lag"), x=1.0)
        system.add("b", mine("Lag"), x=0.0)
        system.connect("a.x", "b.u")
        system.connect("b.x", "a.u")
        return system

    return make


def go(system, kind="plain"):
    return run(system, kind=kind)


# -------------------------------------------------------------------- iterative


def test_iterative_iterates_with_what_the_event_makes_of_the_values(spring):
    """While a.x is overridden by 3, b relaxes to it: by the mean of both ends of each step, exp(-h) to second order."""
    result = go(spring(Event("a.x", "override", 1.0, 3.0, duration=0.5), algorithm="iterative", step=0.01, record=0.1))
    time = result.time
    during = (time > 0.999) & (time < 1.499)
    assert set(result["a.x"][during]) == {3.0}
    b = result["b.x"]
    k = np.flatnonzero(during)
    assert b[k] == pytest.approx(3.0 + (b[k[0]] - 3.0) * np.exp(-(time[k] - time[k[0]])), rel=1e-6)
    undisturbed = go(spring(algorithm="iterative", step=0.01, record=0.1))
    assert np.array_equal(b[time < 1.0], undisturbed["b.x"][time < 1.0])
    # a itself went on unseen, driven by b: it is shown again as soon as the event is over
    assert 0.5 < result["a.x"][np.searchsorted(time, 1.4999)] < b[k[-1]]


def test_iterative_and_an_input_of_one_of_a_cycle(spring):
    """a hears 5 instead of b; b hears a, and the record of b is b."""
    result = go(spring(Event("a.u", "override", 0.0, 5.0), algorithm="iterative"))
    assert result["a.x"] == pytest.approx(5.0 - 4.0 * np.exp(-result.time), rel=1e-6)
    assert result["b.x"][-1] < result["a.x"][-1]


def test_iterative_and_a_sampled_receiver(mine):
    """What it reads at the point at which the event begins is changed already."""
    system = System(stop_time=5.0, step=1.0, algorithm="iterative")
    system.events = [Event("ramp.x", "bias", 2.0, 100.0, duration=2.0)]
    system.add("ramp", mine("Ramp"))
    system.add("keep", mine("Keep"))
    system.connect("ramp.x", "keep.u")
    result = go(system)
    assert list(result["ramp.x"]) == pytest.approx([0, 1, 102, 103, 4, 5])
    assert list(result["keep.seen"]) == pytest.approx([-1, 0, 1, 102, 103, 4])


# -------------------------------------------------------------------- adaptive


def test_adaptive_lands_on_what_happens(spring):
    """At both ends of an event that stand on no multiple of anything, and at each repetition."""
    event = Event("a.x", "bias", 0.123456789, 1.0, duration=math.pi / 100, every=0.7)
    result = go(spring(event, algorithm="adaptive", step=0.3))
    ends = [0.123456789 + 0.7 * k + d for k in (0, 1, 2) for d in (0.0, math.pi / 100)]
    assert set(ends) <= set(result.time), "without a record of its own each step gives a row"
    assert [what["time"] for what in result.coupling["events"]] == ends
    assert np.diff(result.time).min() > 1e-4


def test_adaptive_rows_stay_where_they_are(spring):
    """Rows at multiples of the record only, an event at one of them and others between."""
    events = [Event("a.x", "bias", t, 1.0, duration=0.1) for t in (0.3, 0.7, 1.17)]
    result = go(spring(*events, algorithm="adaptive", record=0.1))
    assert result.time == pytest.approx(np.arange(21) * 0.1, abs=1e-12)
    assert result.coupling["adaptive"]["shortest_step"] > 1e-4, "0.3 and 3 x 0.1 are one point"
    plain = go(spring(algorithm="adaptive", record=0.1))
    shown = result["a.x"] - plain["a.x"]
    assert list(np.flatnonzero(shown > 0.9)) == [3, 7, 12]


def test_adaptive_is_right_after_a_jump(mine):
    """x' = u - x with u = 0, then 2: 2 (1 - exp(-(t - 1))), within the tolerance."""
    system = System(stop_time=3.0, step=0.5, algorithm="adaptive", tolerance=1e-6)
    system.events = [Event("ramp.x", "override", 0.0, 0.0, duration=1.0), Event("ramp.x", "override", 1.0, 2.0)]
    system.add("ramp", mine("Ramp"))
    system.add("lag", mine("Lag"), x=0.0)
    system.connect("ramp.x", "lag.u")
    result = go(system)
    assert set(result["ramp.x"]) == {0.0, 2.0}
    assert result["lag.x"] == pytest.approx(2.0 - 2.0 * np.exp(-np.maximum(result.time - 1.0, 0.0)), abs=1e-5)


def test_adaptive_and_a_value_set(spring):
    result = go(spring(Event("b.rate", "set", 0.777, 0.0), algorithm="adaptive", tolerance=1e-6))
    after = result.time >= 0.777
    assert len(set(result["b.x"][after])) == 1
    assert result["b.x"][-1] == pytest.approx(0.5 * (1.0 - math.exp(-2.0 * 0.777)), rel=1e-3)


# -------------------------------------------------------------------- extrapolation, loops


@pytest.mark.parametrize("algorithm", ["gauss-seidel", "jacobi"])
@pytest.mark.parametrize("order", [1, 2])
def test_no_polynomial_goes_through_a_jump(mine, algorithm, order):
    """The native lag continues its input; where that jumps it begins anew, so that x stays between old and new."""
    system = System(stop_time=3.0, step=0.1, algorithm=algorithm, extrapolation=order)
    system.events = [
        Event("lag.u", "override", 0.0, 0.0, duration=1.0),
        Event("lag.u", "override", 1.0, 1.0, duration=1.0),
        Event("lag.u", "override", 2.0, 0.0),
    ]
    system.add("ramp", mine("Ramp"))
    system.add("lag", mine("Lag"), rate=2.0, x=0.0)
    system.connect("ramp.x", "lag.u")
    checked = run(system, kind="native")
    x, time = checked["lag.x"], checked.time
    assert checked.checked.models["lag"].interface.interpolates_inputs
    exact = np.where(
        time < 2.0, -np.expm1(-2.0 * np.maximum(time - 1.0, 0.0)), -np.expm1(-2.0) * np.exp(-2.0 * (time - 2.0))
    )
    assert x == pytest.approx(exact, abs=1e-3)


@pytest.mark.parametrize("algorithm", ["gauss-seidel", "jacobi", "adaptive"])
def test_a_loop_is_solved_with_what_the_event_makes_of_it(mine, algorithm):
    """p = q / 2 + 1 and q = p / 2 + 1 give 2; with p + 3 instead of p, p = q / 2 + 1 and q = (p + 3) / 2 + 1: 3, 4."""
    system = System(stop_time=4.0, step=1.0, algorithm=algorithm, algebraic_loops="solve", record=1.0)
    system.events = [
        Event("q.u", "bias", 2.0, 3.0, duration=1.0),
        Event("p.y", "override", 3.0, 10.0),
    ]
    system.add("p", mine("Pass"), gain=0.5, bias=1.0)
    system.add("q", mine("Pass"), gain=0.5, bias=1.0)
    system.connect("p.y", "q.u")
    system.connect("q.y", "p.u")
    result = go(system)
    assert result["q.y"] == pytest.approx([2, 2, 4, 6, 6], abs=1e-8)
    assert result["p.y"] == pytest.approx([2, 2, 3, 10, 10], abs=1e-8)


# -------------------------------------------------------------------- other processes


def test_an_isolated_instance_is_no_exception(mine):
    system = System(stop_time=5.0, step=1.0)
    system.events = [
        Event("half.bias", "set", 1.0, 2.0),
        Event("half.u", "freeze", 2.0, duration=2.0),
        Event("half.y", "bias", 3.0, 100.0, duration=1.0),
        Event("ramp.x", "override", 4.0, -7.0),
    ]
    system.add("ramp", mine("Ramp"))
    system.add("half", mine("Pass"), gain=0.5, bias=1.0)
    system.connect("ramp.x", "half.u")
    here = run(system, kind="python")
    for instance in system.instances.values():
        instance.isolate = True
    apart = run(system, kind="python")
    for name in here.names():
        assert np.array_equal(here[name], apart[name])
    assert list(here["half.y"]) == pytest.approx([1, 1, 2.5, 103, 3, -1.5])
