"""Result files as other tools write them: the values are those that the tools' own readers find."""

import sys

import DyMat
import h5py
import numpy as np
import pandas as pd
import pytest
from railcosim.orchestrator.errors import RailcosimError, ScenarioError
from railcosim.orchestrator.run import Results
from railcosim.orchestrator.run.recording.formats import read_file
from railcosim.orchestrator.run.recording.formats.table import time_among
from scipy.io import savemat

TIME = np.array([0.0, 0.5, 1.0])
SPEED = np.array([1.0, 1 / 3, -2.0])


def written(path, text):
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    "text",
    [
        '"time","a[1,2].v"\n0,1\n0.5,0.25\n',
        'Time;"a[1,2].v"\r\n0,0;1,0\r\n0,5;0,25\r\n',
        'time [s]\t"a[1,2].v"\n0\ttrue\n0.5\t0.25\n',
        't,"a[1,2].v",\n0,1,\n0.5,0.25,\n0.75,0.',
    ],
)
def test_csv_of_all_sorts(tmp_path, text):
    found = read_file(written(tmp_path / "a.csv", text)).columns
    assert list(found) == ["time", "a[1,2].v"]
    assert found["time"].tolist() == [0.0, 0.5]
    assert found["a[1,2].v"].tolist() == [1.0, 0.25]


def test_a_file_is_results_with_the_step_between_its_points(tmp_path):
    found = Results.load(written(tmp_path / "a.csv", "x,clock\n0,red\n0.5,green\n1.0,red\n"))
    assert found["clock"].tolist() == ["red", "green", "red"]
    assert (found.step, found.stop_time, found.points, found.completed) == (0.5, 1.0, 3, True)
    assert Results.load(written(tmp_path / "b.csv", "time,x\n2,7\n")).step == 0.0


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "no names"),
        ("time,x\n", "no points"),
        ("time,x,x\n0,1,2\n", "two of its columns are called x"),
        ("name,x\nred,1\n", "no time"),
    ],
)
def test_csv_that_is_none(tmp_path, text, why):
    with pytest.raises(ScenarioError, match=why):
        read_file(written(tmp_path / "a.csv", text))


def test_a_file_that_is_not_there_or_has_another_ending(tmp_path):
    with pytest.raises(ScenarioError, match=r"a\.csv cannot be read as results: No such file"):
        Results.load(tmp_path / "a.csv")
    with pytest.raises(ScenarioError, match=r"the endings are \.csv"):
        read_file(tmp_path / "a.xls")


def test_parquet_of_pandas_and_units(tmp_path):
    pd.DataFrame({"Time": TIME, "v": SPEED, "on": [True, False, True]}).to_parquet(tmp_path / "a.parquet")
    found = read_file(tmp_path / "a.parquet")
    assert found.columns["v"].tolist() == SPEED.tolist()
    assert found.columns["on"].tolist() == [1, 0, 1]
    assert found.units == {}


# ------------------------------------------------------------------ Dymola, OpenModelica


def letters(texts, turned):
    width = max(map(len, texts))
    table = np.array([list(text.ljust(width)) for text in texts])
    return np.ascontiguousarray(table.T) if turned else table


def trajectory(path, layout):
    """What the manuals of both tools describe: an alias with a sign, and a parameter over begin and end."""
    turned = layout == "binTrans"
    about = [[0, 1, 0, -1], [2, 2, 0, 0], [2, -2, 0, 0], [1, 2, 0, 0]]
    told, constant, moving = np.array(about), np.array([[0.0, 1.0], [7.0, 7.0]]), np.array([TIME, SPEED])
    savemat(
        path,
        {
            "Aclass": letters(["Atrajectory", "1.1", "", layout], False),
            "name": letters(["Time", "train.v", "train.w", "train.mass"], turned),
            "description": letters(["Time in [s]", "speed [m/s|km/h]", "back", "of it [kg]"], turned),
            "dataInfo": (told.T if turned else told).astype(np.int32),
            "data_1": constant if turned else constant.T,
            "data_2": moving if turned else moving.T,
        },
        format="4",
    )
    return path


@pytest.mark.parametrize("layout", ["binTrans", "binNormal"])
def test_a_trajectory_is_what_dymat_finds(tmp_path, layout):
    path = trajectory(tmp_path / "a.mat", layout)
    found, known = read_file(path), DyMat.DyMatFile(str(path))
    assert found.columns["time"].tolist() == TIME.tolist()
    assert found.columns["train.v"].tolist() == known["train.v"].tolist() == SPEED.tolist()
    assert found.columns["train.w"].tolist() == known["train.w"].tolist() == (-SPEED).tolist()
    assert found.columns["train.mass"].tolist() == [7.0] * 3
    assert known["train.mass"].tolist() == [7.0] * 2
    assert found.units == {"Time": "s", "train.v": "m/s", "train.mass": "kg"}


def test_a_trajectory_of_the_first_version(tmp_path):
    about = {"Aclass": letters(["Atrajectory", "1.0"], False), "names": letters(["Time", "v\xe4"], False)}
    savemat(tmp_path / "a.mat", {**about, "data": np.array([TIME, SPEED]).T}, format="4")
    assert read_file(tmp_path / "a.mat").columns["v\xe4"].tolist() == SPEED.tolist()


def test_other_files_of_matlab(tmp_path):
    savemat(tmp_path / "a.mat", {"x": SPEED})
    with pytest.raises(ScenarioError, match="no trajectory"):
        read_file(tmp_path / "a.mat")
    (tmp_path / "b.mat").write_bytes(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM" + bytes(64))
    with pytest.raises(ScenarioError, match=r"b\.mat cannot be read"):
        read_file(tmp_path / "b.mat")
    (tmp_path / "c.mat").write_bytes(bytes(3))
    with pytest.raises(ScenarioError, match=r"c\.mat cannot be read"):
        read_file(tmp_path / "c.mat")


# ------------------------------------------------------------------ HDF5


def mtsf(path, time="Time", typed=True):
    """As the proposal of Pfeiffer, Bausch-Gall and Otter has it."""
    with h5py.File(path, "w") as file:
        data = file.create_dataset("Results/Series_1/H5T_NATIVE_DOUBLE", data=np.array([TIME, SPEED]).T)
        fixed = file.create_dataset("Results/Fixed/H5T_NATIVE_DOUBLE", data=np.array([[7.0]]))
        other = file.create_dataset("Results/Series_2/H5T_NATIVE_DOUBLE", data=np.array([[0.0], [9.0]]))
        kinds = [
            ("name", "S9"),
            ("simpleTypeRow", "u4"),
            ("objectId", h5py.ref_dtype),
            ("column", "u4"),
            ("negated", "u1"),
        ]
        rows = [
            (time.encode(), 0, data.ref, 0, 0),
            (b"v", 1, data.ref, 1, 0),
            (b"w", 9, data.ref, 1, 1),
            (b"mass", 2, fixed.ref, 0, 0),
            (b"clocked", 1, other.ref, 0, 0),
        ]
        file["ModelDescription/Variables"] = np.array(rows, dtype=kinds).reshape(-1, 1)
        if typed:
            file["ModelDescription/SimpleTypes"] = np.array([(0,), (1,), (-1,)], dtype=[("unitOrEnumerationRow", "i4")])
            file["ModelDescription/Units"] = np.array([(b"s",), (b"m/s",)], dtype=[("name", "S5")])
    return path


def test_mtsf(tmp_path):
    found = read_file(mtsf(tmp_path / "a.h5"))
    assert list(found.columns) == ["time", "v", "w", "mass"]
    assert found.columns["w"].tolist() == (-SPEED).tolist()
    assert found.columns["mass"].tolist() == [7.0] * 3
    assert found.units["v"] == "m/s"
    assert found.units["w"] == found.units["mass"] == ""
    assert read_file(mtsf(tmp_path / "b.mtsf", typed=False)).units["v"] == ""
    with pytest.raises(ScenarioError, match="no variable is its time"):
        read_file(mtsf(tmp_path / "c.h5", time="x"))


def test_datasets_beside_a_time(tmp_path):
    with h5py.File(tmp_path / "a.hdf5", "w") as file:
        file["time"], file["train/v"] = TIME, SPEED
        file["table"], file["train/name"], file["short"] = np.ones((3, 3)), b"x", [1.0]
    found = read_file(tmp_path / "a.hdf5").columns
    assert list(found) == ["time", "train.v"]
    with h5py.File(tmp_path / "b.h5", "w") as file:
        file["v"] = SPEED
    with pytest.raises(ScenarioError, match="none of its datasets is called time"):
        read_file(tmp_path / "b.h5")


def test_what_is_called_time():
    assert time_among(["t", "x.time", "Time (s)"]) == "Time (s)"
    assert time_among(["x", "t [s]"]) == "t [s]"
    assert time_among(["x"]) is None


@pytest.mark.parametrize(("name", "library"), [("a.h5", "h5py"), ("a.parquet", "pyarrow")])
def test_a_library_that_is_not_there(tmp_path, monkeypatch, name, library):
    monkeypatch.setitem(sys.modules, library, None)
    with pytest.raises(RailcosimError, match=rf"{name}: such a file is for {library}, .* 'railcosim\[files\]'"):
        read_file(tmp_path / name)
