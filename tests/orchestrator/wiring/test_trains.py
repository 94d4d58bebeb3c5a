"""Trains and their order are found in ports and connections, whoever made them."""

from pathlib import Path

import pytest
from railcosim.orchestrator.fmi.models import load_models
from railcosim.orchestrator.names import SignalName
from railcosim.orchestrator.scenario import load
from railcosim.orchestrator.system import System
from railcosim.orchestrator.wiring.resolution import wire
from railcosim.orchestrator.wiring.trains import Quantity, find_followings, find_trains

TOYS = Path(__file__).parents[2] / "toys.py"


def toy(name):
    return f"{TOYS}:{name}"


@pytest.fixture
def found(workspace):
    """Trains, and pairs with their gap, of a system."""

    def find(system):
        models = load_models(system, workspace, "plain")
        interfaces = {name: model.interface for name, model in models.items()}
        wiring = wire(system, interfaces)
        trains = find_trains(interfaces, wiring)
        pairs = find_followings(interfaces, wiring, {train.name for train in trains})
        return {train.name: train for train in trains}, {(x.ahead, x.behind): x.gap for x in pairs}

    return find


def platoon(count=2, train="PointMassTrain", names=("position", "speed", "force"), **controller):
    """Trains under the comfort law, each hearing the one ahead."""
    system, (position, speed, force) = System(), names
    for i in range(1, count + 1):
        system.add(f"train[{i}]", train)
        system.add(f"cruise[{i}]", "ComfortCruise", **({"has_ahead": i > 1} | controller))
        system.connect(f"train[{i}].{position}", f"cruise[{i}].position")
        system.connect(f"train[{i}].{speed}", f"cruise[{i}].speed")
        system.connect(f"cruise[{i}].force", f"train[{i}].{force}")
        if i > 1:
            system.connect(f"train[{i - 1}].{position}", f"cruise[{i}].ahead_position")
            system.connect(f"train[{i - 1}].{speed}", f"cruise[{i}].ahead_speed")
    return system


def gap(ahead, behind, weight=1.0):
    return Quantity(((SignalName.parse(ahead), weight), (SignalName.parse(behind), -weight)))


def test_a_platoon(found):
    trains, pairs = found(platoon(3))
    assert list(trains) == ["train[1]", "train[2]", "train[3]"]
    assert pairs == {
        ("train[1]", "train[2]"): gap("train[1].position", "train[2].position"),
        ("train[2]", "train[3]"): gap("train[2].position", "train[3].position"),
    }


def test_a_train_of_another_maker_by_its_port(found):
    trains, pairs = found(platoon(train=toy("Cart")))
    assert list(trains) == ["train[1]", "train[2]"]
    assert list(pairs) == [("train[1]", "train[2]")]


def test_a_train_of_another_maker_by_what_its_controller_reads(found):
    """Its place is in km, which the connection converts, and so does the gap."""
    trains, pairs = found(platoon(train=toy("Loco"), names=("place", "pace", "pull")))
    assert trains["train[2]"].speed == Quantity(((SignalName("train[2]", "pace"), 1.0),))
    assert pairs == {("train[1]", "train[2]"): gap("train[1].place", "train[2].place", 1000.0)}


def test_a_force_may_come_through_a_protection(found):
    system = System()
    system.add("ato", "PidAto")
    system.add("protection", "Protection")
    system.add("loco", toy("Loco"))
    for controller in ("ato", "protection"):
        system.connect("loco.place", f"{controller}.position")
        system.connect("loco.pace", f"{controller}.speed")
    system.connect("ato.force", "protection.demanded_force")
    system.connect("protection.force", "loco.pull")
    assert list(found(system)[0]) == ["loco"]


def test_what_is_read_but_not_driven_is_no_train(found):
    system = platoon(1)
    system.add("radio", "RadioLink")
    system.connect("train[1].position", "radio.sent_position")
    system.connect("train[1].speed", "radio.sent_speed")
    system.add("other", "ComfortCruise")
    system.connect("radio.position", "other.position")
    system.connect("radio.speed", "other.speed")
    assert list(found(system)[0]) == ["train[1]"]


def test_trains_that_do_not_hear_each_other_are_in_no_order(found):
    """Two laws side by side in one count: connected, and the flag is off."""
    assert found(platoon(2, has_ahead=False))[1] == {}
    trains, pairs = found(load("cruise_comparison"))
    assert len(trains) == 25
    assert ("train[5]", "train[6]") not in pairs
    assert len(pairs) == 20


def test_a_flag_that_something_drives_may_be_true(found):
    system = platoon(2, has_ahead=False)
    system.add("on", toy("Level"))
    system.connect("on.on", "cruise[2].has_ahead")
    assert list(found(system)[1]) == [("train[1]", "train[2]")]


def test_who_hears_the_one_behind_only(found):
    system = platoon(1)
    system.add("last", "PointMassTrain")
    system.connect("last.position", "cruise[1].behind_position")
    assert found(system)[1] == {}
    system.instances["cruise[1]"].start["has_behind"] = True
    assert found(system)[1] == {("train[1]", "last"): gap("train[1].position", "last.position")}


def test_radios_and_sensors_are_looked_through(found):
    pairs = found(load("degraded_radio"))[1]
    assert pairs[("train[1]", "train[2]")] == gap("train[1].position", "train[2].position")
    assert len(pairs) == 4
    system = platoon(2)
    system.add("sensor", "Sensor")
    system.connections = [c for c in system.connections if c.target != "cruise[2].position"]
    system.connect("train[2].position", "sensor.true_position")
    system.connect("sensor.position", "cruise[2].position")
    assert found(system)[1] == {("train[1]", "train[2]"): gap("train[1].position", "train[2].position")}


def test_a_gap_is_what_the_controller_reads(found):
    """An offset may stand for the length of the train ahead."""
    system = platoon(2)
    next(c for c in system.connections if c.target == "cruise[2].ahead_position").offset = -200.0
    assert found(system)[1][("train[1]", "train[2]")].offset == -200.0


def test_trains_of_carriages(found):
    """From tail to head; the virtual leader, which may be passed, is no train."""
    trains, pairs = found(load("fault_tolerant_cruise"))
    assert len(trains["train[1]"].speed.terms) == 3
    assert pairs == {
        (f"train[{i}]", f"train[{i + 1}]"): gap(f"train[{i}].tail_position", f"train[{i + 1}].position[1]")
        for i in (1, 2)
    }


def test_a_train_with_its_controller_inside(found, foreign, xml):
    v = xml["variable"]
    names = [v("position", "output"), v("speed", "output"), v("ahead_position", "input", start=0.0)]
    system = System()
    for name in "ab":
        system.add(name, foreign(names))
    system.connect("a.position", "b.ahead_position")
    assert found(system)[1] == {("a", "b"): gap("a.position", "b.position")}


def test_a_position_that_may_be_of_either_of_two_is_nobody_s(found):
    system = platoon(3)
    system.add("mean", toy("Affine"), gain=0.5)
    system.connections = [c for c in system.connections if c.target != "cruise[3].ahead_position"]
    system.connect("train[1].position", "mean.u")
    system.connect("train[2].position", "mean.w")
    system.connect("mean.y", "cruise[3].ahead_position")
    assert list(found(system)[1]) == [("train[1]", "train[2]")]
