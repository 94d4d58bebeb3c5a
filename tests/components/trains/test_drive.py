"""Envelopes, blending, adhesion, build-up and energies of a drive, by hand."""

import math

import numpy as np
import pytest
from railcosim.components import (
    CATALOGUE,
    AtoController,
    CruiseController,
    Drive,
    LineTrain,
    PointMassTrain,
    Simulation,
    SubwayTrain,
    simulate,
)
from railcosim.components.trains.drive import LEAVES, WET

TRAIN = {
    "mass": 100e3,
    "traction": {"force": 120e3, "power": 1.2e6, "efficiency": 0.8},
    "regenerative_brake": {"force": 60e3, "power": 0.9e6, "efficiency": 0.5},
    "friction_brake": 50e3,
}
AT_ONCE = {"train": TRAIN, "electric_time": 0.0, "friction_time": 0.0}


@pytest.mark.parametrize(
    ("demanded", "speed", "electric", "friction"),
    [
        (50e3, 5.0, 50e3, 0.0),
        (500e3, 5.0, 120e3, 0.0),
        (500e3, 10.0, 120e3, 0.0),
        (500e3, 20.0, 60e3, 0.0),  # 1.2 MW
        (500e3, 0.0, 120e3, 0.0),
        (-40e3, 20.0, -40e3, 0.0),
        (-100e3, 10.0, -60e3, 40e3),  # the friction brake gives the rest
        (-100e3, 30.0, -30e3, 50e3),  # 0.9 MW, and all of the friction brake
    ],
)
def test_the_envelopes_by_hand(demanded, speed, electric, friction):
    found = Drive(**AT_ONCE, demanded_force=demanded, speed=speed, limit_adhesion=False).outputs()
    assert found == {
        "force": pytest.approx(electric - friction),
        "electric_force": pytest.approx(electric),
        "friction_force": pytest.approx(friction),
        "sliding": False,
    }


def test_what_the_regenerative_brake_cannot_the_friction_brake_does():
    def forces(**values):
        found = Drive(**AT_ONCE, demanded_force=-40e3, **values).outputs()
        return found["electric_force"], found["friction_force"]

    assert forces(speed=1.0, fade_speed=2.0) == (-20e3, 20e3)
    assert forces(speed=5.0, use_regeneration=False) == (0.0, 40e3)
    assert forces(speed=5.0, neutral=True) == (0.0, 40e3)
    assert Drive(**AT_ONCE, demanded_force=9e4, speed=5.0, neutral=True).outputs()["force"] == 0.0


def curtius_kniffler(speed):
    return 0.161 + 7.5 / (44.0 + 3.6 * speed)


@pytest.mark.parametrize(("position", "share"), [(50.0, 1.0), (100.0, WET), (250.0, LEAVES)])
def test_adhesion_by_place(position, share):
    rails = {"points": 3, "positions": [0.0, 100.0, 200.0], "adhesion": [1.0, WET, LEAVES], "position": position}
    limit = share * curtius_kniffler(8.0) * 100e3 * 9.81
    braking = Drive(**AT_ONCE, **rails, speed=8.0, demanded_force=-1e6).outputs()
    assert braking["force"] == pytest.approx(-min(limit, 110e3))
    assert braking["sliding"] == (limit < 110e3)
    assert braking["electric_force"] == pytest.approx(-min(60e3, limit))
    driving = Drive(**AT_ONCE, **rails, speed=8.0, demanded_force=1e6, driven_share=0.5).outputs()
    assert driving["force"] == pytest.approx(min(120e3, 0.5 * limit))


def test_forces_build_up_as_lags():
    drive = Drive(train=TRAIN, electric_time=0.5, friction_time=1.5, limit_adhesion=False)
    found = simulate(drive, 3.0, 0.1, {"speed": 10.0, "demanded_force": -100e3})
    # what is held over a step belongs to its begin
    expected = -60e3 * (1.0 - np.exp(-found["time"][:-1] / 0.5))
    assert found["electric_force"][1:] == pytest.approx(expected, abs=0.1)
    # the friction brake follows what is missing, 100 kN less the electric force, within 50 kN
    late = found["friction_force"][-1]
    assert 30e3 < late < 50e3
    assert found["friction_force"][10] < found["friction_force"][20] < late


def test_the_jerk_is_limited():
    drive = Drive(train=TRAIN, electric_time=0.0, jerk=0.5)
    found = simulate(drive, 3.0, 0.1, {"speed": 5.0, "demanded_force": 100e3})
    assert np.diff(found["force"]).max() == pytest.approx(0.5 * 100e3 * 0.1, rel=1e-9)
    assert found["force"][11] == pytest.approx(50e3, rel=1e-9)
    assert found["force"][-1] == pytest.approx(100e3, rel=1e-6)


@pytest.mark.parametrize(("dead_time", "samples"), [(0.0, 0), (0.2, 2), (0.29, 3), (9.0, 4)])
def test_the_dead_time_is_whole_samples_of_at_most_its_slots(dead_time, samples):
    drive = Simulation(Drive(**AT_ONCE, dead_time=dead_time, speed=5.0))
    drive.initialize()
    drive.start()
    forces = []
    for k in range(8):
        drive.set("demanded_force", 10e3 * (k + 1))
        drive.step(0.1)
        forces.append(drive.get("force"))
    expected = [10e3 * max(k + 1 - samples, 0) for k in range(8)]
    assert forces[samples:] == expected[samples:]
    assert forces[1:samples] == [0.0] * len(forces[1:samples]) or dead_time == 0.0


def run_together(controller, train, drive, feed):
    """Controller, drive and train in plain Python: each acts on values of the same instant."""
    parts = [Simulation(part) for part in (controller, drive, train)]
    for part in parts:
        part.initialize()
        part.start()
    one, two, three = parts
    forces, speeds = [], []
    step = 0.1
    for k in range(12):
        x, v = three.get("position"), three.get("speed")
        for name, value in feed(k * step, x, v).items():
            one.set(name, value)
        one.step(step)
        two.set("position", x)
        two.set("speed", v)
        two.set("demanded_force", one.get("force"))
        two.step(step)
        three.set("force", two.get("force"))
        three.step(step)
        forces.append(two.get("force"))
        speeds.append(v)
    return np.array(forces), np.array(speeds)


def test_the_energies_are_those_of_the_train_that_held_the_force():
    """Traction at the wheels is 0.8 of what is drawn; half of the braking comes back. Exact but for rounding."""
    train = LineTrain(train=TRAIN | {"length": 50.0})
    drive = Drive(train=TRAIN)

    def force(t):
        return 90e3 if t < 20.0 else -90e3

    parts = [Simulation(drive), Simulation(train)]
    for part in parts:
        part.initialize()
        part.start()
    two, three = parts
    for k in range(331):
        two.set("position", three.get("position"))
        two.set("speed", three.get("speed"))
        two.set("demanded_force", force(0.1 * k))
        two.step(0.1)
        if k < 330:  # the drive counts a step when it sees where it has led
            three.set("force", two.get("force"))
            three.step(0.1)
    drawn, back, heat = (two.get(f"{name}_energy") for name in ("drawn", "recovered", "friction"))
    net = three.get("traction_energy") - three.get("braking_energy")
    assert drawn * 0.8 - back / 0.5 - heat == pytest.approx(net, rel=1e-12)
    assert heat > 1e5  # where traction still dies down, both act
    assert abs(three.get("energy_residual")) < 1e-9 * drawn


def test_a_train_that_is_put_elsewhere_has_made_no_way():
    drive = Simulation(Drive(**AT_ONCE, position=1000.0, speed=10.0))
    drive.initialize()
    drive.start()
    drawn = []
    for position in (1000.0, 1001.0, 1002.0, 200.0, 201.0, 5000.0, 5001.0):
        drive.set("position", position)
        drive.set("demanded_force", 10e3)
        drive.step(0.1)
        drawn.append(drive.get("drawn_energy"))
    metre = drawn[1]
    assert metre > 0.0
    assert drawn == pytest.approx([0.0, metre, 2 * metre, 2 * metre, 3 * metre, 3 * metre, 4 * metre])


def test_a_way_that_is_told_late_counts_and_a_jump_then_does_not():
    """20 m/s and 10 kN, 0.8 of what is drawn, for 10 s; for one of them the position stands."""
    drive = Simulation(Drive(**AT_ONCE, speed=20.0, demanded_force=10e3))
    drive.initialize()
    drive.start()

    def after(position, speed=20.0):
        drive.set("position", position)
        drive.set("speed", speed)
        drive.step(0.1)
        return drive.get("drawn_energy")

    found = [after(2.0 * (40 if 40 < k <= 50 else k)) for k in range(101)]
    assert found[50] == found[40]
    assert found[100] == pytest.approx(200.0 * 10e3 / 0.8, rel=1e-12)
    frozen = [after(200.0) for _ in range(10)]  # not told again, and then it is put back
    assert {after(0.0), *frozen} == {found[100]}
    standing = [after(0.0, speed=0.0) for _ in range(100)]
    assert {after(30.0, speed=1.0), *standing} == {found[100]}


CONTROLLERS = sorted(
    name
    for name, kind in CATALOGUE.items()
    if issubclass(kind, AtoController | CruiseController) and not kind().slots["force"].shape
)


@pytest.mark.parametrize("name", CONTROLLERS)
def test_every_controller_meets_the_limits_with_any_train(name):
    """Whatever it asks for: a target far away, errors of every size."""
    rng = np.random.default_rng(7)
    inputs = [s for s in CATALOGUE[name]().slots.values() if type(s.declaration).__name__ == "Input"]

    def feed(t, x, v):
        wild = {"m": 20.0, "m/s": 5.0, "m/s2": 2.0, "N/kg": 0.1}
        values = {s.name: rng.normal() * wild.get(s.unit, 0.0) for s in inputs if s.type is float and not s.shape}
        values |= {"position": x, "speed": v, "target_speed": 90.0, "reference_speed": 90.0, "trip_time": t}
        return {s.name: values[s.name] for s in inputs if s.name in values}

    for train in (PointMassTrain(mass=100e3), SubwayTrain()):
        forces, speeds = run_together(CATALOGUE[name](), train, Drive(train=TRAIN), feed)
        most = np.minimum(120e3, 1.2e6 / np.maximum(abs(speeds), 0.1))
        least = np.minimum(60e3, 0.9e6 / np.maximum(abs(speeds), 0.1)) + 50e3
        assert (forces <= most * (1.0 + 1e-12)).all()
        assert (forces >= -least * (1.0 + 1e-12)).all()
        assert abs(forces).max() > 10.0
    assert len(CONTROLLERS) >= 9
    assert math.isfinite(forces[-1])
