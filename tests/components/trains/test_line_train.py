"""A train on a line against an independent integration, and its energies against one another."""

import json
from pathlib import Path

import pytest
from railcosim import models
from railcosim.components import LineTrain, Simulation, simulate
from railcosim.components.environment.track import read_line
from railcosim.components.trains.rolling_stock import TRAIN
from scipy.integrate import solve_ivp

FOLDER = Path(models.__file__).parent
FLIRT = json.loads((FOLDER / "rolling_stock" / "flirt.json").read_text(encoding="utf-8"))
BERN = json.loads((FOLDER / "lines" / "fribourg_bern.json").read_text(encoding="utf-8"))
BERN["sections"] = BERN["sections"][:12]
TUNNEL = [{"position": 0.0}, {"position": 500.0, "tunnel": 900.0, "area": 24.0, "gradient": 0.004, "radius": 700.0}]


def force(t):
    return 150e3 if t < 30.0 else 0.0 if t < 50.0 else -80e3


@pytest.mark.parametrize("line", [BERN, TUNNEL], ids=["Bern", "tunnel"])
def test_motion_is_that_of_an_independent_integration(line):
    """LSODA to 1e-9; the line by what `Line` takes, which has its own tests."""
    track, stock = read_line(line), TRAIN.record(FLIRT)
    found = simulate(LineTrain(line=line, train=FLIRT, position=300.0), 60.0, 0.1, lambda t: {"force": force(t)})

    def rates(t, state):
        x, v = state
        met = track.mean_resistance(float(x), 58.6)[0]
        drag = track.mean(stock.tunnel_drags(track.areas), float(x), 58.6)
        davis = 2378.88 + 61.13394 * v + (6.0435072 + drag) * v * v
        return [v, (force(t) - davis - 122e3 * met) / (1.1 * 122e3)]

    state = [300.0, 0.0]
    for begin, end in ((0.0, 30.0), (30.0, 50.0), (50.0, 60.0)):
        solved = solve_ivp(rates, (begin, end - 1e-9), state, method="LSODA", rtol=1e-9, atol=1e-9, max_step=1.0)
        state = solved.y[:, -1]
    assert found["position"][-1] == pytest.approx(state[0], abs=1e-3)
    assert found["speed"][-1] == pytest.approx(state[1], abs=1e-4)


def test_energy_closes_on_a_line_with_slopes_and_curves_forwards_to_the_stand_and_back():
    line = [
        {"position": 0.0, "gradient": 0.01},
        {"position": 250.0, "gradient": 0.03, "end_radius": 400.0},
        {"position": 400.0, "gradient": 0.03, "radius": 400.0},
        {"position": 600.0, "gradient": -0.02},
    ]
    start = {"line": line, "train": FLIRT, "position": 100.0, "speed": 12.0}
    inputs = {"line_resistance": 0.01, "curve_resistance": 0.004, "disturbance": -0.02}
    found = simulate(LineTrain(**start), 60.0, 0.1, lambda t: inputs | {"force": 60e3 if t < 10.0 else 0.0})
    assert found["speed"].min() < -0.5  # it has rolled back
    turned = found["kinetic_energy"].max() + found["traction_energy"][-1]
    assert abs(found["energy_residual"]).max() < 1e-6 * turned
    assert abs(found["outer_energy"]).max() > 1e4
    braked = simulate(LineTrain(**start), 30.0, 0.1, lambda t: inputs | {"force": -100e3})
    assert braked["speed"][-1] == 0.0
    assert abs(braked["energy_residual"]).max() < 1e-6 * turned


def test_a_train_at_rest_is_held_by_what_it_must_overcome():
    def acceleration(**values):
        return LineTrain(train=FLIRT, **values).outputs()["acceleration"]

    assert acceleration(force=2378.0) == 0.0
    assert acceleration(force=2378.88 + 1.1 * 122e3) == pytest.approx(1.0)
    assert acceleration(force=1.1 * 122e3, starting_resistance=1.2) == 0.0
    assert acceleration(force=2e5, load=22e3) == pytest.approx((2e5 - 2378.88) / (1.1 * 122e3 + 22e3))
    assert acceleration(force=1e5, resistance_factors=[0.0, 1.0, 1.0]) == pytest.approx(1e5 / (1.1 * 122e3))


def test_it_makes_trips():
    train = Simulation(LineTrain(line=BERN, train=FLIRT, start_offset=50.0, load=1e3))
    train.initialize()
    train.set("trip_time", -1.0)
    train.start()
    for k in range(40):
        train.set("trip", 1 if k < 20 else 2)
        train.set("trip_time", 0.5 * ((k % 20) - 2))
        train.set("force", 1e5)
        train.step(0.5)
        if k % 20 < 1:
            assert (train.get("position"), train.get("speed"), train.get("traction_energy")) == (50.0, 0.0, 0.0)
            assert train.get("energy_residual") == pytest.approx(0.0, abs=1e-6)
    assert train.get("position") > 60.0
    assert abs(train.get("energy_residual")) < 1e-7 * train.get("traction_energy")
