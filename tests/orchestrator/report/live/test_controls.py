"""What can be changed: the parameters of the declarations, with bounds; those that are changed anyway come first."""

import pytest
from railcosim.orchestrator import System
from railcosim.orchestrator.fmi import Workspace
from railcosim.orchestrator.report.live.controls import controls_of
from railcosim.orchestrator.run import check

SCENARIO = """
[presets.quick]
description = "Twice as quick."
"lag.rate" = 2.0
[study.vary]
"course.b" = [0.0, 1.0]
"""
BOUNDED = """
from railcosim.components import Component, Output, Parameter


class Bounded(Component):
    level = Parameter("1", 0.5, minimum=0.0, maximum=1.0)
    y = Output("1")

    def outputs(self):
        return {"y": self.level}
"""


def controls(system):
    with Workspace() as workspace:
        return controls_of(check(system, workspace, "plain"))


@pytest.fixture
def system(mine):
    made = System(stop_time=1.0, step=0.1)
    made.add("lag[1]", mine("Lag"), gain=2.0)
    made.add("lag[2]", mine("Lag"), gain=3.0)
    made.add("course", mine("Course"), c=-4.0)
    made.add("level", mine("Level"))
    return made


def test_one_for_all_that_are_alike(system):
    found = {control["name"]: control for control in controls(system)}
    assert found["lag.rate"]["targets"] == [
        [0, found["lag.rate"]["targets"][0][1]],
        [1, found["lag.rate"]["targets"][0][1]],
    ]
    assert found["lag.rate"]["parameters"] == ["lag[1].rate", "lag[2].rate"]
    assert [found[f"lag[{k}].gain"]["value"] for k in (1, 2)] == [2.0, 3.0]
    assert "lag.gain" not in found
    assert (found["lag.rate"]["fixed"], found["lag[1].gain"]["fixed"]) == (False, True)
    assert (found["level.upside_down"]["kind"], found["level.upside_down"]["value"]) == ("Boolean", 0.0)


def test_how_far_they_go(system):
    found = {control["name"]: control for control in controls(system)}
    ends = {name: (found[name]["low"], found[name]["high"]) for name in ("course.a", "course.b", "course.c")}
    assert ends == {"course.a": (0.0, 3.0), "course.b": (-1.0, 1.0), "course.c": (-12.0, 0.0)}


def test_declared_bounds_hold(mine):
    system = System(stop_time=1.0, step=0.1)
    system.add("line", "ComfortCruise", acceleration_limit=2.0, position=0.0, speed=1.0, target_speed=2.0)
    found = {control["name"]: control for control in controls(system)}
    assert found["line.acceleration_limit"]["least"] == found["line.acceleration_limit"]["low"] > 0.0
    assert found["line.acceleration_limit"]["high"] == 6.0
    assert found["line.acceleration_limit"]["unit"] == "m/s2"
    assert found["line.acceleration_limit"]["description"]


def test_between_both_bounds(mine, tmp_path, hostile):
    (tmp_path / "bounded.py").write_text(BOUNDED)
    system = System(stop_time=1.0, step=0.1)
    system.add("it", f"{tmp_path / 'bounded.py'}:Bounded")
    system.add("worded", hostile())  # its one parameter is a text
    (only,) = controls(system)
    assert (only["name"], only["low"], only["high"], only["kind"]) == ("it.level", 0.0, 1.0, "Real")


def test_what_presets_and_studies_change_comes_first(system):
    names = [control["name"] for control in controls(system)]
    assert names[:3] == ["lag[1].gain", "lag[2].gain", "course.c"]
    system.provenance.text = SCENARIO
    found = controls(system)
    assert [control["name"] for control in found[:2]] == ["lag.rate", "course.b"]
    assert [control["name"] for control in found if control["first"]] == [
        *("lag.rate", "course.b", "lag[1].gain", "lag[2].gain", "course.c"),
    ]
    assert "rank" not in found[0]
    assert "rank" not in found[-1]
