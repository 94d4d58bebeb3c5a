"""What `run --verify-step` tells of the step."""

import json
import re

import numpy as np
import pytest
from railcosim.orchestrator import load
from railcosim.orchestrator.cli import runs
from railcosim.orchestrator.cli.app import call
from railcosim.orchestrator.cli.options import KindName
from railcosim.orchestrator.run.execution import execute

SMALL = """
[simulation]
stop_time = 2.0
step = 0.1
[instances.train]
component = "PointMassTrain"
start = { speed = 10.0, force = 0.0 }
[metrics]
start = "initial(train.speed)"
"""


@pytest.fixture
def small(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("COLUMNS", raising=False)
    (tmp_path / "small.toml").write_text(SMALL)
    return tmp_path


def verified(scenario, *arguments):
    return call(["run", scenario, *arguments, "--verify-step", "--kind", "plain", "--no-figures", "-o", "out"])


def test_each_metric_at_half_the_step_the_difference_and_a_verdict(small, capsys):
    assert verified("small.toml") == 0
    said = capsys.readouterr()
    assert re.search(r"metric +value +at half the step +difference +unit", said.out)
    assert re.search(r"^start +10 +10 +\+0 +m/s", said.out, re.MULTILINE)
    assert "small at half the step: 100 % of 2 s" in said.err
    assert "the step of 0.1 s is fine: half of it changes no metric and no requirement's verdict" in said.out
    assert json.loads((small / "out/run.json").read_text())["step_check"]["verdict"] == "fine"


@pytest.mark.long
def test_a_step_too_coarse_ends_with_1(small, capsys):
    assert verified("comfort_cruise", "--preset", "no-gust", "--step", "10") == 1
    said = capsys.readouterr().out
    assert re.search(r"^the step of 10 s is too coarse: half of it changes \S+ by \S+ of \S+ .*allowed", said, re.M)
    assert "before the changes: Figure-consistent gains, no gust." in said
    assert "not judged, because the scenario was modified" in said
    assert verified("comfort_cruise", "--preset", "no-gust", "--step", "10", "-q") == 1
    assert "the step of 10 s is too coarse" in capsys.readouterr().err


def test_the_second_run_is_recorded_at_the_same_points(small):
    first = execute(load(small / "small.toml"), kind="plain")
    second = runs._at_half_the_step(first, KindName.plain, quiet=True)
    assert second is not None
    assert second.system.stepping.step == 0.05
    assert second.seconds["steps"] == 40
    np.testing.assert_array_equal(second.time, first.time)
