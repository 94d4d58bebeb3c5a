"""The protection against a controller that gives full traction: too fast is braked within one sample."""

import numpy as np
import pytest
from railcosim.components import Protection
from railcosim.fmus.build import native_problem
from railcosim.orchestrator.run.execution import run
from railcosim.orchestrator.system import System

pytestmark = pytest.mark.skipif(bool(native_problem(Protection)), reason="many steps take minutes without native FMUs")
STEP, FORCE = 0.01, 300e3


def full_traction(*, intervene=True, stop=140.0, **plant):
    """Timetable, protection and train; the force that the protection is asked to pass on is always the same."""
    system = System(stop_time=stop, step=STEP)
    system.add("timetable", "Timetable")
    system.add("protection", "Protection", intervene=intervene, demanded_force=FORCE)
    system.add("train", "SubwayTrain", **plant)
    for name in ("trip", "trip_time"):
        system.connect(f"timetable.{name}", f"train.{name}")
    system.connect("timetable.trip_time", "protection.trip_time")
    for name in ("position", "speed"):
        system.connect(f"train.{name}", f"protection.{name}")
    system.connect("protection.force", "train.force")
    return run(system)


@pytest.mark.parametrize(
    "plant",
    [
        {},
        {"load_factor": 1.2},
        {"load_factor": 0.8},
        {"limit_adhesion": True, "adhesion": 0.1},
        {"disturbance_size": 0.05, "disturbance_hold": 0.5},
    ],
)
def test_too_fast_is_braked_within_a_sample_and_the_overspeed_is_bounded(plant):
    result = full_traction(**plant)
    overspeed, brake = result["protection.overspeed"], result["protection.service_brake"].astype(bool)
    assert (overspeed > 0.0).any()
    # Both are outputs of one sample: whenever it is too fast the brake is called for, at once.
    assert brake[overspeed > 0.0].all()
    # One sample of acceleration at most, for the brake acts from the sample on that sees it.
    assert overspeed.max() <= result["train.acceleration"].max() * STEP * 1.001
    first = int(np.argmax(brake))
    assert brake[first:].all()
    assert (result["protection.force"][first:] != FORCE).all()
    assert abs(result["train.speed"][-1]) < 0.03
    assert np.ptp(result["train.position"][-1000:]) < 0.05


@pytest.mark.long
def test_a_brake_that_is_too_weak_is_followed_by_the_emergency_brake():
    """A wet rail on a falling gradient: the service brake loses, and the stronger one is called for."""
    falling = [{"position": 0.0}, {"position": 60.0, "gradient": -0.045}]
    system_values = {"limit_adhesion": True, "adhesion": 0.04, "build": {"line": falling}}
    result = full_traction(**system_values, stop=90.0)
    overspeed = result["protection.overspeed"]
    emergency = result["protection.emergency_brake"].astype(bool)
    assert overspeed.max() > 0.5
    assert emergency[overspeed > 0.5].all()
    assert not emergency[: int(np.argmax(overspeed > 0.5))].any()


def test_switched_off_it_reports_and_does_not_brake():
    result = full_traction(intervene=False, stop=60.0)
    overspeed = result["protection.overspeed"]
    assert overspeed.max() > 5.0
    assert result["protection.service_brake"].astype(bool)[overspeed > 0.0].all()
    assert (result["protection.force"] == FORCE).all()
