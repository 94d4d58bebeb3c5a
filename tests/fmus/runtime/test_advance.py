"""advance.c: the sample clock, which gives the same bits as plain Python and as any other steps."""

import itertools
import math
from pathlib import Path

import pytest
from railcosim.components.simulate import Simulation
from railcosim.fmus.references import resolve

SAMPLES = Path(__file__).parents[1] / "native_samples.py"
MIXED = f"{SAMPLES}:Mixed"
COUNTER = f"{Path(__file__).parents[2] / 'components' / 'samples.py'}:Counter"
OK, ERROR = 0, 3
PERIOD = 0.25
GIVEN = {"u[1]": 0.5, "u[2]": -0.25, "hold": 0.1, "max_step": 0.07}
GRID = [k * PERIOD for k in range(7)]


def shown(fmu):
    return {name: fmu.get(name) for name in ("x[1]", "x[2]", "v", "m[1]", "n", "odd", "y[1]", "z", "tossed", "total")}


def rows(fmu, points):
    found = {}
    for begin, end in itertools.pairwise(points):
        assert fmu.step(end - begin, at=begin) == OK, fmu.said
        found[end] = shown(fmu)
    return found


def parts(count):
    return [k * PERIOD / count for k in range(6 * count + 1)]


@pytest.mark.parametrize(
    "points",
    [
        parts(2),
        parts(3),
        GRID[::2],
        GRID[::3],
        sorted([*GRID, 0.01, 0.3, 0.34, 0.6, 0.61, 1.37]),
        sorted([*GRID, *(at - 1e-11 for at in GRID[1:])]),
        [0.0, *(at + 1e-11 for at in GRID[1:])],
        [0.0, 0.1, 0.2, 0.4, 0.9, 1.5],
    ],
    ids=["halves", "thirds", "doubles", "triples", "between", "slivers", "late", "coarse"],
)
def test_samples_do_not_depend_on_the_steps(load, points):
    whole = rows(load(MIXED).initialize(**GIVEN), GRID)
    found = rows(load(MIXED).initialize(**GIVEN), points)
    met = [(expected, found[b]) for a, expected in whole.items() for b in found if abs(a - b) < 1e-10]
    assert len(met) >= 1
    assert all(a == b for a, b in met)


def test_steps_with_moving_inputs_and_changes_between_samples_agree_with_plain_python(load):
    """What moves is set again in Python, in which no input moves: only where nothing moves can the bits be compared."""
    fmu = load(MIXED).initialize(**GIVEN)
    simulation = Simulation(resolve(MIXED)())
    simulation.set("u", [0.5, -0.25])
    simulation.set("hold", 0.1)
    simulation.set("max_step", 0.07)
    simulation.initialize()
    simulation.start()
    for k, length in enumerate([0.1, 0.1, 0.02, 0.06, 0.4, 0.3, 1e-6]):
        if k % 2:
            assert fmu.set("u[1]", 0.1 * k) == OK
            simulation.set("u", [0.1 * k, -0.25])
        assert fmu.step(length) == OK, fmu.said
        simulation.step(length)
        assert [fmu.get(f"x[{n}]") for n in (1, 2)] == simulation.get("x").tolist(), k
        assert (fmu.get("z"), fmu.get("n")) == (simulation.get("z"), simulation.get("n")), k


def test_an_input_that_moves_between_samples_moves_the_states_from_where_they_are(load):
    """A rate of 1/s over 0.1 s, against an input held at its mean; then 0.6 against 0.55 for 0.02 s."""
    fmus = [load(MIXED).initialize(**GIVEN) for _ in range(2)]
    apart = []
    for fmu, value, slope in zip(fmus, (0.5, 0.55), (1.0, 0.0), strict=True):
        assert fmu.step(0.1) == OK
        assert fmu.set("u[1]", value) == fmu.set_derivatives("u[1]", slope) == OK
    for length in (0.1, 0.02):
        assert [fmu.step(length) for fmu in fmus] == [OK, OK]
        apart.append(fmus[0].get("x[1]") - fmus[1].get("x[1]"))
    assert fmus[0].get("u[1]") == pytest.approx(0.6)
    assert apart[0] == pytest.approx(0.0, abs=3e-4)
    assert apart[1] - apart[0] == pytest.approx(0.02 * 0.05, rel=0.02)


@pytest.mark.parametrize("cut", [0.25, 0.3, 0.33])
def test_a_state_saved_between_samples_goes_on_to_the_same_bits(load, cut):
    fmu = load(MIXED).initialize(**GIVEN)
    rows(fmu, [0.0, 0.1, 0.25])
    if cut > PERIOD:
        rows(fmu, [0.25, cut])
    saved = fmu.to_bytes(fmu.save())
    after = [cut, 0.4, 0.45, 0.5, 1.3]
    expected = rows(fmu, after)
    other = load(MIXED).initialize()
    assert other.SetFMUstate(other.from_bytes(saved)) == OK
    assert rows(other, after) == expected
    fmu.Reset()
    fmu.initialize(**GIVEN)
    assert rows(fmu, GRID) == rows(load(MIXED).initialize(**GIVEN), GRID)


@pytest.mark.parametrize("length", [0.75, 0.25])
def test_a_state_that_leaves_all_numbers_on_the_way_to_a_sample_or_to_the_end_is_an_error(load, length):
    breaks = f"{Path(__file__).parent / 'samples.py'}:Breaks"
    fmu = load(breaks).initialize(x=1e200, rate=1e200, sample_time=0.5)
    assert fmu.step(length) == ERROR
    assert "derivatives: 'x' is" in fmu.said


@pytest.mark.parametrize(("period", "length"), [(1e-300, 1.0), (1e-12, 1.0), (1.0, 1e10)])
def test_more_samples_than_can_be_counted_are_refused(load, period, length):
    fmu = load(COUNTER).initialize(sample_time=period)
    assert fmu.step(length) == ERROR
    assert f"sample_time = {period:g} s is too short for a step of {length:g} s" in fmu.said


def test_a_clock_that_begins_late_counts_from_there(load):
    fmu = load(COUNTER).initialize(start=17.3, u=2.0)
    for _ in range(9):
        assert fmu.step(0.04) == OK
    assert fmu.get("count") == 4
    assert fmu.get("last_time") == 17.3 + 3 * 0.1
    assert math.isclose(fmu.last_successful_time(), 17.66)
