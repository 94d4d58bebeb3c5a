"""Swings that grow up to the end are found, and none that calm down, rest or have a limit."""

import numpy as np
import pytest
from railcosim.orchestrator.run.watching.swings import find_swings

TIME = np.arange(0.0, 60.0, 0.1)


def test_growing_swings():
    found = find_swings(50.0 + np.exp(0.1 * TIME) * np.sin(2.0 * TIME))
    assert found.factor == pytest.approx(np.exp(0.1 * np.pi / 2.0), rel=0.02)
    assert found.begin == 0


def test_swings_from_one_step_to_the_next():
    assert find_swings((-2.0) ** np.arange(8)).factor == pytest.approx(2.0)


def test_growth_that_begins_late():
    calm = 0.01 * np.sin(2.0 * TIME)
    found = find_swings(np.concatenate([calm, 0.01 * np.exp(0.2 * TIME) * np.sin(2.0 * TIME)]))
    assert 580 <= found.begin <= 640


def test_swings_on_plateaus():
    """A signal that is held over several points."""
    assert find_swings(np.repeat((-1.7) ** np.arange(9), 4)).factor == pytest.approx(1.7)


CALM = {
    "that calm down": np.exp(-0.1 * TIME) * np.sin(2.0 * TIME),
    "that stay": np.sin(2.0 * TIME),
    "of a train that gathers way": 80.0 * (1.0 - np.exp(-0.1 * TIME)),
    "that have grown to a limit": np.tanh(1e-3 * np.exp(0.4 * TIME)) * np.sin(2.0 * TIME),
    "of resonance": TIME * np.sin(2.0 * TIME),
    "of rounding": 1e-15 * np.exp(0.2 * TIME) * np.sin(2.0 * TIME),
    "that are too few": (-9.0) ** np.arange(5),
    "that grow by too little": np.exp(0.03 * TIME) * np.sin(2.0 * TIME),
    "of noise": np.random.default_rng(1).normal(size=5000),
    "of nothing": np.zeros(100),
    "of no points": np.empty(0),
    "that are no numbers": np.full(100, np.nan),
}


@pytest.mark.parametrize("name", CALM)
def test_no_false_alarm(name):
    assert find_swings(CALM[name]) is None
