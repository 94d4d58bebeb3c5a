"""The virtual leader: the specified speeds and distance, and its data."""

import pytest
from railcosim.components import ComponentError, ReferenceProfile


def leader(t, **values):
    return ReferenceProfile(start_position=10e3, time=t, **values).outputs()


@pytest.mark.parametrize(
    ("t", "speed"),
    [(0.0, 50.0), (29.9, 50.0), (150.0, 68.0), (300.0, 80.0), (500.0, 62.0), (700.0, 74.0), (900.0, 64.0)],
)
def test_it_runs_at_the_specified_speeds(t, speed):
    assert leader(t)["speed"] == pytest.approx(speed, abs=1e-12)
    assert leader(t)["acceleration"] == 0.0


def test_it_covers_the_specified_distance():
    """By hand, a trapezoid is symmetric: 50 t + the sum of dv (1000 - begin - duration / 2), x_r(1000) = 78 445 m."""
    expected = 10e3 + 50e3
    for begin, change, acceleration in (
        (30, 18, 0.3),
        (190, 12, 0.2),
        (400, -18, 0.3),
        (560, 12, 0.25),
        (720, -10, 0.2),
    ):
        expected += change * (1000 - begin - 0.5 * (abs(change) / acceleration + acceleration / 0.1))
    assert expected == pytest.approx(78445.0)
    assert leader(1000.0)["position"] == pytest.approx(expected, abs=1e-9)


def test_the_virtual_carriage_runs_ahead():
    found = leader(123.4, virtual_distance=3200.0)
    assert found["virtual_position"] - found["position"] == pytest.approx(3200.0, abs=1e-10)


@pytest.mark.parametrize(
    ("data", "said"),
    [
        ([], "a profile is a table of speed"),
        ({"speed": 1.0, "jerk": 0.1, "change": []}, "no 'change'"),
        ({"speed": 1.0, "jerk": 0.1, "changes": [{"time": 1.0, "change": 2.0}]}, "'acceleration' must be a"),
        (
            {"speed": 1.0, "jerk": 0.0, "changes": [{"time": 1.0, "change": 2.0, "acceleration": 1.0}]},
            "jerk of a speed change must be positive",
        ),
    ],
)
def test_unusable_data_are_refused(data, said):
    with pytest.raises(ComponentError, match=said):
        ReferenceProfile(profile=data)
