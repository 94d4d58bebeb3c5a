"""What is drawn of a run with more points than a figure shows."""

import numpy as np
import pytest
from railcosim.orchestrator.evaluation import parse
from railcosim.orchestrator.evaluation.metrics import FUNCTIONS
from railcosim.orchestrator.figures import curves
from railcosim.orchestrator.figures.outline import outlined
from railcosim.orchestrator.run.recording import Results


@pytest.fixture(scope="module")
def long():
    """100 000 points of a wave with one spike up and one down, of a second wave, and of a flag."""
    time = np.arange(100_000) * 0.01
    wave = np.sin(time)
    wave[12_345], wave[80_000] = 7.0, -9.0
    columns = {"a[1].x": wave, "a[2].x": np.cos(time), "a[1].on": (time > 500.0).astype(float)}
    return Results(columns, time, units={}, parameters={}, step=0.01, stop_time=1e3, completed=True)


def test_no_extreme_is_lost(long):
    time, rows = outlined(parse("a[:].x", FUNCTIONS), long, None)
    assert time.shape == rows.shape
    assert rows.shape[0] == 2
    assert 7000 < rows.shape[1] < 9000
    assert (rows[0].max(), rows[0].min()) == (7.0, -9.0)
    assert time[0][rows[0].argmax()] == 123.45
    assert (np.diff(time) >= 0.0).all()
    assert time[1][-1] > 999.9
    np.testing.assert_array_equal(rows[1], np.cos(time[1]))


def test_what_looks_ahead_and_what_does_not_vary(long):
    time, (row,) = outlined(parse("at_sample(a[2].x)", FUNCTIONS), long, None)
    np.testing.assert_allclose(row[:-2], np.cos(time[0][:-2] + 0.01), atol=1e-12)
    assert set(outlined(parse("max(a[1].x) + 1", FUNCTIONS), long, None)[1].ravel()) == {8.0}


def test_only_what_is_long_is_outlined(long, monkeypatch):
    (curve,) = curves.curves_of({"y": ["a[1].on"]}, long)
    assert len(curve.x) < 9000
    monkeypatch.setattr(curves, "MOST_POINTS", 100_000)
    (whole,) = curves.curves_of({"y": ["a[1].on"]}, long)
    assert len(whole.x) == 100_000
    assert set(curve.y) == set(whole.y) == {0.0, 1.0}
