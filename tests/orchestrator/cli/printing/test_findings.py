"""Findings are printed first, on stdout, also when quiet; no exit code changes; who has some wins nothing."""

import json
from pathlib import Path

import pytest
from railcosim.orchestrator.cli.app import app
from railcosim.orchestrator.cli.printing.findings import show_findings
from railcosim.orchestrator.run import Finding
from typer.testing import CliRunner

TOYS = Path(__file__).parents[3] / "toys.py"
SCENARIO = """
title = "Carts"
[simulation]
stop_time = 4.0
step = 0.5
[instances.train]
component = "{toys}:Cart"
count = 6
start.speed = 1.0
start.force = 0.5
[presets.back]
"train.force" = "-0.5 * i"
[presets.hardly]
"simulation.step" = 4.0
"train.force" = [0.5, 0.5, 0.5, 0.5, 0.5, -0.26]
[require]
short = "always train[1].position < 1e6"
[metrics]
least = "peak(train[1].position)"
"""


@pytest.fixture
def invoke(tmp_path):
    scenario = tmp_path / "carts.toml"
    scenario.write_text(SCENARIO.format(toys=TOYS.as_posix()))

    def run(command, *options):
        where = ["--kind", "plain", "--no-figures", "-o", str(tmp_path / "out")]
        return CliRunner().invoke(app, [command, str(scenario), *where, *options])

    return run


@pytest.mark.parametrize("quiet", [[], ["-q"]])
def test_run(invoke, tmp_path, quiet):
    outcome = invoke("run", "--preset", "back", *quiet)
    assert outcome.exit_code == 0
    first, *others = outcome.stdout.splitlines()
    assert first == "reversing: train[5] runs backwards from t = 0.5 s on, with -9 m/s at t = 4 s"
    assert others[3] == "reversing: 2 more, of train[2], train[1]"
    assert len(others) == 4 if quiet else "Carts" in others[4]
    assert len(json.loads((tmp_path / "out" / "run.json").read_text())["findings"]) == 6


def test_nothing_found_is_nothing_said(invoke):
    assert invoke("run", "-q").stdout == ""


def test_what_half_the_step_finds_as_well_is_said_once(invoke):
    outcome = invoke("run", "--preset", "hardly", "--verify-step", "-q")
    assert outcome.stdout.splitlines() == [
        "reversing: train[6] runs backwards from t = 4 s on, with -0.04 m/s at t = 4 s"
    ]


def test_compare(invoke, tmp_path):
    outcome = invoke("compare", "--preset", "back")
    assert outcome.exit_code == 0
    lines = outcome.stdout.splitlines()
    assert lines[0].startswith("back: reversing: train[5] runs backwards")
    assert lines[5] == "back: wins nothing, because of what was found"
    written = json.loads((tmp_path / "out" / "compare.json").read_text())
    calm, back = written["variants"]
    assert (calm["can_win"], calm["findings"]) == (True, [])
    assert (back["can_win"], len(back["findings"])) == (False, 6)
    (row,) = written["rows"]
    assert row["values"]["back"] < row["values"]["as it stands"]
    assert row["winners"] == ["as it stands"]


def test_compare_when_quiet(invoke):
    assert len(invoke("compare", "--preset", "back", "-q").stdout.splitlines()) == 6


def test_many_are_told_by_family(capsys):
    alike = [Finding("reversing", (f"train[{k}]",), "", 0.0, -1.0, 0.0, f"number {k}") for k in range(1, 31)]
    other = Finding("degraded", ("cruise",), "", 0.0, 1.0, 0.0, "it fell back")
    show_findings([*alike, other], "wide")
    *_, last, told = capsys.readouterr().out.splitlines()
    assert last == "wide: reversing: 26 more, of train[i]"
    assert told == "wide: degraded: it fell back"
