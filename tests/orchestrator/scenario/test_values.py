"""Values changed in a system: the same system, and the same messages, as `--set` gives."""

from pathlib import Path

import numpy as np
import pytest
from railcosim.orchestrator import System
from railcosim.orchestrator.errors import ScenarioError
from railcosim.orchestrator.scenario import assignment, changed, is_structural
from railcosim.orchestrator.scenario.loading import loads

EXAMPLE = Path(__file__).with_name("two_trains.toml").read_text(encoding="utf-8")


def set_by_options(changes):
    return loads(EXAMPLE, "two.toml", settings=[assignment(key, value) for key, value in changes.items()])


@pytest.mark.parametrize(
    "changes",
    [
        {"cruise.alpha": 0.05},
        {"train[2].speed": 10, "train.speed": 20.0},
        {"train.speed": 20.0, "train[2].speed": 10},
        {"train.position": [2, 1.0]},
        {"cruise.alpha": "0.1 * i / count"},
        {"target.values": [1.0, 2.0], "target.values[2]": 3.0},
        {"simulation.seed": 7},
        {"events[1].at": 31.5, "events[1].value": np.float64(0.5), "events[2].value": 0.1, "events[1].every": 25},
        {"train.start.mass": np.float64(1e5)},
        {"events [ 1 ].action": "override"},
    ],
)
def test_changes_are_those_of_options(changes):
    system = loads(EXAMPLE, "two.toml")
    found = changed(system, changes)
    assert found == set_by_options(changes) != system
    assert found.provenance.modified
    assert [event.number for event in found.events] == [1, 1, 1, 2]


def test_an_event_may_be_changed_to_happen_to_other_signals():
    changes = {"events[1].signal": "train.speed", "events[1].at": 2.0}
    found = changed(loads(EXAMPLE, "two.toml"), changes).events
    assert found == set_by_options(changes).events
    assert [event.signal for event in found] == ["train[1].speed", "train[2].speed", "train[1].disturbance"]


def test_what_changes_nothing_is_no_modification():
    system = loads(EXAMPLE)
    assert changed(system, {}) is system
    assert not changed(system, {"train.speed": 80.0}).provenance.modified
    assert changed(changed(system, {"train.speed": 1.0}), {"train.mass": 2.0}).provenance.modified


@pytest.mark.parametrize(
    "changes",
    [
        {"trian.speed": 1.0},
        {"train[3].speed": 1.0},
        {"train.position": [1.0, 2.0, 3.0]},
        {"simulation.seed": 0.5},
        {"events[3].at": 1.0},
        {"events[1].signal": "trian.speed"},
        {"events[0].at": 1.0},
        {"events[1].att": 1.0},
        {"events[1].at": "soon"},
        {"events[2].duration": 1.0},
        {"train[i].speed": 1.0, "cruise[x].alpha": 2.0},
    ],
)
def test_what_is_wrong_is_told_as_of_options(changes):
    with pytest.raises(ScenarioError) as caught:
        changed(loads(EXAMPLE, "two.toml"), changes)
    with pytest.raises(ScenarioError) as by_options:
        set_by_options(changes)
    assert str(caught.value) == str(by_options.value)


def test_what_a_system_is_made_of_is_no_value():
    structural = ["preset", "cruise", "train[2]", "train.count", "cruise.component", "cruise[1].fmu", "train.isolate"]
    structural += ["cruise.build.x", "simulation.step", "simulation.algorithm"]
    assert all(map(is_structural, structural))
    assert not any(map(is_structural, ["train.speed", "train[2].start.count", "simulation.seed", "events[1].at"]))
    with pytest.raises(ScenarioError, match=r"^--set train.count=3: changes what a system is made of.*Runner do so$"):
        changed(loads(EXAMPLE), {"train.count": 3})


def test_systems_of_ones_own_are_changed_too():
    system = System(stop_time=1.0)
    for name in ("a", "b[2]"):
        system.add(name, "Lag", gain=1.0)
    found = changed(system, {"a.gain": 2.0, "b.gain": 3.0, "b[2].u": True})
    assert [one.start for one in found.instances.values()] == [{"gain": 2.0}, {"gain": 3.0, "u": True}]
    assert [one.start for one in system.instances.values()] == [{"gain": 1.0}] * 2


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.1, "0.1"), (True, "true"), ("i > 1", "i > 1"), ("1.5", '"1.5"'), ([1, 2.0], "[1, 2.0]"), (" x", '" x"')],
)
def test_an_assignment_is_read_as_what_was_meant(value, text):
    assert assignment("a.b", value) == f"a.b={text}"
