"""Chunks are as long as they should be, and no worker is idle at the end."""

import pytest
from railcosim.orchestrator.study.campaign.pace import Pace


@pytest.mark.parametrize(
    ("seconds", "left", "workers", "size"),
    [
        (None, 1000, 2, 1),  # nothing is known
        (0.01, 100_000, 2, 100),  # a second
        (0.01, 400, 2, 50),  # four for each worker of what is left
        (0.01, 12, 2, 5),  # no less than what is worth sending
        (0.01, 3, 2, 3),
        (7.0, 100, 2, 1),
        (0.0, 10, 1, 10),
    ],
)
def test_size(seconds, left, workers, size):
    pace = Pace()
    if seconds is not None:
        pace.took(4, 4 * seconds)
    assert pace.size(left, workers) == size
