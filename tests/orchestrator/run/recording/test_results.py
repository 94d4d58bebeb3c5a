"""Recorded signals survive the way to the disk and back exactly, whatever happened to the run."""

import json
import math
from collections.abc import Mapping

import fmpy.util
import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from railcosim.orchestrator import world
from railcosim.orchestrator.errors import ScenarioError, SignalError
from railcosim.orchestrator.run.recording import ROWS_FILE, Due, Recorder, Results, finish_rows, recover_rows

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


def recorded(directory, names, rows, kinds=None):
    """A recorder that has seen these rows, some one by one and the rest in an array, if they are all numbers."""
    kinds = kinds or ["Real"] * len(names)
    recorder = Recorder(names, kinds, directory and directory / ROWS_FILE)
    single = len(rows) if "String" in kinds else len(rows) // 2
    for row in rows[:single]:
        recorder.extend([row])
    if rows[single:]:
        recorder.extend(np.array(rows[single:], dtype=float))
    return recorder


def saved(directory, names, rows, kinds=None, **record):
    recorder = recorded(directory, names, rows, kinds)
    recorder.close()
    columns = recorder.columns()
    finish_rows(directory)
    (directory / "run.json").write_text(json.dumps(RECORD | record))
    return columns


def test_numbers_survive_exactly(tmp_path):
    rows = [(k * 0.1, value, k, k % 2) for k, value in enumerate(AWKWARD)]
    kinds = ["Real", "Integer", "Boolean"]
    columns = saved(tmp_path, ["train.speed", "train.gear", "train.on"], rows, kinds)
    loaded = Results.load(tmp_path)
    assert np.array_equal(loaded.time, columns["time"])
    assert list(loaded.time) == [k * 0.1 for k in range(len(AWKWARD))]
    assert list(loaded.names()) == ["train.speed", "train.gear", "train.on"]
    for name in loaded:
        assert np.array_equal(loaded[name], columns[name])
        assert loaded[name].dtype == columns[name].dtype == np.float64
    assert list(loaded["train.speed"]) == AWKWARD
    assert math.copysign(1.0, loaded["train.speed"][2]) == -1.0


@given(st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=1, max_size=30))
def test_any_number_survives(tmp_path_factory, values):
    directory = tmp_path_factory.mktemp("any")
    saved(directory, ["x"], [(float(k), v) for k, v in enumerate(values)])
    assert list(Results.load(directory)["x"]) == values


TEXTS = ["plain", "12", "", 'say "no", twice', "two\nlines", "3.5e7", "naïve", "nan", '"q"', "a\rb\r\n", " x "]


def test_texts_survive_even_where_they_look_like_numbers(tmp_path):
    rows = [(float(k), text, 1.5 * k) for k, text in enumerate(TEXTS)]
    columns = saved(tmp_path, ["a.word", "a.x"], rows, ["String", "Real"], texts=["a.word"])
    loaded = Results.load(tmp_path)
    assert list(loaded["a.word"]) == list(columns["a.word"]) == TEXTS
    assert loaded["a.word"].dtype == columns["a.word"].dtype == object
    assert list(loaded["a.x"]) == [1.5 * k for k in range(len(TEXTS))]


def test_a_text_that_is_a_number_throughout_stays_a_text(tmp_path):
    saved(tmp_path, ["a.word"], [(0.0, "1"), (1.0, "2")], ["String"], texts=["a.word"])
    assert list(Results.load(tmp_path)["a.word"]) == ["1", "2"]


def test_other_programs_read_the_file(tmp_path):
    rows = [(k * 0.1, v, 7) for k, v in enumerate(AWKWARD)]
    saved(tmp_path, ["train[1].speed", "row[2]"], rows, ["Real", "Enumeration"])
    path = tmp_path / "results.csv"
    assert path.read_text().splitlines()[1] == "0.0,0.1,7", "a whole number is written as one"
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


@given(st.lists(st.text("ab'\"[],.;= \t\r\n\\", min_size=1, max_size=8), min_size=1, max_size=5, unique=True))
def test_any_name_survives(tmp_path_factory, names):
    directory = tmp_path_factory.mktemp("names")
    names = [f"a.{name}" for name in names]
    saved(directory, names, [(0.0, *range(len(names)))])
    loaded = Results.load(directory)
    assert list(loaded.names()) == names
    assert [loaded[name][0] for name in names] == list(range(len(names)))


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
    assert (len(loaded.time), list(loaded.names()), loaded.completed) == (0, ["x"], False)


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
    assert "it has no 'texts'" in refusal()
    (tmp_path / "run.json").write_text(json.dumps(RECORD))
    assert "No such file or directory" in refusal()
    for broken in (b"", b"[1", b"[]\n", b"{}\n", b'{"columns": [], "whole": []}\n'):
        (tmp_path / "results.bin").write_bytes(broken)
        refusal()
    (tmp_path / "results.bin").unlink()
    (tmp_path / "run.json").write_text("{")
    assert "Expecting property name" in refusal()
    (tmp_path / "run.json").write_text(json.dumps(RECORD))
    (tmp_path / "results.csv").write_text("time,x\n0.0,many\n")
    assert "could not convert string 'many' to float64" in refusal()
    (tmp_path / "results.csv").write_text("")
    assert "it has no 'time'" in refusal()
    (tmp_path / "run.json").write_text("[" * 100_000)
    refusal()


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("units", []),
        ("units", {"x": 3}),
        ("parameters", {"x": [1.0]}),
        ("step", "0.1"),
        ("stop_time", None),
        ("figures_wanted", {}),
        ("figures_wanted", ["speed"]),
    ],
)
def test_a_record_that_somebody_has_edited(tmp_path, key, value):
    saved(tmp_path, ["x"], [(0.0, 1.0)])
    assert len(Results.load(tmp_path).time) == 1
    (tmp_path / "run.json").write_text(json.dumps(RECORD | {key: value}))
    with pytest.raises(ScenarioError, match=f"its {key} in run.json is not what a run writes there"):
        Results.load(tmp_path)


@pytest.fixture
def now(monkeypatch):
    """A clock to set."""
    now = [0.0]
    monkeypatch.setattr(world, "monotonic", lambda: now[0])
    return now


def test_rows_reach_the_disk_while_the_run_goes(tmp_path, now):
    """The names at once, the rest about every second; as text only when the run has ended."""
    (tmp_path / "run.json").write_text(json.dumps(RECORD | {"status": "running"}))
    recorder = Recorder(["x", "gear"], ["Real", "Integer"], tmp_path / ROWS_FILE)
    assert list(Results.load(tmp_path).names()) == ["x", "gear"]
    assert len(Results.load(tmp_path).time) == 0
    for k, moment in enumerate([0.2, 0.9, 1.1, 1.5, 2.0, 2.2]):
        now[0] = moment
        rows = [[float(k), k / 2, k]]
        recorder.extend(rows if k % 2 else np.array(rows, dtype=float))
    assert list(Results.load(tmp_path)["x"]) == [0.0, 0.5, 1.0, 1.5, 2.0, 2.5]
    now[0] = 2.3
    recorder.extend([[6.0, 3.0, 6]])
    assert len(Results.load(tmp_path).time) == 6
    recorder.close()
    finish_rows(tmp_path)
    assert (tmp_path / "results.csv").read_text().splitlines()[-2:] == ["5.0,2.5,5", "6.0,3.0,6"]
    assert sorted(p.name for p in tmp_path.iterdir()) == ["results.csv", "run.json"]


def test_texts_reach_the_disk_as_well(tmp_path, now):
    (tmp_path / "run.json").write_text(json.dumps(RECORD | {"status": "running", "texts": ["word"]}))
    (tmp_path / "results.bin").write_text("of an earlier run")
    recorder, path = Recorder(["x", "word"], ["Real", "String"], tmp_path / ROWS_FILE), tmp_path / "results.csv"
    assert list(Results.load(tmp_path)["word"]) == []
    now[0] = 1.1
    recorder.extend([[0.0, 0.5, "so, so"]])
    assert list(Results.load(tmp_path)["word"]) == ["so, so"]
    recorder.extend([[1.0, 1.5, "b"], [2.0, 2.5, "so, so"]])
    recorder.close()
    finish_rows(tmp_path)
    assert path.read_text() == 'time,x,word\n0.0,0.5,"so, so"\n1.0,1.5,b\n2.0,2.5,"so, so"\n'
    assert sorted(p.name for p in tmp_path.iterdir()) == ["results.csv", "run.json"]


@pytest.mark.parametrize("cut", [0, 1, 8, 23, 24])
def test_a_killed_run_is_read_up_to_its_last_whole_row(tmp_path, cut):
    """And made into text on request."""
    rows = [(float(k), value, k % 2) for k, value in enumerate(AWKWARD)]
    recorder = recorded(tmp_path, ["x", "on"], rows, ["Real", "Boolean"])
    recorder.flush()
    recorder._writer._file.close()  # as the end of its process does
    (tmp_path / "run.json").write_text(json.dumps(RECORD | {"status": "running"}))
    path = tmp_path / "results.bin"
    path.write_bytes(path.read_bytes()[: -cut or None])
    left = len(rows) - (cut > 0)
    loaded = Results.load(tmp_path)
    assert list(loaded.time) == [row[0] for row in rows[:left]]
    assert list(loaded["x"]) == AWKWARD[:left]
    assert not loaded.completed
    assert recover_rows(tmp_path) == tmp_path / "results.csv"
    path.unlink()  # it is kept: the run may still go on
    assert (tmp_path / "results.csv").read_text().splitlines()[2] == f"1.0,{AWKWARD[1]!r},1"
    again = Results.load(tmp_path)
    assert list(again.names()) == ["x", "on"]
    assert all(np.array_equal(again[name], loaded[name]) for name in again.names())


def test_text_is_complete_or_not_there(tmp_path, monkeypatch):
    """A run that is killed while its text is written leaves the numbers."""
    recorder = recorded(tmp_path, ["x"], [(0.0, 1.5), (1.0, 2.5)])
    (tmp_path / "run.json").write_text(json.dumps(RECORD))
    monkeypatch.setattr(world, "replace", lambda *_: (_ for _ in ()).throw(KeyboardInterrupt))
    recorder.close()
    with pytest.raises(KeyboardInterrupt):
        finish_rows(tmp_path)
    assert not (tmp_path / "results.csv").exists()
    assert list(Results.load(tmp_path)["x"]) == [1.5, 2.5]


def test_in_memory_only(tmp_path):
    recorder = recorded(None, ["x", "word"], [(0.0, 1.0, "a"), (1.0, 2.0, "b")], ["Real", "String"])
    recorder.close()
    columns = recorder.columns()
    assert (list(columns["time"]), list(columns["x"]), list(columns["word"])) == ([0.0, 1.0], [1.0, 2.0], ["a", "b"])
    assert not list(tmp_path.iterdir())


def test_single_rows_and_blocks_keep_their_sequence():
    recorder = Recorder(["x"], ["Real"], None)
    for part in ([[0.0, 1.0]], np.array([[1.0, 2.0], [2.0, 3.0]]), [], np.empty((0, 2)), [[3.0, 4.0]], [[4.0, 5.0]]):
        recorder.extend(part)
    columns = recorder.columns()
    assert (list(columns["time"]), list(columns["x"])) == ([0, 1, 2, 3, 4], [1, 2, 3, 4, 5])
    assert Recorder(["x"], ["Real"], None).columns()["time"].shape == (0,)


def results(*names, **how):
    columns = {name: np.arange(3.0) for name in names}
    parameters = {"train[1].mass": 4e5, "train[2].mass": 4e5}
    facts = {"units": {}, "parameters": parameters, "step": 0.1, "stop_time": 1.0, "completed": True}
    return Results(columns, np.arange(3.0), **facts | how)


TRAINS = [f"train[{i}].{name}" for i in range(1, 5) for name in ("position", "speed")]
NAMES = [*TRAINS, "consist.force[1]", "consist.force[2]", "target.value"]


def test_results_are_a_mapping():
    found = results(*NAMES)
    assert isinstance(found, Mapping)
    assert list(found) == list(found.keys()) == list(found.names()) == NAMES
    assert len(found) == len(dict(found)) == len(NAMES)
    assert "target.value" in found
    assert "train.speed" not in found
    assert list(found.values())[2] is found[NAMES[2]]
    assert found.get("train.speed") is None
    assert pd.DataFrame(dict(found), index=found.time).shape == (3, len(NAMES))
    assert found == found  # noqa: PLR0124
    assert found != results(*NAMES)
    assert len({found, results()}) == 2


@pytest.mark.parametrize(
    ("name", "told"),
    [
        (
            "train.speed",
            "there is no signal 'train.speed'; one of each instance: train[1].speed, train[2].speed, train[3].speed, "
            "train[4].speed",
        ),
        ("consist.force", "there is no signal 'consist.force'; its elements are: consist.force[1], consist.force[2]"),
        ("train[2].sped", "there is no signal 'train[2].sped'; did you mean 'train[2].speed'?"),
        ("train.sped", "there is no signal 'train.sped'; did you mean 'train.speed'?"),
        ("train[5].speed", "there is no signal 'train[5].speed'; did you mean 'train[4].speed'?"),
        (
            "train[1].mass",
            "there is no signal 'train[1].mass': that is a parameter, whose value stands in parameters",
        ),
        ("train[1].x", "there is no signal 'train[1].x'; train[1] has train[1].position, train[1].speed"),
        ("target", "there is no signal 'target'; target has target.value"),
        (
            "q",
            "there is no signal 'q'; there are train[1].position, train[1].speed, train[2].position, train[2].speed, "
            "train[3].position, train[3].speed and 5 more",
        ),
        (3, "a signal is asked for by its name, not by 3"),
        (["a"], "a signal is asked for by its name, not by ['a']"),
    ],
)
def test_who_asks_for_what_is_not_there_is_told_what_is(name, told):
    with pytest.raises(SignalError) as caught:
        results(*NAMES)[name]
    assert str(caught.value) == told
    assert isinstance(caught.value, KeyError)


def test_the_representation_of_results():
    assert repr(results(*NAMES)) == (
        "<Results of 11 signals at 3 points from 0 to 2 s: train[i].position, train[i].speed, consist.force[i], "
        "target.value>"
    )
    many = results(*(f"thing{k}.x" for k in range(5000)))
    assert len(repr(many)) < 200


@pytest.mark.parametrize("every", [1, 2, 3, 7, 20])
@pytest.mark.parametrize("sizes", [[1] * 17, [17], [1, 5, 4, 7], [2, 2, 13]])
@pytest.mark.parametrize("array", [True, False])
def test_what_is_due_of_blocks_of_any_size(every, sizes, array):
    """Every so many points and the last, which is number 17."""
    due, done, kept = Due(every, 17), 0, []
    for size in sizes:
        rows = [[float(k), -k] for k in range(done + 1, done + size + 1)]
        done += size
        kept += [row[0] for row in due.of(done, np.array(rows) if array else rows)]
    assert kept == [k for k in range(1, 18) if k % every == 0 or k == 17]


def test_of_no_rows_none_is_due():
    assert len(Due(3, 17).of(6, ())) == 0
