"""A checked system with other values: what is checked again is what a single run says."""

import pytest
from railcosim.orchestrator import System
from railcosim.orchestrator.errors import ScenarioError
from railcosim.orchestrator.fmi import Workspace
from railcosim.orchestrator.run import Revision, check, revision
from railcosim.orchestrator.scenario import changed
from railcosim.orchestrator.system import Connection, Event


@pytest.fixture
def system(mine):
    made = System(step=0.25, stop_time=1.0, events=[Event("a.rate", "set", 0.5, 2.0)])
    made.add("a", mine("Lag"), rate=2.0)
    made.add("b", mine("Noisy"))
    made.add("c", mine("Sampled"), sample_time=0.25)
    return made


@pytest.fixture
def checks(monkeypatch):
    """The systems that were checked as a whole."""
    seen = []

    def counted(system, *args):
        seen.append(system)
        return check(system, *args)

    monkeypatch.setattr(revision, "check", counted)
    return seen


def same(found, whole):
    assert found.system == whole.system
    assert (found.wiring.starts, found.wiring.left) == (whole.wiring.starts, whole.wiring.left)
    assert (found.wiring.links, found.order) == (whole.wiring.links, whole.order)


@pytest.mark.parametrize(
    ("one", "other", "count"),
    [
        ({"a.rate": 1.0}, {"a.rate": 3.0}, 2),
        ({}, {"simulation.seed": 3}, 2),
        ({"simulation.seed": 2}, {"simulation.seed": 3}, 2),
        ({"b.seed": 2}, {"b.seed": 3}, 2),
        ({"events[1].at": 0.25}, {"events[1].at": 0.75}, 2),
        ({"c.sample_time": 0.25}, {"c.sample_time": 0.125}, 3),
        ({"a.rate": 1.0, "a.gain": 2.0}, {"a.gain": 1.0, "a.rate": 1.0}, 3),
    ],
)
def test_only_what_may_differ_is_checked_again(system, checks, one, other, count):
    with Workspace() as workspace:
        revised = Revision(system, workspace, "plain")
        for changes in (one, other, one):
            same(revised.of(changes), check(changed(system, changes), workspace, "plain"))
        assert len(checks) <= count + 1


@pytest.mark.parametrize(
    "wrong",
    [
        {"a.rate": "no"},
        {"a.rate": [1.0, 2.0]},
        {"a.rate": float("inf")},
        {"events[1].value": "on"},
        {"c.sample_time": 1e-12},
    ],
)
def test_what_is_wrong_is_told_as_of_a_single_run(system, wrong):
    right = {"a.rate": 1.0, "events[1].value": 1.0, "c.sample_time": 0.25}
    with Workspace() as workspace:
        revised = Revision(system, workspace, "plain")
        revised.of({key: right[key] for key in wrong})
        with pytest.raises(ScenarioError) as caught:
            revised.of(wrong)
        with pytest.raises(ScenarioError) as single:
            check(changed(system, wrong), workspace, "plain")
    assert str(caught.value) == str(single.value)


def test_what_a_swapped_model_lacks_stays_left_out(system, mine, checks):
    system.instances["a"].swapped = True
    system.instances["a"].model = mine("Ramp")
    with Workspace() as workspace:
        revised = Revision(system, workspace, "plain")
        for changes in (
            {"a.rate": 3.0},
            {"a.rate": 4.0},
            {"a.rate": [4.0]},
            {"events[1].at": 0.1},
            {"events[1].at": 0},
        ):
            same(revised.of(changes), check(changed(system, changes), workspace, "plain"))
    assert len(checks) == 5


def test_sets_of_keys_are_remembered_but_not_for_ever(system, checks, monkeypatch):
    monkeypatch.setattr(revision, "_KEPT", 2)
    with Workspace() as workspace:
        revised = Revision(system, workspace, "plain")
        for changes in ({"a.rate": 3.0}, {"a.gain": 4.0}, {"a.gain": 5.0}, {"a.u": 4.0}, {"a.rate": 2.0}):
            revised.of(changes)
    assert len(checks) == 5


def test_when_there_are_which_connections_is_looked_at_anew(system, checks, workspace):
    system.connect("b.y", "a.u")
    system.events.append(Event("a.u", "connect", 0.25, source=Connection("c.y", "a.u")))
    revised = Revision(system, workspace, "plain")
    for at in (0.5, 0.75):
        ((since, _),) = revised.of({"events[2].at": at}).wiring.later
        assert since == at
    assert len(checks) == 3
    revised.of({"events[2].at": 0.75})
    assert len(checks) == 3
