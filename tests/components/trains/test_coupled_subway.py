"""The subway train with spring-damper couplers: its modes, its balance of forces, and what is measured where."""

import numpy as np
import pytest
from railcosim.components import CoupledSubwayTrain, SubwayTrain, simulate

LEVEL = [{"position": 0.0}]
FREE = {"line": LEVEL, "davis_a": 0.0, "davis_b": 0.0, "davis_c": 0.0, "swing": 0.0}


def system_matrix(**values):
    """The linear part, column by column from the component's own derivatives."""
    columns = []
    for name in ("vehicle_position", "vehicle_speed"):
        for k in range(6):
            unit = [float(j == k) for j in range(6)]
            rates = CoupledSubwayTrain(**FREE, **values, **{name: unit}).derivatives()
            columns.append(np.concatenate([rates["vehicle_position"], rates["vehicle_speed"]]))
    return np.column_stack(columns)


def test_modes():
    """`docs/models/cailc_ato.md`, section 6: frequencies and damping ratios of the five coupler modes."""
    poles = np.linalg.eigvals(system_matrix())
    oscillating = sorted((p for p in poles if p.imag > 1e-3), key=abs)
    assert [abs(p) / (2 * np.pi) for p in oscillating] == pytest.approx([1.43, 2.81, 3.96, 4.80, 5.53], abs=0.006)
    assert [-p.real / abs(p) for p in oscillating] == pytest.approx([0.22, 0.44, 0.62, 0.75, 0.87], abs=0.006)


def test_couplers_neither_push_nor_pull_the_train_as_a_whole():
    rng = np.random.default_rng(2)
    train = CoupledSubwayTrain(**FREE, vehicle_position=rng.normal(size=6), vehicle_speed=rng.normal(size=6), force=5e4)
    masses = np.array([32939, 32957, 27090, 34050, 33785, 33474])
    assert masses @ train.derivatives()["vehicle_speed"] == pytest.approx(5e4, rel=1e-9)


@pytest.mark.long
def test_steady_traction_gives_the_tensions_of_a_rigid_train():
    """Once the modes have died out, every coupler carries what the rigid train's balance says."""
    train = CoupledSubwayTrain(**FREE)
    found = simulate(train, 8.0, 0.01, lambda t: {"trip_time": t, "force": 100e3})
    rigid = SubwayTrain(**FREE, couplers=[{}], force=100e3).outputs()
    assert found["coupler_force"][-1] == pytest.approx(rigid["coupler_force"], rel=1e-6)
    assert found["acceleration"][-1] == pytest.approx(100e3 / 194295.0, rel=1e-6)


def test_where_it_is_measured():
    values = {"vehicle_speed": [1.0, 2.0, 3.0, 4.0, 5.0, 6.0], "vehicle_position": [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]}
    masses = np.array([32939, 32957, 27090, 34050, 33785, 33474])
    expected = [11.0 / 3.0, masses @ np.arange(1.0, 7.0) / masses.sum(), 1.0]
    for measured_at, speed in enumerate(expected):
        out = CoupledSubwayTrain(measured_at=measured_at, **values).outputs()
        assert out["speed"] == pytest.approx(speed)
        assert out["position"] == pytest.approx(speed - 1.0)


@pytest.mark.parametrize("vehicles", [2, 4, 11])
@pytest.mark.long
def test_any_number_of_vehicles(vehicles):
    train = CoupledSubwayTrain(vehicles=vehicles, line=LEVEL)
    found = simulate(train, 2.0, 0.01, lambda t: {"trip_time": t, "force": 50e3})
    assert found["vehicle_speed"].shape == (201, vehicles)
    assert np.isfinite(found["coupler_force"]).all()
    assert found["speed"][-1] > 0.1


@pytest.mark.long
def test_the_train_stands_while_waiting():
    def inputs(t):
        return {"trip": 1 + (t >= 3.0 - 1e-9), "trip_time": t - 1.0 if t < 3.0 - 1e-9 else t - 5.0, "force": 150e3}

    found = simulate(CoupledSubwayTrain(), 4.0, 0.01, inputs)
    waiting = (found["time"] < 1.0) | (found["time"] > 3.015)
    assert not found["vehicle_position"][waiting].any()
    assert not found["vehicle_speed"][waiting].any()
    assert found["position"].max() > 1.0


def test_resistance_parameters_agree_with_the_rigid_train_at_equal_speeds():
    common = {"couplers": [{}], "position": 750.0, "speed": 15.0, "time": 60.0}
    rigid = SubwayTrain(**common).outputs()["resistance_parameters"]
    coupled = CoupledSubwayTrain(vehicle_position=750.0, vehicle_speed=15.0, time=60.0).outputs()
    assert coupled["resistance_parameters"] == pytest.approx(rigid, rel=1e-12)
    assert coupled["resistance"] == pytest.approx(rigid[0] + 15.0 * rigid[1] + 225.0 * rigid[2], rel=1e-12)
