"""The schedule: steps, lines, ends, units."""

import numpy as np
import pytest
from railcosim.components import ComponentError, Schedule, simulate


def schedule(**values):
    return Schedule(points=3, times=[10.0, 20.0, 40.0], values=[1.0, 5.0, -3.0], **values)


@pytest.mark.parametrize(
    ("time", "step", "line"),
    [
        (0.0, 1.0, 1.0),
        (10.0, 1.0, 1.0),
        (15.0, 1.0, 3.0),
        (20.0, 5.0, 5.0),
        (35.0, 5.0, -1.0),
        (40.0, -3.0, -3.0),
        (99.0, -3.0, -3.0),
    ],
)
def test_steps_and_lines(time, step, line):
    """By hand."""
    assert schedule(time=time).outputs()["value"] == step
    assert schedule(time=time, interpolate=True).outputs()["value"] == pytest.approx(line, abs=1e-12)


def test_lines_against_numpy():
    result = simulate(schedule(interpolate=True), 60.0, 0.5)
    expected = np.interp(result["time"], [10.0, 20.0, 40.0], [1.0, 5.0, -3.0])
    assert result["value"] == pytest.approx(expected, abs=1e-12)


def test_a_breakpoint_that_is_a_communication_point_belongs_to_the_new_value():
    """0.3 = 3 * 0.1 is below its own product in binary, and above 0.1 + 0.1 + 0.1."""
    built = Schedule(points=2, times=[0.0, 0.3], values=[0.0, 1.0])
    assert simulate(built, 0.5, 0.1)["value"].tolist() == [0.0, 0.0, 0.0, 1.0, 1.0, 1.0]
    assert Schedule(points=2, times=[0.0, 0.7], values=[0.0, 1.0], time=0.1 * 7 - 1e-15).outputs()["value"] == 1.0


def test_one_point_is_a_constant():
    assert simulate(Schedule(values=85.0), 1.0, 0.5)["value"].tolist() == [85.0] * 3


def test_the_unit_is_given_when_it_is_built():
    built = Schedule(unit="N")
    assert built.slots["value"].unit == "N"
    assert built.slots["values"].unit == "N"
    assert built.slots["times"].unit == "s"
    assert Schedule().slots["value"].unit == "m/s"


def test_a_wrong_number_of_values_is_refused():
    with pytest.raises(ComponentError, match=r"Schedule\.values has shape \(3,\), but the value given has \(2,\)"):
        Schedule(points=3, values=[1.0, 2.0])


@pytest.mark.parametrize("times", [[0.0, 20.0, 10.0], [0.0, 10.0, 10.0]])
def test_breakpoints_must_rise(times):
    with pytest.raises(ComponentError, match=r"Schedule\.times must rise, not \[0\.0, "):
        Schedule(points=3, times=times)
