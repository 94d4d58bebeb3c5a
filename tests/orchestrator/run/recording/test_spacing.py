"""Groups of signals that are recorded as often as is said for each: values by hand, files, figures, comparisons."""

import csv
import json
import re

import numpy as np
import pandas
import pytest
from railcosim.orchestrator import Results, load, resume, run
from railcosim.orchestrator.cli.app import call
from railcosim.orchestrator.errors import ExpressionError, ScenarioError
from railcosim.orchestrator.figures import number
from railcosim.orchestrator.figures.curves import curves_of
from railcosim.orchestrator.figures.outline import MOST_POINTS
from railcosim.orchestrator.report import content
from railcosim.orchestrator.report.content import pack
from railcosim.orchestrator.run.recording.spacing import Spacing, kept_signals
from railcosim.orchestrator.scenario import dump
from railcosim.orchestrator.system import Stepping

TEXT = """
title = "Lags"
[simulation]
stop_time = 1.1
step = 0.1
{record}
[instances.lag]
component = "{lag}"
count = 3
start.rate = 2.0
start.u = 1.0
[metrics]
most = "max(lag[:].x)"
[[figures]]
title = "x"
y = ["lag[1].x", "lag[2].x"]
"""
GROUPS = 'record_only = { "lag[1].*" = 0.1, "lag[2].x" = 0.2, "lag*.x" = 0.4 }'


@pytest.fixture
def scenario(tmp_path, mine):
    def write(record=""):
        (tmp_path / "lags.toml").write_text(TEXT.format(lag=mine("Lag"), record=record))
        return load(str(tmp_path / "lags.toml"))

    return write


@pytest.mark.parametrize("kind", ["plain", "native"])
def test_each_group_has_its_values_at_its_own_points_and_at_the_last(scenario, tmp_path, kind):
    full = run(scenario(), kind=kind)
    few = run(scenario(GROUPS), kind=kind, output=tmp_path / "out")
    assert list(few.time) == list(full.time)
    for name, rows in (("lag[1].x", range(12)), ("lag[2].x", [*range(0, 12, 2), 11]), ("lag[3].x", [0, 4, 8, 11])):
        there = np.isin(range(12), list(rows))
        assert (few.results[name][there] == full.results[name][there]).all()
        assert np.isnan(few.results[name][~there]).all()
    assert [metric.values for metric in few.metrics] == [metric.values for metric in full.metrics]
    frame = pandas.read_csv(tmp_path / "out" / "results.csv", index_col="time")
    assert frame["lag[3].x"].dropna().tolist() == few.results["lag[3].x"][[0, 4, 8, 11]].tolist()
    assert frame["lag[1].x"].notna().all()


@pytest.mark.parametrize("ending", [".csv", ".parquet", ".h5", ".mat"])
def test_every_format_keeps_what_is_blank(scenario, tmp_path, ending):
    few = run(scenario(GROUPS), kind="plain")
    few.results.save(tmp_path / f"few{ending}")
    again = Results.load(tmp_path / f"few{ending}")
    assert all(np.array_equal(again[name], few.results[name], equal_nan=True) for name in few.results)


def test_rows_are_as_far_apart_as_the_smallest_or_as_is_said(scenario):
    few = run(scenario('record_only = { "lag[1].x" = 0.4, "lag[2].x" = 0.2 }'), kind="plain")
    assert list(few.time.round(9)) == [0.0, 0.2, 0.4, 0.6, 0.8, 1.0, 1.1]
    assert list(np.isnan(few.results["lag[1].x"])) == [False, True, False, True, False, True, False]
    finer = run(scenario('record = 0.1\nrecord_only = { "lag[1].x" = 0.2, "lag[2].x" = 0.3 }'), kind="plain")
    assert list(np.flatnonzero(~np.isnan(finer.results["lag[2].x"]))) == [0, 3, 6, 9, 11]


def test_a_resumed_run_goes_on_with_them(scenario, tmp_path):
    system = scenario(GROUPS)
    run(system, kind="plain", output=tmp_path / "whole", figures=False)
    run(system, kind="plain", output=tmp_path / "parts", stop_time=1.0, checkpoint_every=0.5, figures=False)
    resume(tmp_path / "parts", stop_time=1.1, figures=False)
    assert (tmp_path / "parts" / "results.csv").read_bytes() == (tmp_path / "whole" / "results.csv").read_bytes()


def test_a_scenario_that_is_written_has_them(scenario, tmp_path):
    system = scenario(GROUPS)
    assert '[simulation.record_only]\n"lag[1].*" = 0.1\n"lag[2].x" = 0.2\n"lag*.x" = 0.4\n' in dump(system)
    (tmp_path / "again.toml").write_text(dump(system))
    assert load(str(tmp_path / "again.toml")).stepping == system.stepping


@pytest.mark.parametrize(
    ("written", "message"),
    [
        ('record_only = { "lag[1].x" = 0.15 }', r"0\.15 s is not a whole number of steps of 0\.1 s"),
        (
            'record_only = { "lag[1].x" = 0.2, "lag[2].x" = 0.3 }',
            r"0\.3 s of 'lag\[2\]\.x' is no whole number of rows, which are 0\.2 s apart; take 0\.2 s, or",
        ),
        ('record_only = { "lag[1].x" = 0 }', r"record_only\.lag\[1\]\.x: takes a number greater than 0, in s, not 0"),
        (
            'record_only = { "lag[1].x" = "often" }',
            r"x: takes a number greater than 0, in s, not 'often'",
        ),
        ('record_only = { "lag[1].z" = 0.1 }', r"record_only: no signal is called 'lag\[1\]\.z'"),
        ("record_only = {}", "is not a list of names, nor a table of names and times"),
        (
            'record = 0\nrecord_only = { "lag[1].x" = 0.1 }',
            r"simulation\.record: 0 s is not a whole number of steps of 0\.1 s",
        ),
    ],
)
def test_what_is_no_group_is_refused(scenario, written, message):
    with pytest.raises(ScenarioError, match=message):
        run(scenario(written), kind="plain")


@pytest.mark.parametrize(
    ("stepping", "said"),
    [
        (
            {"record": 0.2},
            "0.3 s of 'lag*.x' is no whole number of rows, which are 0.2 s apart; take a multiple of 0.2",
        ),
        ({"record": 0.1, "record_only": {"lag*.x": -0.2}}, "-0.2 s of 'lag*.x' is no whole number of rows"),
        ({"record": None, "record_only": {"lag*.x": 0.25}}, "0.25 s of 'lag*.x' is no whole number of rows"),
        ({"record": 0.1, "record_only": {"lag*.x": float("nan")}}, "nan s of 'lag*.x' is no whole number of rows"),
        ({"record": float("inf")}, "record = inf s is inf steps of 0.1 s"),
    ],
)
def test_distances_that_python_sets_are_checked_too(scenario, stepping, said):
    system = scenario('record_only = { "lag*.x" = 0.3 }').changed(stop_time=1.2, **stepping)
    with pytest.raises(ScenarioError, match=re.escape(said)):
        run(system, kind="plain")


def test_texts_are_blank_texts():
    spacing = Spacing(["a", "b"], ["String", "Real"], {"a": 2, "b": 2})
    rows = spacing.blank(1, [[0.1, "on", 1.0], [0.2, "off", 2.0]], whole=False)
    assert rows[1] == [0.2, "off", 2.0]
    assert rows[0][:2] == [0.1, ""]
    assert np.isnan(rows[0][2])


def test_the_first_pattern_that_means_a_signal_counts():
    stepping = Stepping(record=0.1, record_only={"a*": 0.3, "*": 0.1})
    assert kept_signals(["ab", "b"], stepping) == {"only": {"ab", "b"}, "apart": {"ab": 3, "b": 1}}
    assert kept_signals(["ab"], Stepping()) == {}
    assert kept_signals(["ab", "b"], Stepping(record_only=["b"])) == {"only": {"b"}}


def test_recorded_runs_are_compared_at_the_values_that_there_are(scenario, tmp_path, capsys):
    """Either as the reference; what is not due is no deviation, and a NaN anywhere else is one."""
    run(scenario(), kind="plain", output=tmp_path / "full", figures=False)
    run(scenario(GROUPS), kind="plain", output=tmp_path / "few", figures=False)
    for pair in (("full", "few"), ("few", "full")):
        assert call(["compare", *(str(tmp_path / each) for each in pair), "-o", str(tmp_path / "out")]) == 0
    with (tmp_path / "few" / "results.csv").open(newline="") as stream:
        header, *rows = csv.reader(stream)
    rows[8][header.index("lag[3].x")] = "nan"
    with (tmp_path / "broken.csv").open("w", newline="") as stream:
        csv.writer(stream).writerows([header, *rows])
    assert call(["compare", str(tmp_path / "full"), str(tmp_path / "broken.csv"), "--no-figures"]) == 1
    assert "lag[3].x" in capsys.readouterr().out


def test_what_is_drawn_goes_through_the_values_that_there_are(scenario, tmp_path):
    """Of the second lag every second point; where there are too many points, the extremes among them."""
    few = run(scenario(GROUPS), kind="plain", output=tmp_path / "out")
    every, second = curves_of({"y": ["lag[1].x", "lag[2].x"]}, few.results)
    assert (len(every.x), len(second.x)) == (12, 7)
    assert list(second.x.round(9)) == [0.0, 0.2, 0.4, 0.6, 0.8, 1.0, 1.1]
    assert not np.isnan(second.y).any()
    for x, y in (("lag[1].x", "lag[2].x"), ("lag[2].x", "lag[1].x")):
        (beside,) = curves_of({"x": x, "y": [y]}, few.results)
        assert (beside.x == beside.y).all()
        assert len(beside.x) == 7
    (gap,) = curves_of({"y": ["1 / (lag[1].x - lag[1].x)"]}, few.results)
    assert len(gap.x) == 12
    assert len(few.figures) == 1


FIGURES = """
[[figures]]
title = "fine"
y = ["lag[1].x - mean(lag[1].x)", "at_sample(lag[1].x)", "lag[3].x", "lag[3].x - max(lag[3].rate)"]
[[figures]]
title = "band"
y = ["lag[1].x"]
bands = ["max(lag[2].x)"]
[[figures]]
title = "ahead"
y = ["at_sample(lag[i].x)"]
"""


def test_figures_that_look_at_every_row_of_what_is_recorded_less_often(scenario, tmp_path, capsys):
    """They would be empty: the run says so, and draws the others; what is drawn afterwards is refused."""
    scenario(GROUPS)
    (tmp_path / "lags.toml").write_text((tmp_path / "lags.toml").read_text() + FIGURES)
    few = run(load(str(tmp_path / "lags.toml")), kind="plain", output=tmp_path / "out")
    why = "they look at every row of what is recorded less often"
    assert f"not drawn, because {why} (record_only): 'band', 'ahead'" in few.checked.notes
    assert [path.name for path in few.figures] == ["x.png", "fine.png"]
    assert all(np.isfinite(curve.y).all() for curve in curves_of({"y": ["lag[1].x - mean(lag[1].x)"]}, few.results))
    with pytest.raises(ScenarioError, match=r"max looks at every row, and lag\[2\]\.x is recorded less often"):
        few.results.plot("lag[1].x - max(lag[:].x)")
    with pytest.raises(ExpressionError, match=r"final looks at every row, and lag\[3\]\.x is recorded less often"):
        curves_of({"x": "lag[1].x - final(lag[3].x)", "y": ["lag[1].x"]}, few.results)
    assert call(["plot", str(tmp_path / "out"), "jerk(lag[3].x)"]) != 0
    assert "jerk looks at every row" in " ".join(capsys.readouterr().err.split())
    with pytest.raises(ExpressionError, match="mean looks at every row"):
        number("mean(lag[2].x)", few.results)


def test_a_page_has_a_line_or_the_last_value_where_there_is_none(scenario, tmp_path, monkeypatch):
    few = run(scenario(GROUPS), kind="plain", output=tmp_path / "out")
    record = json.loads((tmp_path / "out" / "run.json").read_text()) | {"stepwise": ["lag[2].x"]}
    (tmp_path / "out" / "run.json").write_text(json.dumps(record))
    packed = []
    monkeypatch.setattr(content, "pack", lambda column: (packed.append(column), pack(column))[1])
    places = content.read_content(tmp_path / "out", content.Columns()).places
    assert set(places) == set(few.results)
    assert not np.isnan(packed).any()
    second, third = (few.results[f"lag[{k}].x"] for k in (2, 3))
    assert packed[places["lag[2].x"]].tolist() == [second[k] for k in (0, 0, 2, 2, 4, 4, 6, 6, 8, 8, 10, 11)]
    assert packed[places["lag[3].x"]][2] == pytest.approx((third[0] + third[4]) / 2)


def test_a_long_run_is_outlined_by_the_values_that_there_are():
    count = MOST_POINTS + 2
    time = np.arange(count) / 1024.0
    some = np.where(np.arange(count) % 3, np.nan, time)
    told = {"units": {}, "parameters": {}, "step": 1 / 1024, "stop_time": float(time[-1]), "completed": True}
    (curve,) = curves_of({"y": ["a.x"]}, Results({"a.x": some}, time, **told))
    assert (curve.y == curve.x).all()
    assert curve.y[-1] >= time[-4]
