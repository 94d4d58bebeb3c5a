"""What a page is told of runs: signals, requirements, trains."""

import json

import numpy as np
import pytest
from railcosim.orchestrator import System, run
from railcosim.orchestrator.errors import ScenarioError
from railcosim.orchestrator.report.content import Columns


def test_one_run(directory, told):
    data, (content,) = told(directory)
    (one,) = data["runs"]
    assert (one["time"], one["points"]) == ({"first": 0.0, "last": 20.0}, 201)
    assert [signal["name"] for signal in data["signals"]] == list(content.results)
    assert one["trains"] == []
    assert one["gradients"] == []
    requirement = {each["name"]: each for each in one["requirements"]}["lower"]
    assert requirement["verdict"] == "fail"
    assert requirement["signals"] == ["lag[2].x"]
    assert requirement["margin"] < 0.0


def test_two_runs(wavy, tmp_path, told):
    run(wavy(), kind="native", output=tmp_path / "a", figures=False)
    run(wavy(stop_time=10.0), kind="native", output=tmp_path / "b", figures=False)
    data, _ = told(tmp_path / "a", tmp_path / "b")
    assert [one["points"] for one in data["runs"]] == [201, 101]
    assert all(len(signal["columns"]) == 2 for signal in data["signals"])
    assert [line["label"] for line in data["panels"][1]["lines"]] == ["0: lag[1] x", "1: lag[1] x"]


def test_trains(tmp_path, told):
    system = System(stop_time=2.0, step=0.1)
    system.add("train[1]", "PointMassTrain", force=1e5)
    system.add("train[2]", "SubwayTrain", force=1e5, trip=0, trip_time=0.0)
    system.add("consist", "Consist", force=1e4)
    run(system, kind="native", output=tmp_path / "run", figures=False)
    data, _ = told(tmp_path / "run")
    point, subway, consist = data["runs"][0]["trains"]
    assert (point["name"], point["position"], point["length"], point["tail"]) == (
        "train[1]",
        "train[1].position",
        0.0,
        None,
    )
    assert subway["length"] == pytest.approx(6 * 19.5)
    assert (consist["position"], consist["tail"]) == ("consist.position[1]", "consist.position[3]")


def test_texts_are_numbered(tmp_path):
    columns = Columns()
    place = columns.add(np.array(["go", "stop", "go"], dtype=object))
    assert columns.told[place]["words"] == ["go", "stop"]


def test_texts_and_whole_numbers_change_in_steps(mine, tmp_path, told):
    system = System(stop_time=1.0, step=0.1)
    system.add("word", mine("Word"))
    system.add("wave", mine("Wave"))
    run(system, kind="plain", output=tmp_path / "run", figures=False)
    data, _ = told(tmp_path / "run")
    assert [signal["name"] for signal in data["signals"] if signal.get("steps")] == ["word.word", "word.n"]


def test_equal_columns_are_packed_once():
    columns = Columns()
    numbers, words = np.array([0.0, 1.0, 0.0]), np.array(["go", "stop", "go"], dtype=object)
    assert [columns.add(x) for x in (numbers, numbers.astype(bool), words, numbers + 1.0, words)] == [0, 0, 1, 2, 1]
    assert len(columns.packed) == len(columns.told) == 3


def test_a_run_that_failed(wavy, mine, tmp_path, told):
    system = wavy()
    system.add("fails", mine("Fails"), until=5.0)
    with pytest.raises(Exception, match="fails"):
        run(system, kind="native", output=tmp_path / "run", figures=False)
    data, _ = told(tmp_path / "run")
    assert 40 < data["runs"][0]["points"] < 60
    assert len(data["panels"]) == 3
    assert data["runs"][0]["broke"] == pytest.approx(5.0, abs=0.1)


def test_a_run_without_a_point(directory, told):
    lines = (directory / "results.csv").read_text().splitlines()
    (directory / "results.csv").write_text(lines[0] + "\n")
    record = json.loads((directory / "run.json").read_text())
    del record["rows"]
    (directory / "run.json").write_text(json.dumps(record))
    data, _ = told(directory)
    assert data["runs"][0]["points"] == 0


def test_no_run(tmp_path, told):
    with pytest.raises(ScenarioError, match="holds no run that can be read"):
        told(tmp_path)


def test_verdicts_that_cannot_be_read(directory, told):
    (directory / "metrics.json").write_text("{")
    with pytest.raises(ScenarioError, match=r"metrics\.json cannot be read"):
        told(directory)
    (directory / "metrics.json").unlink()
    data, _ = told(directory)
    assert data["runs"][0]["requirements"] == []


def test_a_requirement_of_another_version(directory, told):
    path = directory / "metrics.json"
    found = json.loads(path.read_text())
    first, second, *_ = found["requirements"]
    first["text"] = "hereafter lag[1].x < 1"
    for one in (first, second):  # which does not tell what decided
        del one["blame"]
    path.write_text(json.dumps(found))
    data, _ = told(directory)
    assert [one["signals"] for one in data["runs"][0]["requirements"]] == [[], ["lag[1].x", "lag[2].x"]]
