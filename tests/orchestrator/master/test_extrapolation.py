"""Inputs that go on during a step: polynomials, the times that values belong to, and what is held all the same."""

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from railcosim.orchestrator.fmi.binding.fmi2 import FmuSlave
from railcosim.orchestrator.master import compiled
from railcosim.orchestrator.master.extrapolation import polynomial
from railcosim.orchestrator.run.execution import execute, resume, run
from railcosim.orchestrator.system import Event, System

ALGORITHMS = pytest.mark.parametrize("algorithm", ["gauss-seidel", "jacobi", "iterative", "adaptive"])


# -------------------------------------------------------------------- polynomials


@settings(max_examples=200, deadline=None)
@given(
    st.lists(st.floats(-10.0, 10.0), min_size=3, max_size=3),
    st.lists(st.integers(-20, 20), min_size=1, max_size=3, unique=True),
    st.floats(-5.0, 5.0),
    st.integers(1, 2),
)
def test_a_polynomial_is_exact_for_as_many_points_as_there_are(coefficients, times, at, order):
    """Value and derivatives of a polynomial of the degree that the points determine, wherever it is asked for."""
    course = np.polynomial.Polynomial(coefficients[: len(times)])
    found = polynomial([(0.5 * t, float(course(0.5 * t))) for t in times], at, order)
    expected = [course(at), *(course.deriv(k)(at) for k in range(1, order + 1))]
    assert found == pytest.approx(expected, abs=1e-6)
    assert len(found) == order + 1


# -------------------------------------------------------------------- what it does to a run


def driven(mine, algorithm, order, course, **how):
    """The integral of a course, straight and through a block that passes it on at once."""
    it = System(**{"stop_time": 4.0, "step": 0.5, "algorithm": algorithm, "extrapolation": order} | how)
    it.add("course", mine("Course"), **course)
    it.add("straight", mine("Integral"))
    it.add("block", mine("Pass"))
    it.add("through", mine("Integral"))
    for source, target in (("course.y", "straight.u"), ("course.y", "block.u"), ("block.y", "through.u")):
        it.connect(source, target)
    return it


@ALGORITHMS
@pytest.mark.parametrize("name", ["straight", "through"])
def test_a_line_is_integrated_exactly(mine, algorithm, name):
    """From the second step on, where the first can only hold its inputs: that costs b h^2 / 2 once (jacobi, through a
    block, which is a step late: the slope is known one step later).
    """
    result = run(driven(mine, algorithm, 1, {"b": 2.0}, tolerance=1e-9), kind="native")
    exact = result.time + result.time**2
    lost = exact - result[f"{name}.x"]
    assert np.ptp(lost[3:]) < 1e-12 or algorithm == "adaptive"
    if algorithm == "iterative":
        assert np.abs(lost).max() < 1e-12
    elif algorithm == "adaptive":  # it holds the first step as short as the tolerance asks
        assert np.abs(lost).max() < 1e-6
    else:
        held = run(driven(mine, algorithm, 0, {"b": 2.0}), kind="native")
        assert 0.0 < lost[-1] < 0.25 * (exact - held[f"{name}.x"])[-1]


@pytest.mark.parametrize("algorithm", ["gauss-seidel", "jacobi"])
def test_a_parabola_is_integrated_exactly_after_the_start(mine, algorithm):
    result = run(driven(mine, algorithm, 2, {"b": -1.0, "c": 3.0}), kind="native")
    exact = result.time - result.time**2 / 2.0 + result.time**3
    assert np.ptp((exact - result["straight.x"])[2:]) < 1e-12
    one = run(driven(mine, algorithm, 1, {"b": -1.0, "c": 3.0}), kind="native")
    assert np.ptp((exact - one["straight.x"])[2:]) > 1.0


def given_derivatives(monkeypatch):
    """Names of the inputs, by instance, that are given derivatives."""
    seen = {}
    plain = FmuSlave.interpolate

    def interpolate(slave, names, orders, values):
        seen.setdefault(slave.name, set()).update(names)
        plain(slave, names, orders, values)

    monkeypatch.setattr(FmuSlave, "interpolate", interpolate)
    return seen


def test_what_is_held_all_the_same(mine, monkeypatch):
    """What is delayed, sampled or no real number, on either end; and nothing is said to FMUs that cannot hear it."""
    monkeypatch.setattr(compiled, "kernel", None)  # which calls the FMU itself
    seen = given_derivatives(monkeypatch)
    it = System(stop_time=2.0, step=0.5, extrapolation=1)
    it.add("course", mine("Course"), b=1.0)
    for name in ("moves", "late", "behind"):
        it.add(name, mine("Integral"))
    it.add("sampled", mine("Keep"))
    it.add("whole", mine("Whole"))
    it.add("more", mine("Whole"))
    it.connect("course.y", "moves.u")
    it.connect("course.y", "late.u", delay=1)
    it.connect("course.y", "sampled.u")
    it.connect("sampled.seen", "behind.u")
    it.connect("whole.m", "more.n")
    run(it, kind="native")
    assert seen == {"moves": {"u"}}


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("takes", [0, 1, 2])
def test_derivatives_that_an_fmu_refuses_are_of_a_lower_order(species, mine, tmp_path, order, takes):
    """It says that it interpolates inputs, and takes them to some order only; the rest is held."""

    def made(order, **of):
        it = System(stop_time=2.0, step=0.5, algorithm="jacobi", extrapolation=order)
        it.add("course", mine("Course"), a=0.0, b=2.0)
        it.add("sum", species([], f"-DORDER={takes}", able="canInterpolateInputs"), c=1.0)
        it.connect("course.y", "sum.u")
        return run(it, **of)

    result, held = made(order, output=tmp_path / "out"), made(0)
    told = json.loads((tmp_path / "out" / "run.json").read_text())["coupling"]
    reached = min(order, takes)
    if reached == order:
        assert told == {}
    else:
        assert told["extrapolation"]["orders"] == {"sum": reached}
        assert "sum" in told["extrapolation"]["summary"]
        assert "fmi2SetRealInputDerivatives failed" in told["extrapolation"]["said"]["sum"]
    if reached == 0:
        assert np.array_equal(result["sum.y"], held["sum.y"])
    else:  # but for the first step, of which no slope is known
        assert np.diff(result["sum.y"])[1:] == pytest.approx(np.diff(result.time**2)[1:], abs=1e-9)


def test_python_fmus_hold_their_inputs_and_it_is_said(mine):
    held = run(driven(mine, "jacobi", 0, {"b": 2.0}), kind="plain")
    asked = run(driven(mine, "jacobi", 1, {"b": 2.0}), kind="plain")
    assert np.array_equal(held["straight.x"], asked["straight.x"])
    told = "inputs of straight, block, through are held over a step: canInterpolateInputs is false"
    assert told in asked.checked.notes
    assert told not in held.checked.notes


def test_scale_and_offset_go_for_slopes_too(mine):
    it = driven(mine, "gauss-seidel", 1, {"b": 2.0})
    it.connections[0].scale, it.connections[0].offset = -3.0, 5.0
    result = run(it, kind="native")
    lost = 5.0 * result.time - 3.0 * (result.time + result.time**2) - result["straight.x"]
    assert np.ptp(lost[2:]) < 1e-12


def test_after_a_jump_the_polynomial_begins_anew(mine):
    """Through the jump it would overshoot: by half of it times the step, as the slope says."""
    it = driven(mine, "gauss-seidel", 1, {"b": 0.0})
    it.events = [Event("course.y", "bias", at=2.0, value=10.0)]
    result = run(it, kind="native")
    assert result["straight.x"] == pytest.approx(result.time + 10.0 * np.maximum(0.0, result.time - 2.0), abs=1e-12)


@ALGORITHMS
def test_a_run_that_is_resumed_remembers_its_points(mine, tmp_path, algorithm):
    """To the bit."""
    course = {"b": -1.0, "c": 3.0}
    whole = run(driven(mine, algorithm, 2, course, record=0.5), kind="native")
    part = driven(mine, algorithm, 2, course, record=0.5, stop_time=2.0)
    execute(part, kind="native", output=tmp_path, checkpoint_every=1.0)
    again = resume(tmp_path, stop_time=4.0)
    assert np.array_equal(whole.time, again.time)
    for name in ("straight.x", "through.x"):
        assert np.array_equal(whole[name], again[name]), name
