"""What is on disk of a study: whole parts while it runs, one table at the end, and nothing lost on the way."""

import errno
import json

import duckdb
import numpy as np
import pandas as pd
import polars as pl
import pyarrow.parquet as pq
import pytest
from railcosim.orchestrator import world
from railcosim.orchestrator.errors import RailcosimError, RecordError
from railcosim.orchestrator.study import Row
from railcosim.orchestrator.study.campaign import dataset as dataset_module
from railcosim.orchestrator.study.campaign.columns import Entry
from railcosim.orchestrator.study.campaign.dataset import Dataset


def row(number, points=0):
    series = {"time": np.arange(points, dtype=float), "lag.x": np.full(points, float(number))}
    verdict = "pass" if number % 3 else "fail"
    return Row("completed", "", {"end": number / 7}, {"low": verdict}, series=series if points else None)


def fill(folder, numbers, points=0):
    made = Dataset(folder, ["lag.rate"], ["end", "low"], 5)
    made.recover(12)
    for number in numbers:
        made.add(Entry(number, {"lag.rate": number / 3}, row(number, points)))
    made.flush()
    return made


def readers(path):
    """The runs as three tools read what is at a path."""
    duck = duckdb.connect().sql(f"select * from '{path}' order by run").df()
    return [pd.read_parquet(path), pl.read_parquet(path).to_pandas(), duck]


@pytest.mark.parametrize("complete", [True, False])
def test_all_tools_read_it_as_it_stands(tmp_path, complete):
    fill(tmp_path, [7, 1, 4])
    made = fill(tmp_path, [0, 9, 2])
    if complete:
        made.complete({"scenario": "small"})
    for found in readers(tmp_path / "runs.parquet"):
        frame = found.sort_values("run")
        assert frame["run"].tolist() == [0, 1, 2, 4, 7, 9]
        assert frame["metric.end"].tolist() == [number / 7 for number in frame["run"]]
        assert frame["verdict.low"].tolist() == ["fail", "pass", "pass", "pass", "pass", "fail"]


def test_the_whole_is_sorted_and_tells_of_its_study(tmp_path, monkeypatch):
    monkeypatch.setattr(dataset_module, "_GROUP", 2)
    made = fill(tmp_path, [7, 1, 11])
    fill(tmp_path, [0, 9, 2]).complete({"scenario": "small"})
    assert made.is_complete
    table = pq.read_table(tmp_path / "runs.parquet")
    assert table["run"].to_pylist() == [0, 1, 2, 7, 9, 11]
    assert json.loads(table.schema.metadata[b"railcosim"]) == {"scenario": "small"}
    assert pq.read_metadata(tmp_path / "runs.parquet").num_row_groups == 5
    assert sorted(path.name for path in tmp_path.iterdir()) == ["runs.parquet"]
    assert made.recover(10).all()


def test_parts_are_written_after_some_runs_or_some_time(tmp_path, monkeypatch):
    monkeypatch.setattr(dataset_module, "_MOST_ROWS", 2)
    now = [0.0]
    monkeypatch.setattr(world, "monotonic", lambda: now[0])
    made = Dataset(tmp_path, [], [], 0)
    for number, time, parts in ((0, 1.0, 0), (1, 1.0, 1), (2, 2.0, 1), (3, 2.0, 2), (4, 9.0, 3)):
        now[0] = time
        made.add(Entry(number, {}, row(number)))
        assert len(made.parts()) == parts


def test_what_a_killed_study_left_is_put_right(tmp_path):
    whole, parts = tmp_path / "runs.parquet", tmp_path / "runs.parts"
    fill(tmp_path, [3, 8], points=2)
    (tmp_path / ".new.parquet").write_text("half a part")
    (tmp_path / "series.parquet/000002.parquet").write_bytes((tmp_path / "series.parquet/000001.parquet").read_bytes())
    series = pq.read_table(tmp_path / "series.parquet/000001.parquet")
    pq.write_table(series.set_column(0, "run", [[3, 3, 5, 5]]), tmp_path / "series.parquet/000003.parquet")
    whole.rename(parts)  # between the two renamings of the end
    made = Dataset(tmp_path, ["lag.rate"], [], 5)
    assert np.flatnonzero(made.recover(10)).tolist() == [3, 8]
    assert {path.name for path in tmp_path.rglob("*")} == (
        {"runs.parquet", "series.parquet", "000001.parquet", "000002.parquet"}
    )
    made.complete({})
    parts.mkdir()  # after them, before the parts were gone
    assert made.recover(10).all()
    assert not parts.exists()
    made.clear()
    assert not list(tmp_path.iterdir())


def test_a_damaged_part_is_named(tmp_path):
    made = fill(tmp_path, [3])
    made.parts()[0].write_text("damaged")
    with pytest.raises(
        RailcosimError, match=r"000001\.parquet cannot be read .*; remove it, and its runs are run again"
    ):
        Dataset(tmp_path, [], [], 0).recover(10)


@pytest.mark.parametrize("call", ["fsync", "replace"])
def test_a_full_disk_loses_nothing(tmp_path, monkeypatch, call):
    made = fill(tmp_path, [1, 2])
    made.add(Entry(3, {"lag.rate": 1.0}, row(3)))

    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(world, call, full)
        with pytest.raises(RecordError, match=r"000002\.parquet cannot be written: No space left on device; make room"):
            made.flush()
        with pytest.raises(RecordError, match=r"runs\.parquet cannot be written"):
            made.complete({})
    assert [path.name for path in made.parts()] == ["000001.parquet"]
    made.flush()
    assert np.flatnonzero(Dataset(tmp_path, [], [], 0).recover(10)).tolist() == [1, 2, 3]
