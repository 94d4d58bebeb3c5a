"""The record of a run whose process is gone says how it ended, and what was recorded can be read."""

import json
import os

import pytest
from railcosim.orchestrator import System, run
from railcosim.orchestrator.run import Results, conclude


@pytest.fixture
def left(mine, tmp_path):
    """What a run has left that went on when its process ended."""
    system = System(step=0.1, stop_time=1.0)
    system.add("plant", mine("Lag"))
    run(system, kind="plain", output=tmp_path, figures=False)
    record = json.loads((tmp_path / "run.json").read_text())
    (tmp_path / "run.json").write_text(json.dumps(record | {"status": "running"}))
    return tmp_path


def status(place):
    record = json.loads((place / "run.json").read_text())
    return record["status"], record["error"]


def test_it_says_how_it_ended(left):
    conclude(left, os.getpid(), "failed", "it crashed")
    assert status(left) == ("failed", "it crashed")
    assert len(Results.load(left).time) == 11


def test_rows_become_text(left):
    lines = (left / "results.csv").read_text().splitlines()
    columns = lines[0].split(",")
    import numpy as np

    head = {"run": json.loads((left / "run.json").read_text())["run"], "columns": columns, "whole": []}
    rows = np.array([[float(x) for x in line.split(",")] for line in lines[1:5]])
    (left / "results.bin").write_bytes(json.dumps(head).encode() + b"\n" + rows.tobytes())
    conclude(left, os.getpid(), "failed", "it crashed")
    assert (left / "results.csv").read_text().splitlines() == lines[:5]


@pytest.mark.parametrize("changes", [{"status": "completed"}, {"process": {"pid": 0, "host": ""}}, {"process": 1}])
def test_another_run_s_record_is_left_alone(left, changes):
    record = json.loads((left / "run.json").read_text()) | changes
    (left / "run.json").write_text(json.dumps(record))
    conclude(left, os.getpid(), "failed", "it crashed")
    assert json.loads((left / "run.json").read_text()) == record


def test_where_there_is_nothing_nothing_is_said(tmp_path):
    conclude(tmp_path / "none", 1, "failed", "it crashed")
    assert not (tmp_path / "none" / "run.json").exists()
