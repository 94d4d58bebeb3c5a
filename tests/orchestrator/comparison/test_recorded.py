"""Recorded results against a reference: which signals, which tubes, what is told, the exit code."""

import csv
import json

import numpy as np
import pandas as pd
import pytest
from matplotlib.image import imread
from railcosim.orchestrator.cli.app import call
from railcosim.orchestrator.comparison import compare_recorded, is_recorded
from railcosim.orchestrator.errors import ScenarioError

TIME = np.linspace(0.0, 10.0, 101)


@pytest.fixture
def files(tmp_path, monkeypatch):
    """Writes files: name, then signals, and the time."""
    monkeypatch.chdir(tmp_path)

    def write(name, time=TIME, **signals):
        frame = pd.DataFrame({"time": time, **{key.replace("_", "."): values for key, values in signals.items()}})
        frame.to_parquet(name) if name.endswith("parquet") else frame.to_csv(name, index=False)
        return name

    write("a.csv", train_speed=TIME, train_force=np.full(101, 7.0), line_name=["x"] * 101, own=TIME)
    return write


def test_the_tube_is_a_part_of_range_and_duration(files):
    late = TIME + 0.035 * (TIME < 10.0)
    files("b.parquet", train_speed=late, train_force=np.full(101, 7.0 + 1e-6), line_name=["x"] * 101, new=TIME)
    (found,) = compare_recorded(["a.csv", "b.parquet"]).tested
    speed, force = found.deviations
    assert (speed.signal, speed.tube.width, speed.tube.height) == ("train.speed", 0.02, 0.02)
    assert speed.departure.distance == pytest.approx(0.015)  # the reference is 0.02 higher 0.02 s later
    assert (force.tube.height, force.inside) == (0.002 * 1e-3, True)
    assert (found.lacking, found.more) == (["own"], ["new"])
    assert found.notes == ["line.name holds texts, which are not compared"]
    assert found.same
    (tight,) = compare_recorded(["a.csv", "b.parquet"], time_tolerance=0.0, nominal=1e-4).tested
    assert [row.inside for row in tight.deviations] == [False, False]
    assert tight.deviations[1].relative == pytest.approx(1.75)


def test_files_and_figure(files, tmp_path):
    files("b.csv", train_speed=TIME + (TIME == 5.0), train_force=np.full(101, 7.0))
    files("c.csv", train_speed=np.where(TIME == 5.0, np.nan, TIME))
    found = compare_recorded(["a.csv", "b.csv", "c.csv"], output=tmp_path / "out")
    assert [path.name for path in found.figures] == ["b-csv-against-a-csv.png", "c-csv-against-a-csv.png"]
    assert imread(found.figures[0]).std() > 0.05
    document = json.loads((tmp_path / "out" / "compare.json").read_text())
    assert [one["same"] for one in document["tested"]] == [False, False]
    worst = document["tested"][0]["signals"][0]
    assert (worst["at"], worst["outside"], worst["inside"]) == (5.0, 1, False)
    assert document["tested"][1]["signals"][0]["distance"] == "inf"
    rows = list(csv.DictReader((tmp_path / "out" / "compare.csv").read_text().splitlines()))
    assert [row["inside"] for row in rows] == ["no", "yes", "no"]
    assert compare_recorded(["a.csv", "a.csv"], output=tmp_path / "out", figures=False).figures == []
    assert not found.figures[0].exists()


def test_time_that_is_covered_and_time_that_is_not(files):
    files("long.csv", np.linspace(0, 20, 201), train_speed=np.linspace(0, 20, 201))
    (found,) = compare_recorded(["a.csv", "long.csv"]).tested
    assert found.same
    assert found.notes == ["100 points of long.csv are outside the time of the reference, and not compared"]
    (found,) = compare_recorded(["long.csv", "a.csv"]).tested
    assert found.deviations[0].inside
    assert not found.same
    assert found.short == "it has the time from 0 to 10 s alone, the reference 0 to 20"


def test_signals_that_are_recorded_less_often(files):
    """One that has no value within the time of the reference is left out and told, as is one with its ends alone."""
    ends = np.where(np.isin(TIME, (0.0, 10.0)), TIME, np.nan)
    files("few.csv", train_speed=ends, train_force=np.full(101, 7.0))
    (found,) = compare_recorded(["a.csv", "few.csv"]).tested
    assert found.same
    assert found.notes == ["train.speed has values at 2 of 101 points of few.csv"]
    files("middle.csv", TIME[40:60], train_speed=TIME[40:60], train_force=np.full(20, 7.0))
    (found,) = compare_recorded(["middle.csv", "few.csv"]).tested
    assert "train.speed has no value in few.csv from 4 to 5.9 s" in found.notes
    assert [row.signal for row in found.deviations] == ["train.force"]
    with pytest.raises(ScenarioError, match=r"few\.csv has no value of train\.speed from 4 to 5\.9 s"):
        compare_recorded(["middle.csv", "few.csv"], signals=["train.speed"])


def test_units_that_differ_are_told(files, tmp_path):
    import pyarrow as pa
    from pyarrow import parquet

    for name, unit in (("a", b"m/s"), ("b", b"km/h")):
        fields = [pa.field("time", pa.float64()), pa.field("v", pa.float64(), metadata={b"unit": unit})]
        parquet.write_table(pa.table([TIME, TIME], pa.schema(fields)), f"{name}.parquet")
    (found,) = compare_recorded(["a.parquet", "b.parquet"]).tested
    assert found.notes == ["v is in m/s in the reference and in km/h in b.parquet: compared as plain numbers"]


def test_signals_by_pattern(files):
    files("b.csv", train_speed=TIME, train_force=TIME)
    (found,) = compare_recorded(["a.csv", "b.csv"], signals=["*.speed"]).tested
    assert [row.signal for row in found.deviations] == ["train.speed"]
    with pytest.raises(ScenarioError, match=r"a\.csv has no signal train\.sped; did you mean 'train\.speed'"):
        compare_recorded(["a.csv", "b.csv"], signals=["train.sped"])
    with pytest.raises(ScenarioError, match=r"has no signal zzz\*$"):
        compare_recorded(["a.csv", "b.csv"], signals=["zzz*"])


def test_what_cannot_be_compared(files):
    files("b.csv", other=TIME)
    files("late.csv", TIME + 50.0, train_speed=TIME)
    files("back.csv", TIME[::-1], train_speed=TIME)
    files("endless.csv", np.where(TIME == 10.0, np.inf, TIME), train_speed=TIME)
    for paths, why in (
        (["a.csv"], "name two results or more"),
        (["a.csv", "b.csv"], r"b\.csv has no signal in common of 4 signals from 0 to 10 s"),
        (["a.csv", "late.csv"], r"late\.csv has no point within the time"),
        (["a.csv", "back.csv"], r"back\.csv cannot be compared: its time goes back after row 1"),
        (["a.csv", "endless.csv"], "no finite ones"),
    ):
        with pytest.raises(ScenarioError, match=why):
            compare_recorded(paths)


def test_results_are_told_from_scenarios(tmp_path):
    (tmp_path / "run").mkdir()
    assert not is_recorded(tmp_path / "run")
    (tmp_path / "run" / "run.json").touch()
    assert is_recorded(tmp_path / "run")
    assert is_recorded("nothing.MAT")
    assert not is_recorded("comfort_cruise")


def test_the_command(files, capsys):
    files("b.csv", train_speed=TIME + 1.0, train_force=np.full(101, 7.0), **{f"more_{k}": TIME for k in range(8)})
    assert call(["compare", "a.csv", "a.csv", "-o", "out", "--no-figures"]) == 0
    assert "a.csv: 3 of 3 signals stay in their tubes" in capsys.readouterr().out
    assert call(["compare", "a.csv", "a.csv", "-q", "--no-figures"]) == 0
    assert capsys.readouterr() == ("", "")
    assert call(["compare", "a.csv", "b.csv", "-q", "--no-figures"]) == 1
    told = capsys.readouterr()
    assert (told.out, told.err) == ("", "b.csv: 1 of 2 signals stay in their tubes\n")
    assert call(["compare", "a.csv", "b.csv", "--tolerance", "0.1", "--no-figures"]) == 0
    said = capsys.readouterr().out
    assert "a.csv alone has line.name, own" in said
    assert "b.csv alone has more.0, more.1, more.2, more.3, more.4, more.5 and 2 more" in said
    files("short.csv", TIME[:50], train_speed=TIME[:50])
    assert call(["compare", "a.csv", "short.csv", "-q", "--no-figures"]) == 1
    assert "short.csv: it has the time from 0 to 4.9 s alone" in capsys.readouterr().err
    assert call(["compare", "a.csv", "short.csv", "--no-figures", "--json"]) == 1
    document = json.loads(capsys.readouterr().out)["result"]
    assert (document["same"], document["tested"][0]["signals"][0]["inside"]) == (False, True)


def test_options_that_do_not_go_together(files, capsys):
    for wrong in (
        ["a.csv", "comfort_cruise"],
        ["a.csv", "a.csv", "--stop", "3"],
        ["a.csv", "a.csv", "--kind", "plain"],
    ):
        assert call(["compare", *wrong]) == 2
        assert "results are compared with results alone" in capsys.readouterr().err
    assert call(["compare", "comfort_cruise", "--tolerance", "0.1"]) == 2
    assert "are about recorded results" in capsys.readouterr().err
