"""Bands over time: of runs with the same times, and of those with their own."""

import numpy as np
import pandas as pd
import pytest
from railcosim.orchestrator.study.analysis.pictures.bands import aligned, draw_bands


def series(*runs):
    return pd.concat(pd.DataFrame({"run": k, "time": t, "v": v}) for k, (t, v) in enumerate(runs))


def test_runs_with_the_same_times():
    time = np.arange(5.0)
    runs, times, values = aligned(series((time, time), (time, 2 * time)), "v")
    assert runs.tolist() == [0, 1]
    assert times.tolist() == [0, 1, 2, 3, 4]
    assert values.tolist() == [[0, 1, 2, 3, 4], [0, 2, 4, 6, 8]]


def test_runs_with_times_of_their_own():
    """One ended early, one took other steps."""
    given = series(
        (np.arange(3.0), np.arange(3.0)), (np.arange(5.0), np.ones(5)), (np.array([0.0, 4.0]), np.array([0, 8]))
    )
    _, times, values = aligned(given, "v")
    assert times.tolist() == [0, 1, 2, 3, 4]
    assert values[0] == pytest.approx([0, 1, 2, np.nan, np.nan], nan_ok=True)
    assert values[2].tolist() == [0, 2, 4, 6, 8]
    shifted = series((np.array([0.0, 1.0]), np.array([0.0, 1.0])), (np.array([0.0, 2.0]), np.array([0.0, 4.0])))
    assert aligned(shifted, "v")[2] == pytest.approx(np.array([[0, 1], [0, 2]]))


def test_what_is_drawn(axes):
    time = np.arange(3.0)
    given = series(*[(time, k + time) for k in range(11)])
    ax = axes()
    draw_bands(ax, given, "v", label="speed [m/s]", worst=7)
    median, worst = ax.lines
    assert median.get_ydata().tolist() == [5, 6, 7]
    assert worst.get_ydata().tolist() == [7, 8, 9]
    assert worst.get_label() == "worst run (7)"
    edges = [band.get_paths()[0].vertices[:, 1] for band in ax.collections]
    assert [(e.min(), e.max()) for e in edges] == [(0, 12), (0.5, 11.5), (2.5, 9.5)]
    ax = axes()
    draw_bands(ax, given, "v", label="v", worst=99)
    assert len(ax.lines) == 1
    assert ax.get_ylim() == pytest.approx((-0.6, 12.6))


def test_a_run_that_goes_astray_leaves_the_others_to_be_seen(axes):
    time = np.arange(3.0)
    ax = axes()
    draw_bands(ax, series(*[(time, 1e6 * (k == 0) + k + time) for k in range(41)]), "v", label="v")
    assert ax.get_ylim()[1] < 100
    constant = series((time, 0 * time), (time, 0 * time))
    draw_bands(ax, constant, "v", label="v")
    assert ax.get_ylim() == (-0.5, 0.5)
