"""Maps: what is drawn where."""

import numpy as np
import pytest
from railcosim.orchestrator.study.analysis.pictures import maps
from railcosim.orchestrator.study.analysis.pictures.axes import FAIL, PASS, Axis

GRID = {"a.x": "0:3:4", "b": ["P", "Q"]}


def prepared(studied, vary, output, count, design="random", *, failed=()):
    frame, plan = studied(vary, {"margin.m": output}, count, design, failed=failed)
    verdicts = frame["verdict.m"].astype(object).to_numpy()
    return [Axis(frame, one) for one in plan.dimensions], frame["margin.m"].to_numpy(), verdicts


def test_cells_of_one_verdict_each(studied, axes, said):
    (x, y), _, verdicts = prepared(studied, GRID, lambda x, b: x - 1.5, 8, "grid", failed=(7,))
    ax = axes()
    maps.draw_verdicts(ax, x, y, verdicts)
    assert ax.collections[0].get_array().tolist() == [[0, 0, 1, 1], [0, 0, 1, None]]
    assert said(ax) == ["holds", "broken", "no verdict"]
    assert not ax.texts
    ax = axes()
    maps.draw_verdicts(ax, x, y, np.full(8, "pass", dtype=object))
    assert said(ax) == ["holds"]


def test_cells_of_many_runs_show_their_share(studied, axes):
    (x, y, _), _, verdicts = prepared(studied, GRID | {"c": "0:1:2"}, lambda x, b, c: x + c - 1.5, 16, "grid")
    ax = axes()
    maps.draw_verdicts(ax, x, y, verdicts)
    assert [text.get_text() for text in ax.texts[:4]] == ["0%", "50%", "100%", "100%"]
    assert [text.get_color() for text in ax.texts[:3]] == ["white", "black", "white"]
    assert len(ax.figure.axes) == 2  # with a colour bar


def test_runs_of_a_sample_stand_by_themselves(studied, axes, said):
    (x, y), _, verdicts = prepared(studied, {"a": "0:1", "b": "0:1"}, lambda a, b: a - 0.3, 50, failed=(4, 5))
    ax = axes()
    maps.draw_verdicts(ax, x, y, verdicts)
    passed, failed = (verdicts == "pass").sum(), (verdicts == "fail").sum()
    assert said(ax) == ["no verdict (2)", f"holds ({passed})", f"broken ({failed})"]
    assert len(ax.collections[-1].get_offsets()) == failed


@pytest.mark.parametrize("is_margin", [True, False])
def test_values_of_cells_and_of_runs(studied, axes, is_margin):
    (x, y), values, _ = prepared(studied, GRID, lambda x, b: x - 1.5, 8, "grid", failed=(7,))
    ax = axes()
    maps.draw_values(ax, x, y, values, label="margin of m", is_margin=is_margin)
    assert [text.get_text() for text in ax.texts] == ["-1.5", "-0.5", "0.5", "1.5", "-1.5", "-0.5", "0.5"]
    assert ax.get_title(loc="left") == "margin of m" or ax.get_title() == "margin of m"
    (x, y), values, _ = prepared(studied, {"a": "0:1", "b": "0:1"}, lambda a, b: a - 0.3, 50, failed=(4,))
    ax = axes()
    maps.draw_values(ax, x, y, values, label="m", is_margin=is_margin)
    lost, drawn = ax.collections
    assert (len(lost.get_offsets()), len(drawn.get_offsets())) == (1, 49)
    assert (drawn.norm.vmin == -drawn.norm.vmax) is is_margin


def test_of_many_runs_the_means_of_squares(studied, axes, monkeypatch):
    monkeypatch.setattr(maps, "_MOST_POINTS", 100)
    vary = {"a": "0:1", "b": "loguniform(1, 100)"}
    (x, y), values, _ = prepared(studied, vary, lambda a, b: a, 400, failed=(4,))
    ax = axes()
    maps.draw_values(ax, x, y, values, label="m", is_margin=False)
    means = ax.collections[0].get_array()
    assert means.shape == (40, 40)
    assert means.compressed() == pytest.approx(np.tile((np.arange(40) + 0.5) / 40, (40, 1))[~means.mask], abs=0.02)
    (x, y), values, _ = prepared(studied, {"a": "0:1", "b": ["P", "Q"]}, lambda a, b: a, 400)
    ax = axes()
    maps.draw_values(ax, x, y, values, label="m", is_margin=False)
    assert ax.collections[0].get_array().shape == (2, 40)


def test_many_cells_are_not_written_into(studied, axes):
    vary = {"a": "0:1:40", "b": "0:1:40"}
    (x, y), values, _ = prepared(studied, vary, lambda a, b: a, 1600, "grid")
    ax = axes()
    maps.draw_values(ax, x, y, values, label="m", is_margin=True)
    assert not ax.texts


@pytest.mark.parametrize(
    ("values", "is_margin", "extend"),
    [
        ([], True, "neither"),
        ([0.0, 0.0], True, "neither"),
        ([3.0, 3.0], False, "neither"),
        ([*range(100), 1e6], True, "max"),
        ([*[1.0] * 100, -1e6], True, "min"),
        ([-1e6, *range(100), 1e6], False, "both"),
    ],
)
def test_outliers_do_not_wash_out_the_rest(values, is_margin, extend):
    values = np.array(values, dtype=float)
    colours = maps._colours(values, is_margin)
    assert maps._extend(values, colours) == extend
    assert colours.get("vmax", 1.0) <= 101


def test_over_one_parameter(studied, axes, said):
    (x,), values, verdicts = prepared(studied, {"a": "0:3:4"}, lambda a: a - 1.5, 4, "grid", failed=(3,))
    ax = axes()
    maps.draw_line(ax, x, values, verdicts, label="margin of m")
    assert ax.lines[0].get_ydata().tolist()[:3] == [-1.5, -0.5, 0.5]
    assert said(ax) == ["no verdict (1)", "holds (1)", "broken (2)"]
    assert ax.get_ylabel() == "margin of m"
    (x,), values, _ = prepared(studied, {"a": "0:3"}, lambda a: a, 9)
    ax = axes()
    maps.draw_line(ax, x, values, None, label="m")
    assert not ax.lines
    assert len(ax.collections[0].get_offsets()) == 9
    assert ax.get_legend() is None
    (x,), values, _ = prepared(studied, {"a": ["P", "Q"]}, lambda a: [1.0, 2.0], 2, "grid")
    maps.draw_line(ax, x, values, None, label="m")
    assert [text.get_text() for text in ax.get_xticklabels()] == ["P", "Q"]


def test_forms_tell_apart_what_colours_do():
    assert len({mark for mark, _, _ in maps.MARKS.values()}) == 3
    assert (maps.MARKS["pass"][1], maps.MARKS["fail"][1]) == (PASS, FAIL)
