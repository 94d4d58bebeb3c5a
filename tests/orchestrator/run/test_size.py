"""How large results will be is told before a run begins, where they will be large."""

import logging
from types import SimpleNamespace

import psutil
import pytest
from railcosim.orchestrator import System, run
from railcosim.orchestrator.cli.app import app
from railcosim.orchestrator.run import size as module
from railcosim.orchestrator.run.size import size_of, tell_size
from typer.testing import CliRunner


def system(**how):
    made = System(**{"stop_time": 1e9, "step": 0.1} | how)
    made.add("gust", "Gust")
    return made


@pytest.fixture
def free(monkeypatch):
    """Set how much memory is free, in bytes."""

    def say(count):
        monkeypatch.setattr(psutil, "virtual_memory", lambda: SimpleNamespace(available=count))

    say(1e12)
    return say


def test_the_size_is_rows_times_columns():
    """Time and three signals."""
    found = size_of(system(stop_time=100.0, step=0.1), 3)
    assert (found.rows, found.columns) == (pytest.approx(1001.0), 4)
    assert found.memory == pytest.approx(1001 * 4 * 8)
    assert size_of(system(start_time=50.0, stop_time=100.0, record=5.0), 3).rows == 11.0


def test_what_is_large_anywhere(free):
    told = tell_size(system(), 1)
    assert told == (
        "results will be large: 1e+10 rows of 2 columns are 160 GB in results.bin, or in memory without -o (1 TB are "
        "free), and about 280 GB in results.csv; record less often (simulation.record = 1 is a tenth of it) or end "
        "sooner"
    )
    assert "simulation.record = 20 is" in tell_size(system(record=2.0), 3)
    assert tell_size(system(record=1e6), 1) == ""


def test_what_is_large_here(free):
    made = system(stop_time=1e6)
    assert tell_size(made, 1) == ""
    free(6e8)
    assert "160 MB in results.bin, or in memory without -o (600 MB are free)" in tell_size(made, 1)


def test_it_is_told_before_the_run(free, tmp_path, caplog, monkeypatch):
    free(100.0)
    monkeypatch.setattr(module, "_SMALL", 0.0)
    made = system(stop_time=1.0)
    with caplog.at_level(logging.WARNING):
        outcome = run(made, kind="plain", output=tmp_path)
    assert [record.getMessage()[:22] for record in caplog.records] == ["results will be large:"]
    assert outcome.checked.notes[0] == outcome.checked.large == caplog.messages[0]


def test_check_tells_it():
    outcome = CliRunner().invoke(app, ["check", "comfort_cruise", "--stop", "1e9"])
    assert outcome.exit_code == 0
    assert "note: results will be large: 1e+10 rows of" in outcome.stdout
