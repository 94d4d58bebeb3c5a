"""The Gaussian disturbance: size, independence, holding time."""

import numpy as np
import pytest
from railcosim.components import GaussianDisturbance, simulate


@pytest.mark.long
def test_mean_deviation_and_independence():
    """30 000 draws: three standard errors of mean, deviation and correlation."""
    found = simulate(GaussianDisturbance(deviation=0.02, hold=0.01, seed=7), 100.0, 0.01)["disturbance"]
    assert found.shape == (10001, 3)
    assert np.abs(found.mean(axis=0)).max() < 3.0 * 0.02 / 100.0
    assert found.std(axis=0) == pytest.approx(0.02, rel=0.03)
    assert np.abs(np.corrcoef(found.T) - np.eye(3)).max() < 0.035


def test_values_are_held():
    found = simulate(GaussianDisturbance(hold=0.04), 1.0, 0.01)["disturbance"][:-1]
    blocks = found.reshape(25, 4, 3)
    assert (blocks == blocks[:, :1]).all()
    assert (np.diff(blocks[:, 0], axis=0) != 0.0).all()
