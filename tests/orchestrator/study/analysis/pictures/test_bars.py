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
    assert [bar.get_width() for bar in ax.patches] == [0.25] * 12
    first = Influence("p", Estimate(0.5, -0.1, 0.9), first=Estimate(0.3, 0.2, 0.4))
    ax = axes()
    draw_influences(ax, Sensitivity("metric.y", 9, "RBD-FAST", 0.5, (first,)), label="y")
    assert [bar.get_width() for bar in ax.patches] == [0.25, 0.3]


def test_what_lies_far_beyond_is_in_the_outermost_bars(studied, axes):
    frame, plan = studied({"a": "-1:1"}, {"margin.m": lambda a: np.where(np.arange(200) < 3, [-1e6], a)}, 200)
    (kept,) = summarize(frame, plan).requirements
    ax = axes()
    draw_margins(ax, kept, frame["margin.m"].to_numpy(), label="margin")
    assert sum(bar.get_height() for bar in ax.patches) == 200
    assert ax.get_xlabel() == "margin; 3 below what is shown, in the outermost bars"
    assert ax.get_xlim()[0] > -10
    draw_margins(ax, kept, -frame["margin.m"].to_numpy(), label="margin")
    assert ax.get_xlabel() == "margin; 3 above what is shown, in the outermost bars"


def test_how_high_a_page_is():
    ranked = Sensitivity("metric.y", 9, "", 0.5, tuple(Influence(f"p{k}") for k in range(20)))
    assert math.isclose(height_of([ranked]) - height_of([]), 0.75 + 12 * 0.33)
