"""Faults in scenarios as they would be written: a sensor that sticks, a radio whose data are old."""

import re
from pathlib import Path

import numpy as np
import pytest
from railcosim.orchestrator import load
from railcosim.orchestrator.linearization.closed_loop import linearize
from railcosim.orchestrator.run.execution import execute
from railcosim.orchestrator.system import Event

FROZEN = """
[[events]]
signal = "train[2].position"
action = "freeze"
at = 250.0
duration = 20.0
"""


def test_a_frozen_position_sensor_makes_a_requirement_fail(tmp_path):
    """For 20 s all believe that the second of four trains stands still: the gap behind it seems to close by 1.7 km."""
    scenario = tmp_path / "frozen.toml"
    scenario.write_text(load("comfort_cruise").provenance.text + FROZEN)
    result, before = execute(load(scenario, stop_time=300.0)), execute(load("comfort_cruise", stop_time=300.0))
    fine, verdicts = ({v.name: v for v in outcome.requirements} for outcome in (before, result))
    assert (fine["spacing"].verdict, verdicts["spacing"].verdict) == ("pass", "fail")
    assert (verdicts["spacing"].time, verdicts["spacing"].index) == (pytest.approx(269.9), 3)
    held = (result.time >= 250.0) & (result.time < 270.0 - 1e-6)
    assert len(set(result["train[2].position"][held])) == 1
    assert set(result["train[2].position"][held]) < set(before["train[2].position"])
    assert result["train[3].speed"][held][-1] < before["train[3].speed"][held][-1] - 1.0, "it brakes"
    for name in result.names():
        earlier = result.time < 250.0
        assert np.array_equal(result[name][earlier], before[name][earlier])


def test_the_example_of_the_documentation(tmp_path):
    """docs/faults_and_checkpoints.md, with the numbers that it tells."""
    page = Path(__file__).parents[3] / "docs" / "faults_and_checkpoints.md"
    example = re.search(r"```toml\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)[1]
    (tmp_path / "example.toml").write_text(example)
    result = execute(load(tmp_path / "example.toml"))
    (verdict,) = result.requirements
    assert (verdict.verdict, verdict.time, verdict.index) == ("fail", pytest.approx(80.1), 2)
    assert result["train[2].acceleration"].min() == pytest.approx(-1.3, abs=0.05)
    gap = result["train[1].position"] - result["train[2].position"]
    assert gap[800] == pytest.approx(7400.0 - 160.0, abs=1.0)


def test_the_fallback_trusts_the_age_of_data_not_the_data():
    """A position that freezes unnoticed makes the train behind brake; one that is said to be old degrades the law."""
    frozen, old = (
        load("degraded_radio", preset="perfect", stop_time=100.0, settings=["simulation.record=0.1"]) for _ in "ab"
    )
    frozen.events = [Event("radio[1].position", "freeze", 50.0, duration=20.0)]
    old.events = [Event("radio[1].age", "bias", 50.0, 60.0, duration=20.0)]
    frozen, old = execute(frozen), execute(old)
    during = (old.time > 50.1) & (old.time < 70.0)
    assert not frozen["cruise[2].degraded"].any()
    assert old["cruise[2].degraded"][during].all()
    assert not old["cruise[2].degraded"][old.time < 50.0].any()
    assert not old["cruise[2].degraded"][-1]
    assert frozen["train[2].acceleration"][during].min() < old["train[2].acceleration"][during].min() - 0.1


def test_a_linear_model_says_that_it_knows_nothing_of_events():
    system = load("comfort_cruise", stop_time=10.0)
    system.events = [Event("cruise[2].speed", "freeze", 0.5)]
    noted = [note for note in linearize(system, 1.0, kind="plain").notes if "events" in note]
    assert noted == ["events act on the way; signals that they change at that time are taken as unchanged"]


def test_a_controller_hands_over_without_a_jump(tmp_path):
    """The second example: with a fade no step of the force is larger than those that the two controllers take alone."""
    page = Path(__file__).parents[3] / "docs" / "faults_and_checkpoints.md"
    example = re.search(r"```toml\n(# leaving.toml\n.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)[1]
    (tmp_path / "leaving.toml").write_text(example)
    result = execute(load(tmp_path / "leaving.toml"))
    (tmp_path / "abrupt.toml").write_text(re.sub(r"fade = .*", "", example))
    abrupt = execute(load(tmp_path / "abrupt.toml"))
    acceleration = result["train[2].acceleration"]
    at = int(np.argmin(acceleration))
    assert (result.time[at], acceleration[at]) == (pytest.approx(70.0, abs=0.2), pytest.approx(-0.53, abs=0.005))
    assert np.abs(np.diff(acceleration)).max() < 0.01
    assert np.diff(abrupt["train[2].acceleration"]).min() == pytest.approx(-0.594, abs=0.001)
    assert result["train[2].speed"][-1] == pytest.approx(50.0, abs=0.02)
    assert result["train[3].speed"][-1] > 80.0, "it closes up to the first"
    assert not result.findings
