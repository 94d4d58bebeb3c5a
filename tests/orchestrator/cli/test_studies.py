"""`study` and `replay`: what they print, write, and end with."""

import json
from pathlib import Path

import pandas as pd
import pytest
from railcosim.orchestrator.cli.app import call

TEXT = """
title = "A lag"
[simulation]
stop_time = 1.0
step = 0.5
[instances.lag]
component = "TOYS:Lag"
[metrics]
end = "final(lag.x)"
[require]
low = "always lag.x <= LIMIT"
"""


@pytest.fixture
def scenario(tmp_path, mine, monkeypatch):
    """A scenario in the current folder, whose requirement has a limit."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("COLUMNS", raising=False)

    def write(limit=5.0):
        text = TEXT.replace("TOYS", mine("Lag").rpartition(":")[0]).replace("LIMIT", str(limit))
        (tmp_path / "lag.toml").write_text(text)
        return "lag.toml"

    return write


def study(scenario, *arguments, figures=False):
    quick = [] if figures else ["--no-figures"]
    return call(["study", scenario, *arguments, *quick, "--kind", "plain", "--workers", "0"])


def test_a_study_and_one_of_its_runs_again(scenario, capsys):
    assert study(scenario(), "--vary", "lag.rate=1:3:3", "--record", "lag.x", "--isolate", "all") == 0
    said = capsys.readouterr()
    assert said.out.splitlines()[0] == "A lag"
    assert said.out.splitlines()[-2:] == (
        ["3 of 3 runs; all requirements held", "Files in results/lag-study: runs.parquet, study.json, series.parquet"]
    )
    assert [line for line in said.err.splitlines() if "%" in line] == (
        [f"lag: {percent} % of 3 runs" for percent in (30, 60, 100)]
    )
    assert pd.read_parquet("results/lag-study/runs.parquet")["lag.rate"].tolist() == [1, 2, 3]
    assert call(["replay", "results/lag-study", "lag.toml", "--run", "2", "--no-figures"]) == 0
    assert "run 2 of results/lag-study: the same to the bit" in capsys.readouterr().err
    told = json.loads(Path("results/lag-study/run-2/run.json").read_text())
    assert told["instances"]["lag"]["start"]["rate"] == 3


def test_a_study_ends_with_its_pictures(scenario, capsys):
    assert study(scenario(), "--vary", "lag.rate=1:3:3", "--record", "lag.x", figures=True) == 0
    assert capsys.readouterr().out.splitlines()[-1].endswith("study.json, series.parquet, 3 figures")
    drawn = {path.name for path in Path("results/lag-study").glob("*.png")}
    assert drawn == {"margins-of-requirements.png", "what-came-out.png", "over-time.png"}


def test_the_exit_code_is_1_where_a_requirement_fails(scenario, capsys):
    assert study(scenario(0.9), "--vary", "lag.x=0.5,2.0", "-q", "-o", "out") == 1
    said = capsys.readouterr()
    assert (said.out, said.err) == ("", "2 of 2 runs; not always held: low\n")
    assert study("lag.toml", "--vary", "lag.x=0.5", "-q", "-o", "fine") == 0
    assert capsys.readouterr() == ("", "")
    assert call(["replay", "out", "--run", "0", "--trust", "-q", "--no-figures"]) == 0
    assert call(["replay", "out", "--run", "1", "--trust", "-q", "--no-figures"]) == 1


def test_the_exit_code_is_3_where_a_run_fails(scenario, capsys):
    vary = ["--vary", "simulation.stop_time=1.0,0.7", "--vary", "lag.x=9.0"]
    assert study(scenario(), *vary, "-o", "out") == 3
    assert "2 of 2 runs, 1 failed; not always held: low" in capsys.readouterr().out
    assert call(["replay", "out", "--run", "1", "--trust"]) == 2


def test_the_exit_code_is_2_where_the_input_is_wrong(scenario, capsys):
    assert study(scenario(), "--vary", "lag.rat=1:3:3") == 2
    assert "rate" in capsys.readouterr().err
    assert call(["study", "lag.toml", "--vary", "lag.rate=1:3:3", "--workers", "2", "--scheduler", "tcp://x:1"]) == 2
    assert "the scheduler has the workers that it has" in capsys.readouterr().err
    assert call(["study", "lag.toml", "--vary", "lag.rate=1:3:3", "--isolate", "wheel"]) == 2
    assert call(["replay", "none", "--run", "1"]) == 2
    study("lag.toml", "--vary", "lag.rate=1,2", "-o", "out")
    assert call(["replay", "out", "--run", "1"]) == 2
    assert "name its scenario as well, or read that code and --trust it" in capsys.readouterr().err


def test_a_study_that_was_interrupted_says_how_to_go_on(scenario, capsys, monkeypatch):
    from railcosim.orchestrator.study.campaign import pool

    here = pool.Here.rows

    def interrupted(self, points, count, is_over):
        from signal import SIGINT, raise_signal

        for k, found in enumerate(here(self, points, count, is_over)):
            yield found
            if k == 1:
                raise_signal(SIGINT)

    with monkeypatch.context() as patch:
        patch.setattr(pool.Here, "rows", interrupted)
        assert study(scenario(), "--vary", "lag.rate=1:4:4", "-o", "out") == 130
    said = capsys.readouterr().out
    assert "2 of 4 runs; all requirements held" in said
    assert "to go on: the same command with --resume -o out" in said
    assert study("lag.toml", "--vary", "lag.rate=1:4:4", "-o", "out", "--resume") == 0
    assert [line for line in capsys.readouterr().err.splitlines() if "%" in line] == (
        ["lag: 70 % of 4 runs", "lag: 100 % of 4 runs"]
    )


def test_notes_of_the_plan_are_told(scenario, capsys):
    assert study(scenario(), "--vary", "lag.rate=1:3", "--runs", "3", "--design", "sobol", "-o", "out") == 0
    assert "note: a Sobol sequence is balanced" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("run", "differs", "code"),
    [
        ({"signal": 15}, False, 143),
        ({"status": "failed", "error": "it broke"}, False, 3),
        ({}, True, 1),
        ({}, False, 0),
    ],
)
def test_a_replay_ends_as_a_run_does(run, differs, code):
    from types import SimpleNamespace

    from railcosim.orchestrator.cli.studies import _exit_code

    ended = SimpleNamespace(**{"signal": 0, "status": "completed", "error": None, "failed": False} | run)
    assert _exit_code(ended, differs) == code


def test_what_differs_is_told(scenario, capsys):
    study(scenario(), "--vary", "lag.rate=1,2", "-o", "out")
    told = json.loads(Path("out/study.json").read_text())
    told["how"]["settings"] = ["lag.gain=7", "lag.u=1"]
    Path("out/study.json").write_text(json.dumps(told))
    assert call(["replay", "out", "lag.toml", "--run", "0", "--no-figures"]) == 1
    assert "warning: not the same as in the study: metric.end was" in capsys.readouterr().err
