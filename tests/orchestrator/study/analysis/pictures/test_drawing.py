"""Which pictures a study has."""

from contextlib import contextmanager

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure
from railcosim.orchestrator.study.analysis import draw_study
from railcosim.orchestrator.study.analysis.pictures import drawing

PAIR = {"cruise.alpha": "0.005:0.05", "train.mass": "normal(4e5, 2e4)"}
OUTPUTS = {"margin.spacing": lambda a, b, *_: (a - 0.02) * 200 - (b - 4e5) / 2e4, "metric.end": lambda a, *_: 1 / a}


@pytest.fixture
def drawn(studied, tmp_path, monkeypatch):
    """The pictures of a study as (heading, panels), drawn but neither laid out nor written."""
    found = {}

    @contextmanager
    def page(heading, panels, path, *, size, columns=1, **_):
        axes = Figure(figsize=size).subplots(-(-panels // columns), columns, squeeze=False).ravel()[:panels]
        found[path.name] = (heading, list(axes))
        yield list(axes)

    monkeypatch.setattr(drawing, "page", page)

    def make(*study, series=None, failed=(), **more):
        found.clear()
        frame, plan = studied(*study, failed=failed)
        paths = draw_study(frame, plan, tmp_path, series=series, **more)
        assert [path.name for path in paths] == list(found)
        return found

    return make


def test_a_sample_over_two_parameters(drawn):
    made = drawn(PAIR, OUTPUTS, 120, title="Comfort", units={"margin.spacing": "m", "metric.end": "s"}, failed=(3,))
    assert list(made) == [
        "where-spacing-holds.png",
        "margins-of-requirements.png",
        "what-came-out.png",
        "every-parameter-with-every-other.png",
        "what-matters.png",
    ]
    heading, (ax,) = made["where-spacing-holds.png"]
    assert heading == "Comfort\nWhere spacing holds"
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("cruise.alpha", "train.mass")
    _, (ax,) = made["margins-of-requirements.png"]
    assert ax.get_xlabel() == "margin [m]"
    assert len(made["what-came-out.png"][1]) == 2
    assert len(made["every-parameter-with-every-other.png"][1]) == 9
    heading, axes = made["what-matters.png"]
    assert heading == "Comfort\nWhat matters; shares of the variance, by RBD-FAST"
    assert [ax.get_title() or ax.get_title(loc="left") for ax in axes] == ["margin of spacing [m]", "end [s]"]


def test_of_many_parameters_the_strongest_two(drawn):
    vary = {"idle.a": "0:1", **PAIR, "cruise": ["P"]}
    outputs = {"margin.spacing": lambda i, a, b, c: (a - 0.02) * 200 - (b - 4e5) / 2e4}
    made = drawn(vary, outputs, 60)
    heading, (ax,) = made["where-spacing-holds.png"]
    assert heading == "Where spacing holds; 1 other varies as well"
    assert {ax.get_xlabel(), ax.get_ylabel()} == set(PAIR)
    assert made["what-matters.png"][0] == "What matters; shares of the variance of ranks"


def test_a_scatter_matrix_of_very_many_runs_shows_the_first(drawn, monkeypatch):
    monkeypatch.setattr(drawing, "_MOST_IN_MATRIX", 30)
    heading, panels = drawn(PAIR, OUTPUTS, 40)["every-parameter-with-every-other.png"]
    assert heading == "Every parameter with every other; the first 30 of 40 runs"
    assert sum(len(marks.get_offsets()) for marks in panels[3].collections) == 30


def test_a_grid_has_no_scatter_matrix(drawn):
    made = drawn({"a.x": "0:1:4", "b.y": "0:1:3"}, {f"margin.r{k}": lambda x, y: x - y for k in range(5)}, 12, "grid")
    assert "every-parameter-with-every-other.png" not in made
    assert len(made["margins-of-requirements.png"][1]) == 5


def test_one_parameter_and_none(drawn):
    made = drawn({"a.x": "0:1:4"}, {"margin.m": lambda x: x - 0.3, "metric.y": lambda x: x}, 4, "grid", format="svg")
    assert list(made) == ["margins-of-requirements.svg", "what-came-out.svg"]
    assert list(drawn({}, {"margin.m": lambda: np.arange(-1.0, 4.0)}, 5)) == ["margins-of-requirements.png"]
    assert list(drawn({"a.x": "0:1"}, {"metric.y": lambda x: x}, 5)) == [
        "what-came-out.png",
        "every-parameter-with-every-other.png",
    ]


def test_what_failed_altogether_has_no_pictures(drawn):
    assert list(drawn({"a.x": "0:1"}, {"margin.m": lambda x: x}, 3, failed=(0, 1, 2))) == []
    assert list(drawn({"a.x": "0:1", "a.y": "0:1"}, {"margin.m": lambda x, y: x}, 2, failed=(0, 1))) == []


def test_bands_with_the_worst_run(drawn):
    time = np.arange(3.0)
    series = pd.concat(pd.DataFrame({"run": k, "time": time, "v": k * time, "w": time}) for k in range(5))
    _, axes = drawn({"a.x": "0:1"}, {"margin.m": lambda x: x - 2}, 5, series=series, units={"v": "m/s"})[
        "over-time.png"
    ]
    assert [ax.get_ylabel() for ax in axes] == ["v [m/s]", "w"]
    assert axes[1].get_xlabel() == "time [s]"
    assert any(line.get_label().startswith("worst run") for line in axes[0].lines)
    fine = drawn({"a.x": "0:1"}, {"margin.m": lambda x: x + 1}, 5, series=series)
    assert not any(line.get_label().startswith("worst run") for line in fine["over-time.png"][1][0].lines)
    assert "over-time.png" not in drawn({"a.x": "0:1"}, {"metric.m": lambda x: x}, 5, series=series.iloc[:0])


def test_a_run_keeps_all_requirements_or_breaks_one(studied):
    outputs = {"margin.a": lambda x: x - 0.5, "margin.b": lambda x: 0.8 - x}
    frame, plan = studied({"a.x": "0:1:11"}, outputs, 11, "grid", failed=(6,))
    overall = drawing._Study(frame, plan, {}, None).overall()
    assert overall.tolist() == ["fail"] * 5 + ["pass", "", "pass", "pass", "fail", "fail"]


def test_pages_are_written(studied, tmp_path):
    frame, plan = studied({"a.x": "0:1:4"}, {"margin.m": lambda x: x - 0.3}, 4, "grid")
    paths = draw_study(frame, plan, tmp_path, dpi=30)
    assert sorted(tmp_path.iterdir()) == sorted(paths)
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in paths)
