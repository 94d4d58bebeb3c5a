"""Histograms of margins, and bars of influence."""

import math

import numpy as np
from matplotlib.colors import to_hex
from railcosim.orchestrator.study.analysis import Estimate, Influence, Sensitivity, summarize
from railcosim.orchestrator.study.analysis.pictures.axes import FAIL, PASS
from railcosim.orchestrator.study.analysis.pictures.bars import draw_influences, draw_margins, height_of


def test_zero_parts_what_is_broken_from_what_holds(studied, axes):
    frame, plan = studied({"a": "-0.3:1"}, {"margin.m": lambda a: a}, 300, failed=(5, 6))
    (kept,) = summarize(frame, plan).requirements
    ax = axes()
    draw_margins(ax, kept, frame["margin.m"].to_numpy(), label="margin [m]")
    for colour, count in ((FAIL, kept.failed), (PASS, kept.passed)):
        bars = [bar for bar in ax.patches if to_hex(bar.get_facecolor()) == colour.lower()]
        assert sum(bar.get_height() for bar in bars) == count
        inside = [bar for bar in bars if bar.get_height()]
        assert all(bool(bar.get_x() >= -1e-12) is (colour == PASS) for bar in inside)
    title = ax.get_title(loc="left") + ax.get_title()
    assert f"holds in {kept.passed} of 298 runs: {kept.rate.value:.1%} (" in title
    assert title.endswith("; 2 without a margin")


def test_margins_that_are_all_zero(studied, axes):
    frame, plan = studied({"a": "0:1:3"}, {"margin.m": lambda a: 0 * a}, 3, "grid")
    (kept,) = summarize(frame, plan).requirements
    ax = axes()
    draw_margins(ax, kept, np.zeros(3), label="margin")
    assert sum(bar.get_height() for bar in ax.patches) == 3
    assert (ax.get_title(loc="left") + ax.get_title()).endswith("holds in 3 of 3 runs")


def test_bars_are_the_indices_that_are_known(axes):
    both = Influence("a", first=Estimate(0.3, 0.2, 0.4), total=Estimate(0.5, 0.4, 0.6))
    made = Sensitivity("metric.y", 9, "Saltelli", 0.5, (both, Influence("b", first=Estimate(0.1))))
    ax = axes()
    draw_influences(ax, made, label="y")
    assert [bars.get_label() for bars in ax.containers if bars.get_label()[0] != "_"] == ["with others", "alone"]
    assert [text.get_text() for text in ax.get_yticklabels()] == ["b", "a"]
    ranked = Sensitivity("metric.y", 9, "", 0.5, tuple(Influence(f"p{k}", Estimate(-0.5)) for k in range(20)))
    ax = axes()
    draw_influences(ax, ranked, label="y")
    assert [bar.get_width() for bar in ax.patches] == [-0.5] * 12
    assert ax.get_xlim()[0] < -1
    assert math.isclose(height_of([ranked]) - height_of([]), 0.75 + 12 * 0.33)
