"""integration.c: native trains come to rest as in plain Python, to the bit, also under inputs that move in a step."""

from pathlib import Path

import numpy as np
import pytest
from railcosim.components import Simulation
from railcosim.fmus.references import resolve
from railcosim.orchestrator import System, run

TRIP = {"trip": 1, "trip_time": 0.0}
LONG = pytest.mark.long
SAMPLES = Path(__file__).parent / "samples.py"
Swinging = resolve(f"{SAMPLES}:Swinging")


def signals(component, values, stop, step, kind):
    """A train's position, speed and the rest of its outputs over time."""
    system = System(stop_time=stop, step=step)
    system.add("train", component, **values)
    result = run(system, kind=kind)
    names = sorted(result.names(), key=lambda name: (name != "train.position", name != "train.speed", name))
    return np.array([result[name] for name in names])


@pytest.mark.parametrize(
    ("component", "values", "stop", "step"),
    [
        ("PointMassTrain", {"speed": 5.0, "force": -300e3}, 20.0, 1.0),
        ("PointMassTrain", {"speed": 5.0, "force": 0.0, "line_resistance": 0.05, "max_step": 0.7}, 119.0, 1.4),
        ("Consist", {"speed": [3.0, 2.0, 2.5], "position": [0.0, -25.0, -50.0], "force": [-1e5, 0.0, -5e4]}, 20.0, 0.1),
        pytest.param("SubwayTrain", {"speed": 2.0, "force": -150e3, "max_step": 0.05, **TRIP}, 4.0, 0.1, marks=LONG),
        pytest.param(
            *("CoupledSubwayTrain", {"vehicle_speed": [0.5] * 6, "force": -150e3, "max_step": 0.01, **TRIP}, 1.5, 0.1),
            marks=LONG,
        ),
    ],
)
def test_a_native_train_stops_as_in_plain_python(component, values, stop, step):
    plain, native = (signals(component, values, stop, step, kind) for kind in ("plain", "native"))
    assert (plain == native).all()
    assert (native[1:, -1] == 0.0).any()


def test_states_that_stop_again_and_again_come_to_an_end(load):
    """In the first step there would be a fifth stop, which is the end of it: where they are in plain Python."""
    fmu, plain = load(f"{SAMPLES}:Swinging").initialize(max_step=1.0), Simulation(Swinging(max_step=1.0))
    plain.initialize()
    plain.start()
    for _ in range(3):
        assert fmu.step(1.0) == 0
        plain.step(1.0)
        assert [fmu.get("v"), fmu.get("w")] == [plain.get("v"), plain.get("w")]


def test_a_block_stops_under_an_input_that_moves(load):
    """Analytic: v = 1 - t^3 / 3 under a force of -t^2, at rest at 1.44 s."""
    fmu = load(f"{SAMPLES}:Pushed").initialize(max_step=0.5)
    assert fmu.set_derivatives("force", 0.0, -2.0) == 0
    assert fmu.step(1.0) == 0
    assert fmu.get("v") == pytest.approx(2.0 / 3.0, abs=1e-15)
    assert fmu.set_derivatives("force", -2.0, -2.0) == 0
    assert fmu.step(1.0) == 0
    assert fmu.get("v") == 0.0


@pytest.mark.long
def test_a_train_coasts_to_rest_and_stays_in_every_kind():
    """2500 s from 5 m/s, at rest after 340 s: the resistance formula alone would drive it back to -15 000 m/s."""
    found = [
        signals("PointMassTrain", {"speed": 5.0, "force": 0.0}, 2500.0, 0.1, k) for k in ("plain", "python", "native")
    ]
    for signal in found[1:]:
        assert (signal == found[0]).all()
    speed = found[0][1]
    assert speed.min() == 0.0
    assert (speed[3410:] == 0.0).all()
