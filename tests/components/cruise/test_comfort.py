"""The comfort cruise law against the numbers of `docs/models/comfort_cruise.md` and the formula written anew in km."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from railcosim.components import ComfortCruise, PointMassTrain, Simulation

GAINS = {"figure-consistent": 4.8 / 140.0, "as-stated": 0.01}
POSITION = (51e3, 34e3, 18e3, 1e3)
SPEED = (83.0, 61.0, 65.0, 5.0)
SLOPE_TABLE = {
    15.02: (-8.33, 0.005), 15.05: (-1.33, 0.005), 15.1: (-0.333, 5e-4), 15.3: (-0.037, 5e-4), 15.5: (-0.013, 5e-4),
    17.0: (-0.0006, 5e-5), 17.678: (0.0, 5e-6), 19.0: (0.002, 5e-4), 19.5: (0.010, 5e-4), 19.9: (0.25, 0.005),
    19.95: (1.00, 0.005),
}  # fmt: skip

NONSENSE = {"ahead_position": -1e300, "ahead_speed": 1e300, "behind_position": 1e300, "behind_speed": -1e300}


def controllers(position=POSITION, speed=SPEED, **values):
    """One controller per train with all it hears; the end trains hear nonsense where there is no neighbour."""
    built = []
    for i in range(len(position)):
        heard = dict(NONSENSE)
        if i > 0:
            heard |= {"ahead_position": position[i - 1], "ahead_speed": speed[i - 1]}
        if i + 1 < len(position):
            heard |= {"behind_position": position[i + 1], "behind_speed": speed[i + 1]}
        ends = {"has_ahead": i > 0, "has_behind": i + 1 < len(position)}
        own = {"position": position[i], "speed": speed[i], "target_speed": 85.0}
        built.append(ComfortCruise(**own, **heard, **ends, **values))
    return built


def outputs(name, **values):
    return [controller.outputs()[name] for controller in controllers(**values)]


def formula(position, speed, alpha, beta, gamma_km3):
    """Section 2 in kilometres, written from the page: demands of the bottom layer."""
    n, demands = len(position), []

    def slope(d):
        return -2 * d / (d**2 - 15.0**2) ** 2 + 2 * d / (20.0**2 - d**2) ** 2

    for i in range(n):
        b = alpha * (85.0 - speed[i])
        if i > 0:
            b += beta * (speed[i - 1] - speed[i]) + gamma_km3 * slope((position[i - 1] - position[i]) / 1e3)
        if i < n - 1:
            b += beta * (speed[i + 1] - speed[i]) - gamma_km3 * slope((position[i] - position[i + 1]) / 1e3)
        demands.append(b)
    return demands


# ---------------------------------------------------------------- numbers of the specification


@pytest.mark.parametrize(("gap_km", "expected"), SLOPE_TABLE.items())
def test_field_of_one_gap(gap_km, expected):
    """Section 2, table of gamma U': a gap ahead acts with its sign, a gap behind with the opposite one."""
    value, tolerance = expected
    ahead = ComfortCruise(alpha=0.0, beta=0.0, has_ahead=True, ahead_position=gap_km * 1e3)
    behind = ComfortCruise(alpha=0.0, beta=0.0, has_behind=True, behind_position=-gap_km * 1e3)
    assert ahead.outputs()["bottom_demand"] == pytest.approx(value, abs=tolerance)
    assert behind.outputs()["bottom_demand"] == pytest.approx(-value, abs=tolerance)


def test_the_field_vanishes_at_the_equilibrium_gap():
    """Section 5: d* = sqrt((15^2 + 20^2)/2) km."""
    gap = math.sqrt((15e3**2 + 20e3**2) / 2.0)
    controller = ComfortCruise(alpha=0.0, beta=0.0, has_ahead=True, ahead_position=gap)
    assert controller.outputs()["bottom_demand"] == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("figure-consistent", [-0.685, 1.717, -1.511, 4.799]),
        ("as-stated", [-0.199, 0.503, -0.443, 1.399]),
    ],
)
def test_initial_demand_of_the_bottom_layer(name, expected):
    """Section 3."""
    gains = {"alpha": GAINS[name], "beta": GAINS[name], "comfort_layer": False}
    assert outputs("demand", **gains) == pytest.approx(expected, abs=5e-4)
    assert outputs("bottom_demand", **gains) == outputs("demand", **gains)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("figure-consistent", [-0.595, 0.937, -0.907, 0.9999]),
        ("as-stated", [-0.197, 0.464, -0.416, 0.885]),
    ],
)
def test_initial_demand_after_the_comfort_layer(name, expected):
    """Section 3."""
    assert outputs("demand", alpha=GAINS[name], beta=GAINS[name]) == pytest.approx(expected, abs=5e-4)


def test_the_defaults_are_the_figure_consistent_gains():
    assert outputs("demand") == outputs("demand", alpha=4.8 / 140.0, beta=4.8 / 140.0, gamma=1e8, comfort_layer=True)


def test_by_hand_without_a_field():
    """b_4(0) = 80 alpha + 60 beta; b_2 = 24 alpha + (22 + 4) beta."""
    demand = outputs("demand", alpha=0.02, beta=0.03, gamma=0.0, comfort_layer=False)
    assert demand[3] == pytest.approx(80 * 0.02 + 60 * 0.03, rel=1e-14)
    assert demand[1] == pytest.approx(24 * 0.02 + 26 * 0.03, rel=1e-14)
    assert demand[0] == pytest.approx(2 * 0.02 - 22 * 0.03, rel=1e-14)


def test_the_force_compensates_the_resistance_at_the_own_speed_outside_the_tanh():
    """R(85) = 1.234 N/kg, so 493 kN at cruise; and force = m (R + demand) throughout."""
    cruising = ComfortCruise(speed=85.0, target_speed=85.0).outputs()
    assert cruising["demand"] == 0.0
    assert cruising["force"] == pytest.approx(493.49e3, abs=20.0)
    for controller in controllers(mass=123e3, line_resistance=0.04):
        out, v = controller.outputs(), controller.speed
        resistance = 0.01176 + 0.00077616 * v + 0.00016 * v**2
        assert out["force"] == pytest.approx(123e3 * (resistance + 0.04 + out["demand"]), rel=1e-14)


def test_a_train_under_the_force_moves_exactly_as_demanded():
    """Section 2: without gust dv/dt is the demand, on a slope too."""
    for controller in controllers(line_resistance=-0.03):
        out = controller.outputs()
        train = PointMassTrain(speed=controller.speed, force=out["force"], line_resistance=-0.03)
        assert train.outputs()["acceleration"] == pytest.approx(out["demand"], abs=1e-13)


# ---------------------------------------------------------------- the whole formula

trains = st.integers(2, 5).flatmap(
    lambda n: st.tuples(
        st.lists(st.floats(15.05e3, 19.95e3), min_size=n - 1, max_size=n - 1),
        st.lists(st.floats(0.0, 100.0), min_size=n, max_size=n),
    )
)
gain = st.floats(0.0, 0.1)


def positions(gaps):
    return [100e3 - float(x) for x in np.concatenate([[0.0], np.cumsum(gaps)])]


@given(trains, gain, gain, st.floats(0.0, 1.0))
def test_bottom_layer_against_the_formula_in_kilometres(line, alpha, beta, gamma_km3):
    """Reference: `formula` above; the component works in metres with gamma = gamma_km3 * 1e9."""
    position, speed = positions(line[0]), line[1]
    values = {"alpha": alpha, "beta": beta, "gamma": gamma_km3 * 1e9}
    expected = formula(position, speed, alpha, beta, gamma_km3)
    assert outputs("bottom_demand", position=position, speed=speed, **values) == pytest.approx(
        expected, rel=1e-9, abs=1e-9
    )


@given(trains, st.floats(0.1, 2.0))
def test_comfort_layer_against_the_formula(line, limit):
    position, speed = positions(line[0]), line[1]
    bottom = formula(position, speed, 0.02, 0.03, 0.1)
    expected = [limit * math.tanh(b / limit) for b in bottom]
    values = {"alpha": 0.02, "beta": 0.03, "acceleration_limit": limit}
    assert outputs("demand", position=position, speed=speed, **values) == pytest.approx(expected, rel=1e-9, abs=1e-9)


anything = st.floats(-1e9, 1e9)
heard = st.fixed_dictionaries(
    {
        **{f"{who}{what}": anything for who in ("", "ahead_", "behind_") for what in ("position", "speed")},
        "acceleration_limit": st.floats(0.01, 5.0),
        "has_ahead": st.booleans(),
        "has_behind": st.booleans(),
        "target_speed": st.floats(0.0, 100.0),
    }
)


@given(heard)
def test_the_demand_never_exceeds_the_comfort_limit(values):
    out = ComfortCruise(**values).outputs()
    assert abs(out["demand"]) <= values["acceleration_limit"]
    assert math.isfinite(out["force"])


# ---------------------------------------------------------------- ends, bounds, signs


def test_a_missing_neighbour_contributes_nothing_whatever_its_values():
    alone = ComfortCruise(speed=60.0, target_speed=85.0).outputs()
    nonsense = ComfortCruise(speed=60.0, target_speed=85.0, **NONSENSE).outputs()
    assert nonsense == alone
    assert alone["bottom_demand"] == pytest.approx(25.0 * 4.8 / 140.0, rel=1e-14)
    assert alone["range_violated"] is False


@pytest.mark.parametrize("gap", [15e3, 20e3, 15e3 + 1e-9, 20e3 - 1e-9, 0.0])
@pytest.mark.parametrize("side", ["ahead", "behind"])
def test_the_bounds_are_guarded(gap, side):
    """Section 9, 4: denominators no nearer to zero than 1e-6 km2; at the very bound 0.1 * 2 d / 1e-12."""
    sign = 1.0 if side == "ahead" else -1.0
    values = {f"has_{side}": True, f"{side}_position": sign * gap, "alpha": 0.0, "beta": 0.0}
    bottom = ComfortCruise(**values).outputs()["bottom_demand"]
    assert math.isfinite(bottom)
    if gap in (15e3, 20e3):
        assert sign * bottom == pytest.approx(0.1 * 2.0 * gap / 1e3 / 1e-12 * (1.0 if gap == 20e3 else -1.0), rel=1e-6)
    assert abs(ComfortCruise(**values).outputs()["demand"]) <= 1.0


@pytest.mark.parametrize(("gap", "violated"), [(15e3, True), (20e3, True), (15000.001, False), (19999.999, False)])
def test_the_range_is_open(gap, violated):
    assert ComfortCruise(has_ahead=True, ahead_position=gap).outputs()["range_violated"] is violated


@given(st.floats(10e3, 25e3), st.floats(10e3, 25e3), st.booleans(), st.booleans())
def test_range_violated_exactly_outside(ahead, behind, has_ahead, has_behind):
    out = ComfortCruise(
        ahead_position=ahead, behind_position=-behind, has_ahead=has_ahead, has_behind=has_behind
    ).outputs()
    outside = (has_ahead and not 15e3 < ahead < 20e3) or (has_behind and not 15e3 < behind < 20e3)
    assert out["range_violated"] is outside


@given(st.floats(15.01e3, 19.99e3))
def test_the_field_restores(gap):
    """Section 2: a gap ahead that is too long accelerates, one that is too short brakes; behind, the opposite."""
    too_long = gap > math.sqrt((15e3**2 + 20e3**2) / 2.0)
    quiet = {"alpha": 0.0, "beta": 0.0}
    ahead = ComfortCruise(has_ahead=True, ahead_position=gap, **quiet).outputs()["bottom_demand"]
    behind = ComfortCruise(has_behind=True, behind_position=-gap, **quiet).outputs()["bottom_demand"]
    assert (ahead >= 0.0) if too_long else (ahead <= 0.0)
    assert behind == pytest.approx(-ahead, rel=1e-12)


@pytest.mark.parametrize(("gap", "sign"), [(14.9e3, -1.0), (14e3, -1.0), (20.1e3, 1.0), (21e3, 1.0)])
def test_the_field_restores_beyond_the_bounds_too(gap, sign):
    """Section 5: after crossing U' keeps its sign and fades again."""
    demand = [
        ComfortCruise(has_ahead=True, ahead_position=g, alpha=0.0, beta=0.0).outputs()["bottom_demand"]
        for g in (gap, 17500.0 + 1.5 * (gap - 17500.0))
    ]
    assert sign * demand[0] > sign * demand[1] > 0.0


@given(trains)
def test_inner_terms_cancel_in_the_sum(line):
    """The consensus and the field act pairwise: the demands of the bottom layer add up to alpha sum(v_r - v)."""
    total = sum(outputs("bottom_demand", position=positions(line[0]), speed=line[1]))
    assert total == pytest.approx(4.8 / 140.0 * sum(85.0 - v for v in line[1]), abs=1e-6)


# ---------------------------------------------------------------- the loop


def run(position, speed, comfort, stop, step):
    """Controllers first, then trains with the force held; gives gaps and net accelerations at the steps."""
    n = len(position)
    cruise = [Simulation(c) for c in controllers(position, speed, comfort_layer=comfort)]
    train = [
        Simulation(PointMassTrain(position=x, speed=v, max_step=step)) for x, v in zip(position, speed, strict=True)
    ]
    for simulation in (*cruise, *train):
        simulation.initialize()
        simulation.start()
    gaps, accelerations = [], []
    for _ in range(round(stop / step)):
        x, v = [t.get("position") for t in train], [t.get("speed") for t in train]
        for i, c in enumerate(cruise):
            c.set("position", x[i])
            c.set("speed", v[i])
            for side, j in (("ahead", i - 1), ("behind", i + 1)):
                if 0 <= j < n:
                    c.set(f"{side}_position", x[j])
                    c.set(f"{side}_speed", v[j])
            train[i].set("force", c.get("force"))
        accelerations.append([t.get("acceleration") for t in train])
        for t in train:
            t.step(step)
        accelerations.append([t.get("acceleration") for t in train])
        gaps.append(-np.diff([t.get("position") for t in train]))
    return np.array(gaps), np.array(accelerations), [c.get("range_violated") for c in cruise]


starts = st.tuples(
    st.lists(st.floats(16.0e3, 19.0e3), min_size=3, max_size=3),
    st.lists(st.floats(70.0, 90.0), min_size=4, max_size=4),
)


@settings(max_examples=10, deadline=None)
@given(starts)
@pytest.mark.long
def test_the_bottom_layer_keeps_the_range(start):
    """Section 5: gaps that start inside stay inside; away from the walls also with the force held for 0.5 s."""
    gaps, _, violated = run(positions(start[0]), start[1], comfort=False, stop=200.0, step=0.5)
    assert gaps.min() > 15e3
    assert gaps.max() < 20e3
    assert not any(violated)


@settings(max_examples=10, deadline=None)
@given(
    st.lists(st.floats(15.1e3, 19.9e3), min_size=3, max_size=3), st.lists(st.floats(0.0, 100.0), min_size=4, max_size=4)
)
def test_the_comfort_layer_keeps_the_acceleration(gaps, speed):
    """Section 5: |dv/dt| <= a_max without gust, always, whatever the range does."""
    _, accelerations, _ = run(positions(gaps), speed, comfort=True, stop=100.0, step=0.5)
    assert np.abs(accelerations).max() <= 1.0 + 1e-12
