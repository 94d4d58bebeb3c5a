"""The runs of a study as columns of a page."""

import numpy as np
from railcosim.orchestrator.report.content import Columns
from railcosim.orchestrator.report.studies import table
from railcosim.orchestrator.study.campaign import Study


def test_columns(study):
    frame, columns = Study.load(study()).frame(), Columns()
    told = table.columns_of(frame, ["lag.u", "lag.x"], {"metric.end": "the end"}, columns)
    roles = [(one["role"], one["label"]) for one in told]
    assert roles == [
        ("run", "run"),
        ("status", "status"),
        ("varied", "lag.u"),
        ("varied", "lag.x"),
        ("margin", "<i>low"),
        ("margin", "never"),
        ("verdict", "<i>low"),
        ("verdict", "never"),
        ("metric", "the end"),
    ]
    words = {one["name"]: columns.told[one["column"]].get("words") for one in told}
    assert words["status"] == ["completed"]
    assert set(words["verdict.<i>low"]) == {"pass", "fail"}
    assert words["lag.u"] is None


def test_what_is_missing_is_no_word(search):
    frame, columns = table.read_rows(search()), Columns()
    assert list(frame["run"]) == [0, 1, 2]
    told = {one["name"]: one["column"] for one in table.columns_of(frame, table.varied_in(frame), {}, columns)}
    assert columns.told[told["lag"]]["words"] == ["Other", ""]
    assert "robustness.low" not in told
    assert table.errors_of(frame) == {2: "it <fails>"}
    assert table.errors_of(frame[["run"]]) == {}


def test_of_very_many_runs_the_first_are_carried(study, monkeypatch):
    frame = Study.load(study()).frame()
    monkeypatch.setattr(table, "_MOST_NUMBERS", 2 * len(frame.columns))
    assert list(table.first_rows(frame)["run"]) == [0, 1]


def test_no_run(tmp_path):
    frame = table.read_rows(tmp_path)
    assert len(frame) == 0
    assert len(table.columns_of(frame, [], {}, Columns())) == 2


def test_what_was_recorded_of_the_runs_that_are_wanted_most(study, monkeypatch):
    found, columns = Study.load(study()), Columns()
    told = table.series_of(found, [4, 2, 0], columns)
    assert told["signals"] == ["lag.x"]
    assert list(told["runs"]) == [4, 2, 0]
    time, signal = told["runs"][2]
    assert columns.told[time]["points"] == columns.told[signal]["points"] == len(found.series(2))
    monkeypatch.setattr(table, "_MOST_POINTS", 2 * found.series(4).size)
    assert list(table.series_of(found, [4, 2, 0], columns)["runs"]) == [4, 2]
    assert list(table.series_of(found, [99], columns)["runs"]) == []
    found.told["how"]["record"] = []
    assert table.series_of(found, [4], columns) == {"signals": [], "runs": {}}
    assert np.isfinite(columns.loss)
