"""Speed limits in steps."""

import pytest
from railcosim.components.supervision.speed_limit import LIMITS, STEPS


@pytest.mark.parametrize(
    ("time", "limit"),
    [
        (-5.0, 19.6), (0.0, 19.6), (25.0, 19.6), (25.01, 22.6), (100.0, 22.6), (100.01, 19.6), (110.0, 19.6),
        (110.01, 22.6), (160.0, 22.6), (160.01, 19.6), (190.0, 19.6),
    ],
)  # fmt: skip
def test_limit_of_the_source(time, limit):
    """Eq. 64: each interval is closed at its end, whatever the rounding of the time."""
    limits = STEPS.read(LIMITS)
    assert limits.at(time) == limit
    assert limits.at(time + 4e-15) == limit


@pytest.mark.parametrize(
    "rows", ["x", [], [1.0], [(0.0, 1.0, 2.0)], [("a", 1.0)], [(0.0, -1.0)], [(1.0, 2.0), (1.0, 3.0)], [(0.0, True)]]
)
def test_unusable_limits_are_refused(rows):
    with pytest.raises(ValueError, match="speed limit"):
        STEPS.read(rows)
