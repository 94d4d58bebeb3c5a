"""Every published case: which there are, and the one table of them. The numbers themselves: tests/scenarios."""

import re
import shlex
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

import pytest
from railcosim.orchestrator import ScenarioError, load
from railcosim.orchestrator.cli.app import call
from railcosim.orchestrator.comparison.reproduce import published_cases

SCENARIO = """
title = "A train on its own"
source = "Miller 1999"
default_preset = "calm"
[simulation]
stop_time = 1.0
step = 0.1
[instances.train]
component = "PointMassTrain"
start = {{ speed = 10.0, force = 0.0 }}
[presets.fast]
"train.speed" = 20.0
[presets.unpublished]
"train.speed" = 30.0
[metrics]
start = "initial(train.speed)"
[[published]]
metric = "start"
value = 10.0
tolerance = 0.5
origin = "stated"
[[references]]
metric = "start"
value = {own}
tolerance = 0.5
[[published]]
metric = "start"
preset = "fast"
value = {fast}
tolerance = 0.5
claim = "a preset starts faster"
origin = "stated"
"""


@pytest.fixture(autouse=True, scope="module")
def a_pipe_of_the_usual_width() -> Iterator[None]:
    """What runs the tests may ask for another width (pytest-xdist does)."""
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("COLUMNS", raising=False)
        yield


@pytest.fixture
def shelf(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder in the place of the shipped scenarios, with one that reproduces."""
    monkeypatch.setattr(import_module("railcosim.orchestrator.scenario.shipped"), "MODELS", tmp_path)
    (tmp_path / "one.toml").write_text(SCENARIO.format(fast=20.0, own=10.0))
    return tmp_path


def test_a_case_is_a_scenario_with_a_preset_that_has_published_values(shelf: Path) -> None:
    (shelf / "plain.toml").write_text(SCENARIO.partition("[[published]]")[0].format(fast=0, own=0))
    assert [case.command for case in published_cases()] == ["orchestrate run one", "orchestrate run one --preset fast"]
    assert [case.system.provenance.preset for case in published_cases()] == ["calm", "fast"]


@pytest.mark.parametrize(("paper", "found"), [("one", True), ("on", True), ("miller", True), ("Wang", False)])
def test_a_paper_is_found_by_the_scenario_or_a_word_of_its_source(paper: str, found: bool, shelf: Path) -> None:
    if found:
        assert len(published_cases(paper)) == 2
    else:
        with pytest.raises(ScenarioError, match="no published case belongs to 'Wang'"):
            published_cases(paper)


@pytest.mark.long
def test_the_command_of_every_shipped_case_loads_the_same_system() -> None:
    shipped = published_cases()
    assert {case.system.provenance.name for case in shipped} >= {"comfort_cruise", "comfort_cruise_bottom_layer"}
    for case in shipped:
        program, run, name, *preset = shlex.split(case.command)
        assert (program, run) == ("orchestrate", "run")
        again = load(name, preset=preset[1] if preset else None)
        assert again.instances == case.system.instances
        assert not again.provenance.modified


def test_published_values_under_the_command_and_references_counted(
    shelf: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert call(["reproduce"]) == 0
    said = capsys.readouterr()
    assert said.err == ""  # progress is for a terminal
    lines = [line.rstrip() for line in said.out.splitlines() if line.strip()]
    assert lines[0] == "Published values"
    assert lines[1].split() == ["claim", "published", "measured", "tolerance", "unit", "verdict"]
    assert lines[2] == "orchestrate run one"
    assert lines[3].split() == ["start", "10", "10", "0.5", "m/s", "reproduced"]
    assert lines[4] == "orchestrate run one --preset fast"
    assert re.fullmatch(r"start: a preset starts faster +20 +20 +0\.5 +m/s +reproduced", lines[5])
    assert lines[6:] == ["2 of 2 stated values reproduced", "1 of 1 reference values (our own) reproduced"]


def test_quiet_is_one_line(shelf: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert call(["reproduce", "--quiet"]) == 0
    assert capsys.readouterr().out == "reproduced: stated 2 of 2, reference 1 of 1\n"


def test_a_missed_value_is_named_and_ends_with_1(shelf: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (shelf / "one.toml").write_text(SCENARIO.format(fast=25.0, own=10.0))
    assert call(["reproduce"]) == 1
    said = capsys.readouterr()
    assert re.search(r"start: a preset starts faster +25 +20 +0\.5 +m/s +missed", said.out)
    assert "1 of 2 stated values reproduced; missed: start" in said.out


def test_a_missed_reference_is_shown_though_the_others_are_not(shelf: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (shelf / "one.toml").write_text(SCENARIO.format(fast=20.0, own=11.0))
    for arguments, title in ((["reproduce"], "References that are missed"), (["reproduce", "-q"], "Missed")):
        assert call(arguments) == 1
        said = capsys.readouterr().out
        assert title in said
        assert re.search(r"^start +11 +10 +0\.5 +m/s +missed", said, re.MULTILINE)
    assert said.rstrip().endswith("reproduced: stated 2 of 2, reference 0 of 1 (1 missed)")


def test_what_departs_costs_nothing_until_it_holds(shelf: Path, capsys: pytest.CaptureFixture[str]) -> None:
    departs = SCENARIO.replace("value = {fast}", 'value = {fast}\ndeparts = "a typing error"')
    (shelf / "one.toml").write_text(departs.format(fast=25.0, own=10.0))
    assert call(["reproduce"]) == 0
    assert "1 of 2 stated values reproduced; 1 departs as known" in capsys.readouterr().out
    (shelf / "one.toml").write_text(departs.format(fast=20.0, own=10.0))
    assert call(["reproduce"]) == 1
    assert "departs no more: start" in capsys.readouterr().out


def test_quiet_counts_what_was_found_by_kind(shelf: Path, capsys: pytest.CaptureFixture[str]) -> None:
    reversing = SCENARIO.replace("speed = 10.0,", "speed = -10.0,").replace("value = 10.0", "value = -10.0")
    (shelf / "one.toml").write_text(reversing.format(fast=20.0, own=-10.0))
    assert call(["reproduce", "--quiet"]) == 0
    assert capsys.readouterr().out == "reproduced: stated 2 of 2, reference 1 of 1; 1 reversing\n"
