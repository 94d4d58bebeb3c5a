"""Recorded signals survive the way to the disk and back exactly, whatever happened to the run."""

import json
import math

import fmpy.util
import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from railcosim.orchestrator import results as module
from railcosim.orchestrator.errors import ScenarioError
from railcosim.orchestrator.results import Recorder, Results

RECORD = {
    "units": {"train.speed": "m/s"},
    "texts": [],
    "parameters": {"train.mass": 4e5},
    "step": 0.1,
    "stop_time": 1.0,
    "status": "completed",
    "figures_wanted": [],
}
AWKWARD = [0.1, 1 / 3, -0.0, 5e-324, 1.7976931348623157e308, math.pi, 1e16, 123456789.123456789, 1e-7, 2.0**53 + 2]


def saved(directory, names, rows, **record):
    recorder = Recorder(names, directory)
    for time, *values in rows:
        recorder.record(time, values)
    recorder.close()
    (directory / "run.json").write_text(json.dumps(RECORD | record))
    return recorder


def test_numbers_survive_exactly(tmp_path):
    rows = [(k * 0.1, value, k, k % 2) for k, value in enumerate(AWKWARD)]
    time, columns = saved(tmp_path, ["train.speed", "train.gear", "train.on"], rows).columns()
    loaded = Results.load(tmp_path)
    assert np.array_equal(loaded.time, time)
    assert list(loaded.time) == [k * 0.1 for k in range(len(AWKWARD))]
    assert list(loaded.names()) == ["train.speed", "train.gear", "train.on"]
    for name in columns:
        assert np.array_equal(loaded[name], columns[name])
        assert loaded[name].dtype == columns[name].dtype == np.float64
    assert list(loaded["train.speed"]) == AWKWARD
    assert math.copysign(1.0, loaded["train.speed"][2]) == -1.0


@given(st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=1, max_size=30))
def test_any_number_survives(tmp_path_factory, values):
    directory = tmp_path_factory.mktemp("any")
    saved(directory, ["x"], [(float(k), v) for k, v in enumerate(values)])
    assert list(Results.load(directory)["x"]) == values


TEXTS = ["plain", "12", "", 'say "no", twice', "two\nlines", "3.5e7", "naïve", "nan"]


def test_texts_survive_even_where_they_look_like_numbers(tmp_path):
    rows = [(float(k), text, 1.5 * k) for k, text in enumerate(TEXTS)]
    _, columns = saved(tmp_path, ["a.word", "a.x"], rows, texts=["a.word"]).columns()
    loaded = Results.load(tmp_path)
    assert list(loaded["a.word"]) == list(columns["a.word"]) == TEXTS
    assert loaded["a.word"].dtype == columns["a.word"].dtype == object
    assert list(loaded["a.x"]) == [1.5 * k for k in range(len(TEXTS))]


def test_a_text_that_is_a_number_throughout_stays_a_text(tmp_path):
    saved(tmp_path, ["a.word"], [(0.0, "1"), (1.0, "2")], texts=["a.word"])
    assert list(Results.load(tmp_path)["a.word"]) == ["1", "2"]


def test_other_programs_read_the_file(tmp_path):
    saved(tmp_path, ["train[1].speed", "row[2]"], [(k * 0.1, v, 7) for k, v in enumerate(AWKWARD)])
    path = tmp_path / "results.csv"
    theirs = fmpy.util.read_csv(path)
    assert theirs.dtype.names == ("time", "train[1].speed", "row[2]")
    assert np.array_equal(theirs["train[1].speed"], AWKWARD)
    frame = pd.read_csv(path, engine="python")
    assert list(frame.columns) == ["time", "train[1].speed", "row[2]"]
    assert np.array_equal(frame["train[1].speed"], AWKWARD)


def test_elements_of_a_matrix(tmp_path):
    """Their names hold a comma, so they stand in quotes."""
    saved(tmp_path, ["m[1,2]"], [(0.0, 5.0)])
    assert list(Results.load(tmp_path)["m[1,2]"]) == [5.0]
    assert list(pd.read_csv(tmp_path / "results.csv").columns) == ["time", "m[1,2]"]


@pytest.mark.parametrize("cut", [1, 5, 12, 18])
def test_a_line_that_was_not_finished_is_left_out(tmp_path, cut):
    """Even one that has all its columns: the last number may lack digits."""
    saved(tmp_path, ["x"], [(0.0, 1.25), (1.0, 2.25), (2.0, 3.125456789012)])
    path = tmp_path / "results.csv"
    path.write_bytes(path.read_bytes()[:-cut])
    loaded = Results.load(tmp_path)
    assert list(loaded.time) == [0.0, 1.0]
    assert list(loaded["x"]) == [1.25, 2.25]


def test_a_run_without_a_point(tmp_path):
    saved(tmp_path, ["x"], [], status="failed")
    loaded = Results.load(tmp_path)
    assert (len(loaded), list(loaded.names()), loaded.completed) == (0, ["x"], False)


def test_the_record_comes_along(tmp_path):
    saved(tmp_path, ["x"], [(0.0, 1.0)], figures_wanted=[{"title": "Speed"}])
    loaded = Results.load(str(tmp_path))
    assert (loaded.units, loaded.parameters) == ({"train.speed": "m/s"}, {"train.mass": 4e5})
    assert (loaded.step, loaded.stop_time, loaded.completed, loaded.figures) == (0.1, 1.0, True, [{"title": "Speed"}])


@pytest.mark.parametrize("status", ["running", "failed", "interrupted"])
def test_only_a_completed_run_is_complete(tmp_path, status):
    saved(tmp_path, ["x"], [(0.0, 1.0)], status=status)
    assert Results.load(tmp_path).completed is False


def test_what_holds_no_run(tmp_path):
    def refusal():
        with pytest.raises(ScenarioError) as caught:
            Results.load(tmp_path)
        assert str(caught.value).startswith(f"{tmp_path} holds no run that can be read: ")
        return str(caught.value)

    assert "No such file or directory" in refusal()
    (tmp_path / "run.json").write_text("{}")
    assert "No such file or directory" in refusal()
    (tmp_path / "results.csv").write_text("time,x\n0.0,1.0\n")
    assert "it has no 'texts'" in refusal()
    (tmp_path / "run.json").write_text("{")
    assert "Expecting property name" in refusal()
    (tmp_path / "run.json").write_text(json.dumps(RECORD))
    (tmp_path / "results.csv").write_text("time,x\n0.0,many\n")
    assert "could not convert string to float: 'many'" in refusal()
    (tmp_path / "results.csv").write_text("")
    assert "it has no 'time'" in refusal()


def test_rows_reach_the_disk_while_the_run_goes(tmp_path, monkeypatch):
    """The header at once, the rest about every second."""
    now = [0.0]
    monkeypatch.setattr(module.clock, "monotonic", lambda: now[0])
    recorder, path = Recorder(["x"], tmp_path), tmp_path / "results.csv"
    assert path.read_text() == "time,x\n"
    for k, moment in enumerate([0.2, 0.9, 1.1, 1.5, 2.0, 2.2]):
        now[0] = moment
        recorder.record(float(k), [k / 2])
    lines = path.read_text().splitlines()
    assert lines == ["time,x", "0.0,0.0", "1.0,0.5", "2.0,1.0", "3.0,1.5", "4.0,2.0", "5.0,2.5"]
    now[0] = 2.3
    recorder.record(6.0, [3.0])
    assert path.read_text().splitlines() == lines
    recorder.close()
    assert path.read_text().splitlines() == [*lines, "6.0,3.0"]


def test_in_memory_only(tmp_path):
    recorder = Recorder(["x", "word"], None)
    recorder.record(0.0, [1.0, "a"])
    recorder.record(1.0, [2.0, "b"])
    recorder.close()
    time, columns = recorder.columns()
    assert (list(time), list(columns["x"]), list(columns["word"])) == ([0.0, 1.0], [1.0, 2.0], ["a", "b"])
    assert not list(tmp_path.iterdir())
