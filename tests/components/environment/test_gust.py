"""The gust: on from its first instant to just before its last."""

import numpy as np
import pytest
from railcosim.components import Gust, PointMassTrain, simulate


@pytest.mark.parametrize(
    ("time", "expected"),
    [(0.0, 0.0), (209.9, 0.0), (210.0, -0.5), (225.0, -0.5), (239.9, -0.5), (240.0, 0.0), (350.0, 0.0)],
)
def test_window(time, expected):
    assert Gust(time=time).outputs()["acceleration"] == expected


@pytest.mark.parametrize("step", [0.1, 0.3, 0.7, 1.0 / 3.0])
def test_edges_do_not_depend_on_rounding(step):
    """The window holds exactly its length over the step, though k * step is rounded."""
    gust = Gust(size=1.0, start_time=30 * step, stop_time=60 * step)
    active = [Gust(size=1.0, start_time=30 * step, stop_time=60 * step, time=k * step).outputs() for k in range(100)]
    assert [k for k, out in enumerate(active) if out["acceleration"] != 0.0] == list(range(30, 60))
    assert np.flatnonzero(simulate(gust, 99 * step, step)["acceleration"]).tolist() == list(range(30, 60))
    summed = np.cumsum(np.full(100, step)) - step
    late = [Gust(size=1.0, start_time=30 * step, stop_time=60 * step, time=float(t)).outputs() for t in summed]
    assert sum(out["acceleration"] != 0.0 for out in late) == 30


def test_a_train_in_the_gust_loses_what_the_window_holds():
    """Analytic: without resistance the speed falls by size times duration, 0.5 * 30 m/s."""
    wind = simulate(Gust(), 350.0, 0.5)["acceleration"]
    train = PointMassTrain(c0=0.0, c1=0.0, c2=0.0, speed=85.0)
    result = simulate(train, 350.0, 0.5, lambda t: {"disturbance": wind[round(t / 0.5)]})
    assert result["speed"][-1] == pytest.approx(70.0, rel=1e-12)
    assert result["speed"][420] == 85.0


def test_a_negative_size_pushes():
    assert Gust(size=-0.2, time=220.0).outputs()["acceleration"] == 0.2
