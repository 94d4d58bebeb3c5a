"""Margins and times of speed and distance monitoring, by hand."""

import pytest
from railcosim.components.supervision.etcs_limits import (
    Reaction,
    emergency_margin,
    service_margin,
    speed_uncertainty,
    warning_margin,
)

KMH = 1.0 / 3.6


@pytest.mark.parametrize(
    ("margin", "speed", "expected"),
    [
        (emergency_margin, 0.0, 7.5),
        (emergency_margin, 110.0, 7.5),
        (emergency_margin, 160.0, 11.25),
        (emergency_margin, 250.0, 15.0),
        (service_margin, 100.0, 5.5),
        (service_margin, 160.0, 7.75),
        (service_margin, 210.0, 10.0),
        (warning_margin, 80.0, 4.0),
        (warning_margin, 125.0, 4.5),
        (warning_margin, 140.0, 5.0),
        (speed_uncertainty, 20.0, 2.0),
        (speed_uncertainty, 265.0, 7.0),
        (speed_uncertainty, 500.0, 12.0),
    ],
)
def test_margins_in_kmh(margin, speed, expected):
    """3.13.9.2.3 with A.3.1; SUBSET-041 5.3.1.2."""
    assert margin(speed * KMH) / KMH == pytest.approx(expected)


def test_what_happens_until_the_brakes_act():
    """3.13.9.3.2.10 by hand: 1 s of traction at 0.8 m/s2, 3 s more at 0.4 m/s2."""
    reaction = Reaction(30.0, 1.0, 0.8, 1.0, 4.0, 3.0)
    assert reaction.compensated_speed(0.0) == pytest.approx(30.0 + 1.0 + 0.8 + 1.2)
    assert reaction.distance(0.0) == pytest.approx(31.4 * 1.0 + (31.8 + 0.6) * 3.0)
    assert reaction.gain() == pytest.approx(3.0)
    # braking counts as running on
    assert reaction._replace(acceleration=-0.7).compensated_speed(0.0) == pytest.approx(31.0)
    # never below the target's speed
    assert reaction.compensated_speed(35.0) == pytest.approx(36.2)
    assert reaction.distance(35.0) == pytest.approx(35.0 + 35.6 * 3.0)
    assert reaction.indication() == pytest.approx(9.0)
    assert reaction._replace(service=10.0).indication() == pytest.approx(12.0)
