"""derivatives.c: directional derivatives and the rates of states."""

import math
from ctypes import c_double, c_size_t, c_uint
from pathlib import Path

import pytest
from railcosim.components import ComfortCruise, PointMassTrain

SAMPLES = Path(__file__).parents[1] / "native_samples.py"
MIXED = f"{SAMPLES}:Mixed"
FUNCTIONS = f"{SAMPLES}:Functions"
OTHERS = Path(__file__).parents[2] / "components" / "samples.py"
COUNTER = f"{OTHERS}:Counter"
OK = 0
ERROR = 3
NULL = None


# ---------------------------------------------------------------- derivatives


def differences(fmu, unknowns, knowns, direction, width=1e-6):
    """The same by central differences of sets and gets."""
    start = [fmu.get(name) for name in knowns]
    sides = []
    for sign in (1.0, -1.0):
        for name, value, d in zip(knowns, start, direction, strict=True):
            assert fmu.set(name, value + sign * width * d) == OK, fmu.said
        sides.append([fmu.get(name) for name in unknowns])
    for name, value in zip(knowns, start, strict=True):
        fmu.set(name, value)
    return [(a - b) / (2.0 * width) for a, b in zip(*sides, strict=True)]


def test_directional_derivatives_of_the_train_are_the_analytic_ones(load):
    """dv' = dF/m - (c1 + 2 c2 v) dv + da; dx' = dv."""
    fmu = load("PointMassTrain").initialize(speed=20.0, position=5.0)
    knowns = ("force", "disturbance", "speed", "position")
    names = ("acceleration", "der(speed)", "der(position)", "applied_force", "speed", "position")
    slope = 0.00077616 + 2 * 0.00016 * 20.0
    found = fmu.directional(names, knowns, (4e5, 0.5, 2.0, 3.0))
    expected = 1.0 + 0.5 - slope * 2.0
    assert found == pytest.approx([expected, expected, 2.0, 4e5, 2.0, 3.0], rel=1e-14)


def test_a_train_that_is_held_answers_to_nothing_and_one_that_sets_off_as_if_it_moved(load):
    """At rest the linearization is that of where it stays: dv' = 0 held, dF/m - c1 dv once the drive is enough."""
    fmu = load("PointMassTrain").initialize()
    knowns, direction = ("force", "disturbance", "line_resistance", "speed"), (4e5, 0.5, 0.25, 2.0)
    assert fmu.directional(("acceleration", "der(speed)"), knowns, direction) == [0.0, 0.0]
    fmu.set("force", 40e3)
    found = fmu.directional(("acceleration", "der(speed)"), knowns, direction)
    assert found == pytest.approx([1.0 + 0.5 - 0.25 - 0.00077616 * 2.0] * 2, rel=1e-14)


def test_directional_derivatives_of_the_controller_are_the_analytic_ones(load):
    """Without neighbours demand = a tanh(alpha (v_r - v) / a), so d demand = (1 - tanh^2) alpha (dv_r - dv)."""
    fmu = load("ComfortCruise").initialize()
    fmu.set("speed", 50.0)
    fmu.set("target_speed", 80.0)
    alpha = ComfortCruise().alpha
    bottom = alpha * 30.0
    found = fmu.directional(("demand", "bottom_demand"), ("target_speed", "speed"), (1.0, -0.5))
    assert found == pytest.approx([(1.0 - math.tanh(bottom) ** 2) * alpha * 1.5, alpha * 1.5], rel=1e-13)


@pytest.mark.parametrize("u", [-1.7, 0.3, 2.4])
def test_directional_derivatives_agree_with_differences_for_every_function(load, u):
    fmu = load(FUNCTIONS).initialize()
    fmu.set("u", u)
    unknowns = [n for n in fmu.references if n.startswith(("scalars", "arrays")) or n == "der(s)"]
    knowns, direction = ("u", "w[1]", "w[2]", "w[3]", "a"), (1.0, 0.5, -0.25, 2.0, 0.1)
    found = fmu.directional(unknowns, knowns, direction)
    assert found == pytest.approx(differences(fmu, unknowns, knowns, direction), rel=1e-6, abs=1e-8)


def test_the_derivative_of_a_square_is_defined_everywhere(load):
    """The rule of powers has a logarithm of the base in it: nothing that may show where the exponent is constant."""
    fmu = load(FUNCTIONS).initialize()
    for u in (-2.0, 0.0):
        fmu.set("u", u)
        assert fmu.directional(("scalars[10]", "scalars[11]"), ("u",), (1.0,)) == [2.0 * u, 3.0 * u * u]


@pytest.mark.long
def test_in_initialization_a_computed_start_moves_with_what_it_follows_from(load):
    """v = u[1]^2 at the start, z = tanh(x[1] + v), der(v) = x[1] - v; afterwards v stands on its own."""
    fmu = load(MIXED).enter()
    fmu.set("u[1]", 0.5)
    unknowns, knowns, direction = ("v", "z", "der(v)", "m[1]", "m[2]"), ("u[1]", "x_start[1]", "u[2]"), (2.0, 0.5, 1.0)
    slope = 1.0 - math.tanh(1.25) ** 2
    expected = [2.0, slope * 2.5, 0.5 - 2.0, 4.0, 2.0]
    found = fmu.directional(unknowns, knowns, direction)
    assert found == pytest.approx(expected, rel=1e-14)
    assert found == pytest.approx(differences(fmu, unknowns, knowns, direction), rel=1e-6)
    assert fmu.get("v") == 0.25
    assert fmu.directional(("z",), ("v",), (1.0,)) == ERROR
    assert fmu.ExitInitializationMode() == OK
    assert fmu.directional(("v", "z"), ("u[1]",), (1.0,)) == [0.0, 0.0]
    assert fmu.directional(("v", "z"), ("v",), (1.0,)) == pytest.approx([1.0, slope], rel=1e-14)


def test_a_start_that_is_computed_moves_until_it_stands_on_its_own(load):
    """x = 1 / u and y = 3 x: dx = -du / u^2 in initialization mode, and 0 afterwards."""
    fmu = load(f"{Path(__file__).parent / 'samples.py'}:Begins").enter()
    assert fmu.directional(("x", "y", "der(x)"), ("u",), (2.0,)) == [-8.0, -24.0, 8.0]
    train = load("PointMassTrain").enter()
    assert train.directional(("speed", "der(position)"), ("speed_start",), (2.0,)) == [2.0, 2.0]
    assert train.ExitInitializationMode() == OK
    assert train.directional(("speed", "der(position)"), ("speed_start",), (2.0,)) == [0.0, 0.0]
    assert fmu.get("x") == 2.0, "and stays as it was computed"
    assert fmu.directional(("y",), ("x",), (1.0,)) == ERROR
    assert fmu.ExitInitializationMode() == OK
    assert fmu.directional(("x", "y"), ("u", "x"), (2.0, 1.0)) == [1.0, 3.0]
    assert fmu.directional(("n",), ("u",), (1.0,)) == ERROR
    assert "neither a real output nor a rate" in fmu.said


def test_directional_derivatives_know_their_unknowns(load):
    fmu = load(COUNTER).initialize()
    assert fmu.directional(("total",), ("total",), (3.0,)) == [3.0]  # memory shown as an output, without any state
    assert fmu.directional(("through", "total"), ("u",), (2.0,)) == [2.0, 0.0]
    assert fmu.directional((), (), ()) == []
    assert fmu.directional(("through",), (), ()) == [0.0]
    assert fmu.directional(("u",), ("u",), (1.0,)) == ERROR
    assert fmu.directional(("count",), ("u",), (1.0,)) == ERROR
    assert fmu.directional(("through",), ("through",), (1.0,)) == ERROR
    assert fmu.GetDirectionalDerivative(NULL, c_size_t(1), NULL, c_size_t(0), NULL, NULL) == ERROR
    assert fmu.GetDirectionalDerivative((c_uint * 1)(), c_size_t(1), NULL, c_size_t(0), NULL, NULL) == ERROR
    for known, direction in ((NULL, (c_double * 1)()), ((c_uint * 1)(), NULL)):
        assert fmu.GetDirectionalDerivative(NULL, c_size_t(0), known, c_size_t(1), direction, NULL) == ERROR
        assert "NULL for an array" in fmu.said


def test_rates_are_those_of_the_equations(load):
    fmu = load("PointMassTrain").initialize(speed=30.0)
    for force in (0.0, 2e5):
        fmu.set("force", force)
        train = PointMassTrain(speed=30.0, force=force)
        assert fmu.get("der(speed)") == train.derivatives()["speed"] == fmu.get("acceleration")
        assert fmu.get("der(position)") == 30.0
