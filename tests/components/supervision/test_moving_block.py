"""The authority behind a train ahead: absolute and relative, and without one."""

import pytest
from railcosim.components import MovingBlock

HEARD = {
    "has_ahead": True, "ahead_position": 5000.0, "ahead_speed": 30.6, "ahead_length": 100.0, "position_error": 15.0,
    "speed_error": 0.6, "margin": 20.0, "ahead_braking": 1.5,
}  # fmt: skip


def test_absolute_braking_distance():
    out = MovingBlock(**HEARD).outputs()
    assert (out["supervised_location"], out["end_of_authority"]) == (4885.0, 4865.0)


def test_relative_braking_distance_counts_what_the_train_ahead_still_runs():
    out = MovingBlock(**HEARD, relative=True).outputs()
    assert out["supervised_location"] == pytest.approx(4885.0 + 30.0**2 / 3.0)
    standing = MovingBlock(**{**HEARD, "ahead_speed": 0.3}, relative=True).outputs()
    assert standing["supervised_location"] == 4885.0


def test_a_train_that_brakes_hardest_never_stops_behind_the_bound():
    """Whatever the age of the message: the bound is where it stops, at the soonest, by what it said then."""
    v, b = 40.0, 1.1
    for age in (0.0, 1.0, 10.0, 36.0, 100.0):
        t = min(age, v / b)
        rear = 1000.0 + v * t - 0.5 * b * t * t - 100.0
        bound = MovingBlock(
            has_ahead=True, ahead_position=1000.0, ahead_speed=v, ahead_age=age, relative=True, ahead_braking=b
        ).outputs()
        still = (v - b * t) ** 2 / (2.0 * b)
        assert bound["supervised_location"] <= rear + still


def test_old_messages_are_told():
    assert not MovingBlock(**HEARD, ahead_age=2.0).outputs()["stale"]
    assert MovingBlock(**HEARD, ahead_age=2.1).outputs()["stale"]
    assert not MovingBlock(ahead_age=9.0).outputs()["stale"]


def test_without_a_train_ahead_it_is_the_end_of_the_line():
    out = MovingBlock(end_of_line=31e3, margin=30.0).outputs()
    assert (out["end_of_authority"], out["supervised_location"]) == (31e3, 31030.0)
