"""`System` is the one description: instances by name, connections, start values."""

import pytest
from railcosim.orchestrator.system import Connection, Instance, System


def test_a_system_by_hand():
    system = System(stop_time=2.0)
    train = system.add("train[1]", "PointMassTrain", position=5.0, mass=2e5)
    ato = system.add("ato", "mine.py:Ato", {"carriages": 8}, gain=1.0)
    system.connect("ato.force", "train[1].force", delay=1, scale=2.0, offset=-1.0)
    assert list(system.instances) == ["train[1]", "ato"]
    assert (train.model, train.start, train.build) == ("PointMassTrain", {"position": 5.0, "mass": 2e5}, {})
    assert (ato.build, ato.start) == ({"carriages": 8}, {"gain": 1.0})
    assert system.connections == [Connection("ato.force", "train[1].force", 1, 2.0, -1.0)]


def test_two_instances_of_one_name_are_refused():
    system = System()
    system.add("train", "PointMassTrain")
    with pytest.raises(ValueError, match="already has an instance 'train'"):
        system.add("train", "Gust")


def test_where_something_was_written_does_not_make_it_another_thing():
    assert Instance("a", "Gust", origin="x.toml:3") == Instance("a", "Gust", origin="y.toml:9")
    assert Connection("a.y", "b.u", origin="x.toml:3") == Connection("a.y", "b.u")
    assert Connection("a.y", "b.u", delay=1) != Connection("a.y", "b.u")


def test_a_system_is_shown_in_a_line():
    system = System(stop_time=2.0, step=0.5)
    system.add("train", "PointMassTrain")
    assert repr(system) == "<System system: 1 instances, 0 connections, gauss-seidel, steps of 0.5 s up to 2 s>"
