"""What a page is told of runs: signals, panels, bands, requirements, trains."""

import json

import numpy as np
import pytest
from railcosim.orchestrator import System, run
from railcosim.orchestrator.errors import ScenarioError
from railcosim.orchestrator.report.content import Columns, _bands, read_content, shown
from railcosim.orchestrator.report.trains import gradients_of
from railcosim.orchestrator.system import Event


def told(*directories):
    columns = Columns()
    contents = [read_content(directory, columns) for directory in directories]
    return shown(contents, [str(k) for k in range(len(contents))], columns), contents


def test_one_run(directory):
    data, (content,) = told(directory)
    (one,) = data["runs"]
    assert (one["time"], one["points"]) == ({"first": 0.0, "last": 20.0}, 201)
    assert [signal["name"] for signal in data["signals"]] == list(content.results)
    assert one["trains"] == []
    assert one["gradients"] == []
    requirement = {each["name"]: each for each in one["requirements"]}["lower"]
    assert requirement["verdict"] == "fail"
    assert requirement["signals"] == ["lag[2].x"]
    assert data["columns"][0]["points"] == 201


def test_panels_over_time_show_signals_by_their_own_columns(directory):
    data, (content,) = told(directory)
    both, scaled = data["panels"]  # the third figure is not over time
    assert both["title"] == "Both </script>"
    names = ["lag[1].x", "lag[2].x", "wave.y"]
    assert [line["column"] for line in both["lines"][:3]] == [content.places[name] for name in names]
    assert both["lines"][3]["column"] not in content.places.values()
    assert scaled["title"].startswith("twice, up to 0.")
    assert scaled["label"] == "2 x"
    assert scaled["lines"][0]["column"] not in content.places.values()


def test_two_runs(wavy, tmp_path):
    run(wavy(), kind="native", output=tmp_path / "a", figures=False)
    run(wavy(stop_time=10.0), kind="native", output=tmp_path / "b", figures=False)
    data, _ = told(tmp_path / "a", tmp_path / "b")
    assert [one["points"] for one in data["runs"]] == [201, 101]
    assert all(len(signal["columns"]) == 2 for signal in data["signals"])
    assert [line["label"] for line in data["panels"][1]["lines"]] == ["0: lag[1] x", "1: lag[1] x"]


def test_events_are_bands(wavy, tmp_path):
    system = wavy()
    system.events += [
        Event("wave.y", "bias", 2.0, value=0.1, duration=3.0),
        Event("wave.y", "override", 18.0, value=0.0),
        Event("lag[1].u", "freeze", 1.0, duration=0.5, every=6.0),
    ]
    run(system, kind="native", output=tmp_path / "run", figures=False)
    data, _ = told(tmp_path / "run")
    bands = [(band["from"], band["until"], band["label"]) for band in data["runs"][0]["bands"]]
    assert bands[:2] == [(2.0, 5.0, "bias wave.y"), (18.0, 20.0, "override wave.y")]
    assert [begin for begin, *_ in bands[2:]] == [1.0, 7.0, 13.0, 19.0]


def test_what_models_were_built_with_is_shown():
    """Faults and outages as bands, gradients under the trains."""
    record = {
        "stop_time": 100.0,
        "instances": {
            "faults": {
                "build": {"schedule": [{"carriage": 1, "from": 10.0, "until": 20.0}, {"from": 200.0, "until": 300}]}
            },
            "radio": {"build": {"outages": [[60.0, 72.0]], "messages": 16}},
            "line": {"build": {"line": [{"position": 0.0}, {"position": 500.0, "gradient": 0.01}]}},
        },
    }
    bands = [(band["from"], band["until"], band["label"]) for band in _bands(record)]
    assert bands == [(10.0, 20.0, "faults: schedule"), (60.0, 72.0, "radio: outages")]
    steps = [{"from": 0.0, "gradient": 0.0}, {"from": 500.0, "gradient": 0.01}]
    assert gradients_of(record) == steps
    line = record["instances"]["line"]["build"]
    line["line"] = {"name": "a line with more than sections", "sections": line["line"]}
    assert gradients_of(record) == steps


def test_trains(tmp_path):
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


def test_texts_change_in_steps(mine, tmp_path):
    system = System(stop_time=1.0, step=0.1)
    system.add("word", mine("Word"))
    system.add("wave", mine("Wave"))
    run(system, kind="plain", output=tmp_path / "run", figures=False)
    data, _ = told(tmp_path / "run")
    assert [signal["name"] for signal in data["signals"] if signal.get("steps")] == ["word.word"]


def test_equal_columns_are_packed_once():
    columns = Columns()
    numbers, words = np.array([0.0, 1.0, 0.0]), np.array(["go", "stop", "go"], dtype=object)
    assert [columns.add(x) for x in (numbers, numbers.astype(bool), words, numbers + 1.0, words)] == [0, 0, 1, 2, 1]
    assert len(columns.packed) == len(columns.told) == 3


def test_a_run_that_failed(wavy, mine, tmp_path):
    system = wavy()
    system.add("fails", mine("Fails"), until=5.0)
    with pytest.raises(Exception, match="fails"):
        run(system, kind="native", output=tmp_path / "run", figures=False)
    data, _ = told(tmp_path / "run")
    assert 40 < data["runs"][0]["points"] < 60
    assert len(data["panels"]) == 2


def test_figures_of_signals_that_are_not_there(directory):
    """A run that was swapped or cut short may lack them; a page shows the rest."""
    path = directory / "run.json"
    record = json.loads(path.read_text())
    first, second, _ = record["figures_wanted"]
    first["y"] = ["missing.x"]
    second["panels"][0]["title"] = "up to {missing.x}"
    path.write_text(json.dumps(record))
    data, _ = told(directory)
    assert [panel["title"] for panel in data["panels"]] == ["up to {missing.x}"]


def test_a_run_without_a_point(directory):
    lines = (directory / "results.csv").read_text().splitlines()
    (directory / "results.csv").write_text(lines[0] + "\n")
    record = json.loads((directory / "run.json").read_text())
    del record["rows"]
    (directory / "run.json").write_text(json.dumps(record))
    data, _ = told(directory)
    assert data["runs"][0]["points"] == 0


def test_no_run(tmp_path):
    with pytest.raises(ScenarioError, match="holds no run that can be read"):
        told(tmp_path)


def test_verdicts_that_cannot_be_read(directory):
    (directory / "metrics.json").write_text("{")
    with pytest.raises(ScenarioError, match=r"metrics\.json cannot be read"):
        told(directory)
    (directory / "metrics.json").unlink()
    data, _ = told(directory)
    assert data["runs"][0]["requirements"] == []


def test_a_requirement_of_another_version(directory):
    path = directory / "metrics.json"
    found = json.loads(path.read_text())
    found["requirements"][0]["text"] = "hereafter lag[1].x < 1"
    path.write_text(json.dumps(found))
    data, _ = told(directory)
    assert data["runs"][0]["requirements"][0]["signals"] == []
