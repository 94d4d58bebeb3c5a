"""Files for other tools, read with the readers of others: DyMat, pandas, FMPy, h5py, and our own to the bit."""

import json
from pathlib import Path

import DyMat
import fmpy.util
import h5py
import numpy as np
import pandas as pd
import pytest
from railcosim.orchestrator.cli.app import call
from railcosim.orchestrator.errors import ScenarioError
from railcosim.orchestrator.run import Results
from railcosim.orchestrator.run.recording.formats import table

TIME = np.array([0.0, 0.1, 0.2, 0.3, 0.7])
SPEED = np.array([1 / 3, -0.0, 5e-324, 1.7976931348623157e308, np.pi])
FORCE = np.array([1.0, 2.0, 3.0, 4.0, 5.0])


@pytest.fixture
def results(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(table, "ROWS", 2)  # three blocks
    return made({"train[1].speed": SPEED, "train[1].force": FORCE})


def made(columns, time=TIME):
    return Results(
        columns,
        time,
        units={"train[1].speed": "m/s", "train[1].mass": "kg"},
        parameters={"train[1].mass": 4e5, "train[1].on": True, "line.name": "x"},
        step=0.1,
        stop_time=0.7,
        completed=True,
    )


@pytest.mark.parametrize("name", ["a.csv", "a.parquet", "a.h5", "a.mat", "A.MTSF"])
def test_numbers_survive_to_the_bit(results, name, tmp_path):
    assert results.save(name) == []
    found = Results.load(name)
    for key, values in {"train[1].speed": SPEED, "train[1].force": FORCE}.items():
        assert found[key].tobytes() == values.tobytes()
    assert found.time.tobytes() == TIME.tobytes()
    assert found.units.get("train[1].speed") == (None if name == "a.csv" else "m/s")
    assert [path.name for path in tmp_path.iterdir()] == [name]


def test_dymat_reads_a_trajectory(results):
    results.save("a.mat")
    found = DyMat.DyMatFile("a.mat")
    assert found["train[1].speed"].tolist() == SPEED.tolist()
    assert found.abscissa("train[1].speed", valuesOnly=True).tolist() == TIME.tolist()
    assert found.description("train[1].speed") == "[m/s]"
    assert found["train[1].mass"].tolist() == [4e5, 4e5]
    assert found["train[1].on"].tolist() == [1.0, 1.0]
    assert found.abscissa("train[1].mass", valuesOnly=True).tolist() == [0.0, 0.7]


def test_pandas_and_fmpy_read_theirs(results):
    results.save("a.parquet")
    results.save("a.csv")
    for frame in (pd.read_parquet("a.parquet"), pd.read_csv("a.csv")):
        assert frame["train[1].speed"].tolist() == SPEED.tolist()
    assert fmpy.util.read_csv("a.csv")["train[1].speed"].tolist() == SPEED.tolist()


def test_an_mtsf_has_what_the_proposal_asks_for(results):
    results.save("a.h5")
    with h5py.File("a.h5") as file:
        variables = file["ModelDescription/Variables"][:, 0]
        at = list(variables["name"]).index(b"train[1].force")
        data = file[variables["objectId"][at]]
        assert data[:, variables["column"][at]].tolist() == FORCE.tolist()
        over = variables[data.parent.attrs["independentVariableRow"]]
        assert (over["name"], file[over["objectId"]][:, over["column"]].tolist()) == (b"time", TIME.tolist())
        mass = variables[list(variables["name"]).index(b"train[1].mass")]
        kind = file["ModelDescription/SimpleTypes"][mass["simpleTypeRow"], 0]
        assert file["ModelDescription/Units"][kind["unitOrEnumerationRow"], 0]["name"] == b"kg"


def test_texts_go_where_there_is_a_place_for_them(results):
    told = made({"line.sign": np.array(["a,b", "c", "c", "a,b", "d"], object), "v": SPEED})
    for name in ("a.csv", "a.parquet"):
        assert told.save(name) == []
        assert Results.load(name)["line.sign"].tolist() == ["a,b", "c", "c", "a,b", "d"]
    for name in ("a.mat", "a.h5"):
        assert told.save(name) == ["line.sign"]
        assert [key for key in Results.load(name) if not key.startswith("train")] == ["v"]


def test_what_cannot_be_written(results, tmp_path):
    with pytest.raises(ScenarioError, match=r"a\.xls cannot be written as results: the endings are \.csv"):
        results.save("a.xls")
    with pytest.raises(ScenarioError, match="there are no points"):
        made({"v": np.empty(0)}, np.empty(0)).save("a.csv")
    with pytest.raises(OSError, match="nowhere"):
        results.save("nowhere/a.mat")
    assert not [*tmp_path.iterdir()]


def test_a_run_saves_them_as_well(results, components, capsys):
    held = "class Held(Component):\n    y = Output()\n    def outputs(self):\n        return {'y': 7.0}"
    text = f'title = "t"\n[simulation]\nstop_time = 0.3\n[instances.a]\ncomponent = "{components(held)("Held")}"\n'
    Path("a.toml").write_text(text)
    run = ["run", "a.toml", "--kind", "plain", "--no-figures", "-q", "-o", "out", "--save"]
    assert call([*run, "a.mat", "--save", "a.h5"]) == 0
    assert DyMat.DyMatFile("a.mat")["a.y"].tolist() == Results.load("a.h5")["a.y"].tolist() == [7.0] * 4
    assert call([*run, "a.xls"]) == 2
    assert "a.xls cannot be written" in capsys.readouterr().err


def test_the_command(results, capsys):
    made({"line.sign": np.array(["a"] * 5, object), "v": SPEED}).save("a.csv")
    assert call(["convert", "a.csv", "a.mat", "a.parquet"]) == 0
    told = capsys.readouterr()
    assert told.out == "a.mat\na.parquet\n"
    assert told.err == "a.mat has no place for the texts of line.sign\n"
    assert call(["convert", "a.parquet", "b.csv", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["result"] == {"files": ["b.csv"]}
    assert (pd.read_csv("a.csv") == pd.read_csv("b.csv")).all(axis=None)
