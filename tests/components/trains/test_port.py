"""What opposes a train's motion, for every train: coasting, braking, at rest, rolling back, on a slope, in a curve."""

import numpy as np
import pytest
from railcosim.components import (
    ComfortCruise,
    Consist,
    CoupledSubwayTrain,
    FixedDistanceCruise,
    PointMassTrain,
    RangePotentialCruise,
    SubwayTrain,
    TunablePotentialCruise,
    simulate,
)
from scipy.integrate import solve_ivp

C0, C1, C2 = 0.01176, 0.00077616, 0.00016
MASS = 400e3
LEVEL = [{"position": 0.0}]
STILL = {"line": LEVEL, "couplers": [{}]}
COUPLED = {"position": [0.0, -25.0, -50.0]}


def acceleration(**values):
    return PointMassTrain(**values).outputs()["acceleration"]


# ---------------------------------------------------------------- the point mass


def test_coasting_stops_where_the_closed_formula_says_and_stays():
    """Analytic: t = int dv/R, s = int v dv/R from 0 to 5 m/s. Runge-Kutta at 0.1 s errs by less than 1e-9 here."""
    root = (4.0 * C0 * C2 - C1**2) ** 0.5
    time = 2.0 / root * (np.arctan((2.0 * C2 * 5.0 + C1) / root) - np.arctan(C1 / root))
    resistance = C0 + C1 * 5.0 + C2 * 25.0
    distance = np.log(resistance / C0) / (2.0 * C2) - C1 / (2.0 * C2) * time
    found = simulate(PointMassTrain(speed=5.0), 400.0, 0.1)
    t, v, x, a = (found[name] for name in ("time", "speed", "position", "acceleration"))
    assert v.min() == 0.0
    assert (np.diff(v) <= 0.0).all()
    assert (v[t > time] == 0.0).all()
    assert (v[t < time] > 0.0).all()
    assert (a[t > time] == 0.0).all()
    assert x[-1] == pytest.approx(distance, abs=1e-7)
    assert np.interp(time - 1e-3, t, v) == pytest.approx(0.0, abs=1e-2)


@pytest.mark.parametrize("step", [0.05, 1.0, 7.0])
def test_a_braked_train_stops_inside_a_step_and_is_held(step):
    """Reference: DOP853 with an event, rtol 1e-13. 300 kN hold it, 0.75 N/kg, against the slope's 0.2."""
    inputs = {"force": -300e3, "line_resistance": 0.2}

    def rates(_, y):
        return [y[1], -0.75 - (C0 + C1 * y[1] + C2 * y[1] ** 2) - 0.2]

    def stop(_, y):
        return y[1]

    stop.terminal = True
    reference = solve_ivp(rates, (0.0, 100.0), [0.0, 20.0], "DOP853", events=stop, rtol=1e-13, atol=1e-13)
    found = simulate(PointMassTrain(speed=20.0, max_step=step), 42.0, step, inputs)
    time, distance = reference.t[-1], reference.y[0, -1]
    assert (found["speed"][found["time"] > time] == 0.0).all()
    assert (found["speed"][found["time"] < time] > 0.0).all()
    # The one sub-step that ends at the stop is as long as the others: its error falls with the fourth power.
    assert found["position"][-1] == pytest.approx(distance, abs=1e-9 + 1e-7 * step**4)


def test_what_brakes_is_not_what_drives():
    assert acceleration(force=-300e3) == 0.0
    assert acceleration(force=-300e3, speed=-2.0) == pytest.approx(0.75 + C0 + 2.0 * C1 + 4.0 * C2, rel=1e-14)
    assert acceleration(force=300e3, speed=-2.0) == acceleration(force=-300e3, speed=-2.0)


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ({}, 0.0),
        ({"force": 0.99 * C0 * MASS}, 0.0),
        ({"force": 40e3}, 0.1 - C0),
        ({"line_resistance": 0.99 * C0}, 0.0),
        ({"line_resistance": -0.99 * C0}, 0.0),
        ({"line_resistance": 0.1}, C0 - 0.1),
        ({"line_resistance": -0.1}, 0.1 - C0),
        ({"line_resistance": 0.1, "force": -0.1 * MASS}, 0.0),
        ({"line_resistance": 0.1, "force": -0.05 * MASS}, C0 - 0.05),
        ({"line_resistance": -0.1, "force": -0.1 * MASS}, 0.0),
        ({"line_resistance": 0.1, "force": 0.1 * MASS}, 0.0),
        ({"disturbance": -0.5}, C0 - 0.5),
        ({"disturbance": 0.5}, 0.5 - C0),
        # All of 0.1 N/kg is a curve: it holds either way, and nothing moves.
        ({"line_resistance": 0.1, "curve_resistance": 0.1}, 0.0),
        ({"line_resistance": 0.1, "curve_resistance": 0.1, "force": 0.11 * MASS}, 0.0),
        ({"line_resistance": 0.1, "curve_resistance": 0.1, "force": 0.2 * MASS}, 0.1 - C0),
        ({"line_resistance": 0.3, "curve_resistance": 0.1}, C0 - 0.1),
        # Starting resistance is overcome or not; what then acts is the resistance of motion.
        ({"starting_resistance": 0.05, "force": 0.0499 * MASS}, 0.0),
        ({"starting_resistance": 0.05, "force": 0.0501 * MASS}, 0.0501 - C0),
        ({"starting_resistance": 0.05, "line_resistance": 0.0499}, 0.0),
        ({"starting_resistance": 0.05, "line_resistance": 0.0501}, C0 - 0.0501),
        ({"starting_resistance": 0.5 * C0, "force": 0.75 * C0 * MASS}, 0.0),
        # Moving, starting resistance is gone, and a curve opposes the motion.
        ({"starting_resistance": 0.05, "speed": 1e-9}, -C0),
        ({"speed": -1e-9, "line_resistance": 0.1, "curve_resistance": 0.1}, C0 + 0.1),
    ],
)
def test_at_rest(values, expected):
    """By hand, in N/kg."""
    assert acceleration(**values) == pytest.approx(expected, rel=1e-7, abs=1e-15)


def test_a_free_train_rolls_back_and_a_gust_cannot_hold_it():
    """Analytic for c1 = c2 = 0: parabolas, -(r - c0) after the turn; the turn is inside a step."""
    train = PointMassTrain(c0=0.02, c1=0.0, c2=0.0, speed=1.0)
    found = simulate(train, 60.0, 0.7, {"line_resistance": 0.1})
    turn = 1.0 / 0.12
    t = np.minimum(found["time"], turn)
    rolling = np.maximum(found["time"] - turn, 0.0)
    assert found["speed"] == pytest.approx(1.0 - 0.12 * t - 0.08 * rolling, abs=1e-12)
    assert found["position"] == pytest.approx(t - 0.06 * t**2 - 0.04 * rolling**2, abs=1e-11)


@pytest.mark.parametrize("slope", [-0.1, -0.005, 0.0, 0.03])
@pytest.mark.parametrize("brake", [0.0, -6e3, -200e3])
def test_energy_is_never_gained_without_a_drive(slope, brake):
    """Kinetic and potential energy fall, whichever way the train runs, up to the rounding of their sum."""
    inputs = {"line_resistance": slope + 0.004, "curve_resistance": 0.004, "force": brake}
    for speed in (2.0, 0.0, -1.5):
        found = simulate(PointMassTrain(speed=speed, starting_resistance=0.02), 40.0, 0.5, inputs)
        energy = 0.5 * found["speed"] ** 2 + slope * found["position"]
        assert np.diff(energy).max() <= 1e-12 * np.abs(energy).max()


# ---------------------------------------------------------------- every train


def speeds(found):
    """All speeds there are, one column each."""
    columns = [found[name] for name in ("speed", "vehicle_speed") if name in found]
    return np.hstack([column.reshape(len(column), -1) for column in columns])


@pytest.mark.parametrize(
    ("train", "inputs", "seconds", "step"),
    [
        (Consist(**COUPLED, speed=[0.4, 0.4, 0.4]), {}, 50.0, 0.2),
        (Consist(**COUPLED, speed=[3.0, 2.0, 2.5]), {"force": [-100e3, 0.0, -50e3]}, 30.0, 0.1),
        (SubwayTrain(**STILL, speed=0.2, max_step=0.5), {}, 20.0, 0.5),
        (SubwayTrain(**STILL, speed=3.0, max_step=1.0), {"force": -150e3}, 12.0, 1.0),
        (SubwayTrain(speed=3.0, max_step=0.1), {"force": -150e3}, 8.0, 0.5),
        (
            SubwayTrain(**STILL, speed=3.0, max_step=0.1, limit_power=True, braking_power=1e5),
            {"force": -1e6},
            12.0,
            0.5,
        ),
        (
            CoupledSubwayTrain(vehicles=3, line=LEVEL, vehicle_speed=[1.0] * 3, max_step=0.01),
            {"force": -90e3},
            5.0,
            0.1,
        ),
    ],
)
def test_a_train_stops_and_stands(train, inputs, seconds, step):
    found = simulate(train, seconds, step, inputs)
    values = speeds(found)
    assert values.shape[1] > 1 or values.min() == 0.0  # couplers may push single vehicles back
    assert (values[-5:] == 0.0).all()
    assert (found["acceleration"][-5:] == 0.0).all()
    assert (values[0] > 0.0).all()


@pytest.mark.parametrize("kind", [SubwayTrain, CoupledSubwayTrain])
def test_a_subway_train_rolls_back_and_brake_and_curve_slow_it_down(kind):
    """By hand at one speed: 1.28 N/kN and so on of Davis, a slope of 0.3 N/kg, of which 0.1 is a curve's."""
    masses = np.array([32939, 32957, 27090, 34050, 33785, 33474])
    name = "speed" if kind is SubwayTrain else "vehicle_speed"
    build = STILL if kind is SubwayTrain else {"line": LEVEL}
    davis = 9.81e-3 * (1.28 + 0.0252 * 2.0 + 2.996e-4 * 4.0)
    line = {"line_resistance": 0.3, "curve_resistance": 0.1}
    for force, push in ((0.0, 0.0), (-50e3, 50e3), (50e3, 50e3)):
        train = kind(**build, **line, **{name: -2.0}, force=force)
        rates = np.broadcast_to(train.derivatives()[name], 6)
        # Motor cars have slightly other coefficients.
        expected = push / masses.sum() + davis - (0.3 - 2.0 * 0.1)
        assert np.average(rates, weights=masses) == pytest.approx(expected, abs=1e-4)
        assert train.outputs()["resistance"] == pytest.approx(-davis * masses.sum(), rel=1e-3)
    assert train.derivatives()["traction_energy"] == 0.0
    assert train.derivatives()["braking_energy"] == pytest.approx(100e3, rel=1e-9)


def test_a_brake_that_slows_down_a_train_rolling_back_takes_energy():
    train = SubwayTrain(**STILL, speed=-2.0, force=-50e3).derivatives()
    assert (train["traction_energy"], train["braking_energy"]) == (0.0, pytest.approx(100e3, rel=1e-12))


def test_starting_resistance_of_subway_trains():
    """4 N/kN of 194 295 kg are 7624 N; uncoupled, each vehicle is held by its own weight, and the trailers stay."""
    needed = 4e-3 * 9.81 * 194295.0
    for force, moves in ((0.999 * needed, False), (1.001 * needed, True)):
        train = SubwayTrain(**STILL, starting_resistance=4.0, force=force)
        assert (train.derivatives()["speed"] > 0.0) == moves
    loose = {"line": LEVEL, "coupler_stiffness": 0.0, "coupler_damping": 0.0}
    rates = CoupledSubwayTrain(**loose, starting_resistance=4.0, force=30e3).derivatives()["vehicle_speed"]
    assert [rate > 0.0 for rate in rates] == [False, True, False, True, True, False]


def test_the_couplers_of_a_train_that_is_held_carry_a_share_of_friction():
    """Held on a slope by its brakes: each vehicle uses the same part of what could hold it, and the sum is zero."""
    train = SubwayTrain(**STILL, force=-80e3, line_resistance=0.2)
    out = train.outputs()
    assert out["acceleration"] == 0.0
    masses = np.array([32939, 32957, 27090, 34050, 33785, 33474])
    capacity = np.array([1.0, 0.5, 0.4, 0.6, 1.0, 0.5]) * -np.array(out["vehicle_force"]) + masses * 9.81e-3 * 1.28
    share = 0.2 * masses.sum() / capacity.sum()
    assert out["coupler_force"] == pytest.approx(np.cumsum(share * capacity - 0.2 * masses)[:-1], rel=1e-3)


def test_a_carriage_is_held_by_its_own_brake():
    """Actuator forces in N on 80 t: what brakes holds, what drives moves, the slack couplers carry nothing."""
    train = Consist(**COUPLED, actuator_force=[-50e3, 900.0, 1000.0], disturbance=[-0.3, 0.0, 0.0])
    assert train.derivatives()["speed"] == [0.0, 0.0, pytest.approx(1000.0 / 80e3 - C0, rel=1e-9)]
    back = Consist(**COUPLED, speed=[-1.0] * 3, actuator_force=[-50e3, 50e3, 0.0]).derivatives()["speed"]
    friction = C0 + C1 + 1.6e-5
    assert back == pytest.approx([0.625 + friction, 0.625 + friction, friction], rel=1e-12)
    assert Consist(starting_resistance=0.05, actuator_force=[3.9e3] * 3, **COUPLED).derivatives()["speed"] == [0.0] * 3


# ---------------------------------------------------------------- what compensates it


@pytest.mark.parametrize("law", [ComfortCruise, FixedDistanceCruise, TunablePotentialCruise])
def test_a_controller_compensates_the_resistance_of_the_direction_of_travel(law):
    """The train then does what is demanded, forwards, rolling back, and when it sets off."""
    line = {"line_resistance": 0.06, "curve_resistance": 0.02}
    for speed in (20.0, 0.0, -0.5):
        out = law(speed=speed, target_speed=60.0, **line).outputs()
        train = PointMassTrain(speed=speed, force=out["force"], **line).outputs()
        assert out["demand"] > 0.1
        assert train["acceleration"] == pytest.approx(out["demand"], rel=1e-12)


def test_the_bound_of_a_law_that_compensates_another_speed_holds_when_rolling_back():
    law = RangePotentialCruise(
        speed=-1.0, target_speed=30.0, has_ahead=True, ahead_position=7250.0, guard=True, ahead_speed=0.0
    )
    out = law.outputs()
    train = PointMassTrain(speed=-1.0, force=out["force"]).outputs()
    assert train["acceleration"] == pytest.approx(out["demand"] + law._davis(30.0) - law._davis(-1.0), rel=1e-12)
