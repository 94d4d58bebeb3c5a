"""The odometer and speed sensor."""

import numpy as np
import pytest
from railcosim.components import Sensor, simulate


def moving(t):
    return {"true_position": 3.0 * t + 1.0, "true_speed": 3.0 + 0.1 * t}


def test_without_faults_it_shows_the_truth():
    found = simulate(Sensor(), 1.0, 0.01, moving)
    # A direct output is that of the begin of its sample; so is the first row.
    t = np.concatenate([[0.0], found["time"][:-1]])
    assert found["position"] == pytest.approx(3.0 * t + 1.0, abs=1e-12)
    assert found["speed"] == pytest.approx(3.0 + 0.1 * t, abs=1e-12)


def test_noise_has_the_size_asked_for():
    found = simulate(Sensor(position_noise=0.5, speed_noise=0.02), 20.0, 0.01, {"true_position": 7.0})
    assert found["position"].mean() == pytest.approx(7.0, abs=0.03)
    assert found["position"].std() == pytest.approx(0.5, rel=0.05)
    assert found["speed"].std() == pytest.approx(0.02, rel=0.05)
    assert abs(np.corrcoef(found["position"], found["speed"])[0, 1]) < 0.05


def test_resolution():
    found = simulate(Sensor(position_resolution=0.25, speed_resolution=0.1), 5.0, 0.01, moving)
    assert found["position"] * 4 == pytest.approx(np.round(found["position"] * 4), abs=1e-9)
    t = np.concatenate([[0.0], found["time"][:-1]])
    assert np.abs(found["position"] - 3.0 * t - 1.0).max() <= 0.125 + 1e-9
    assert np.abs(found["speed"] - 3.0 - 0.1 * t).max() <= 0.05 + 1e-9


@pytest.mark.parametrize("delay", [1, 3, 10])
def test_delay(delay):
    found = simulate(Sensor(delay=delay), 1.0, 0.01, moving)
    t = np.maximum(found["time"][1:] - 0.01 * (1 + delay), 0.0)
    assert found["position"][1:] == pytest.approx(3.0 * t + 1.0, abs=1e-12)
