"""The sinusoid against NumPy's."""

import numpy as np
import pytest
from railcosim.components import Sinusoid, simulate


def test_against_numpy():
    built = Sinusoid(mean=1.0, amplitude=0.5, period=8.0, phase=0.3, start_time=2.0, stop_time=20.0)
    result = simulate(built, 30.0, 0.5)
    t = result["time"]
    swing = 0.5 * np.sin(2.0 * np.pi * (t - 2.0) / 8.0 + 0.3)
    assert result["value"] == pytest.approx(1.0 + np.where((t >= 2.0) & (t < 20.0), swing, 0.0), abs=1e-12)


def test_the_unit_is_given_when_it_is_built():
    assert Sinusoid(unit="N").slots["amplitude"].unit == "N"
