"""The three laws of `docs/models/tunable_potential.md` against its sections 2 and 3, written anew in km."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from railcosim.components import (
    FixedDistanceCruise,
    PointMassTrain,
    RangePotentialCruise,
    Simulation,
    TunablePotentialCruise,
)

POSITION = (57.3e3, 49.8e3, 42.7e3, 35.3e3, 28.5e3)
SPEED = (68.0, 60.0, 45.0, 49.0, 12.0)
LAWS = (FixedDistanceCruise, RangePotentialCruise, TunablePotentialCruise)
GAINS = {
    FixedDistanceCruise: (0.0065, 0.037, 2.0 / 3.0),
    RangePotentialCruise: (0.008, 0.082, 1.0),
    TunablePotentialCruise: (0.0094, 0.035, 2.0 / 3.0),
}
NONSENSE = {"ahead_position": -1e300, "ahead_speed": 1e300, "behind_position": 1e300, "behind_speed": -1e300}


def pull(law, d, delta=0.05, w=0.2):
    """P(d) in m/s2, d in km."""
    if law is FixedDistanceCruise:
        return 7.7 * (d - 7.4)
    if law is RangePotentialCruise:
        return 1.23 * (max(d - 7.578, 0.0) / (8.0 - d) - max(7.27 - d, 0.0) / (d - 6.5))
    e = d - 7.4
    s = e - min(max(e, -delta), delta)
    return 2.3 * s / math.sqrt(s**2 + w**2)


def formula(law, position, speed, target=70.0):
    """Section 2: the demands b of all trains."""
    k, alpha, rho = GAINS[law]
    sigma = 0.345 if law is RangePotentialCruise else 1.0
    pairs = list(zip(position, position[1:], speed, speed[1:], strict=False))
    f = [(alpha * (v - w), pull(law, (x - y) / 1e3)) for x, y, v, w in pairs]
    ahead = [0.0, *(relative + field for relative, field in f)]
    behind = [*(rho * (relative + sigma * field) for relative, field in f), 0.0]
    return [k * (target - v) + a - b for v, a, b in zip(speed, ahead, behind, strict=True)]


def controllers(law, position=POSITION, speed=SPEED, **values):
    """One controller per train with all it hears; the end trains hear nonsense where there is no neighbour."""
    built = []
    for i in range(len(position)):
        heard = dict(NONSENSE)
        if i > 0:
            heard |= {"ahead_position": position[i - 1], "ahead_speed": speed[i - 1]}
        if i + 1 < len(position):
            heard |= {"behind_position": position[i + 1], "behind_speed": speed[i + 1]}
        ends = {"has_ahead": i > 0, "has_behind": i + 1 < len(position)}
        built.append(law(position=position[i], speed=speed[i], target_speed=70.0, **heard, **ends, **values))
    return built


def outputs(name, law, **values):
    return [controller.outputs()[name] for controller in controllers(law, **values)]


# ---------------------------------------------------------------- the formulas


@pytest.mark.parametrize("law", LAWS)
def test_demands_at_the_published_start(law):
    assert outputs("demand", law) == pytest.approx(formula(law, POSITION, SPEED), abs=1e-9)


def test_peak_of_the_consensus_law_is_the_start_of_train_5():
    """Section 4: 2.874 m/s2."""
    assert outputs("demand", FixedDistanceCruise)[-1] == pytest.approx(-2.874, abs=5e-4)


platoons = st.integers(2, 6).flatmap(
    lambda n: st.tuples(
        st.lists(st.floats(6.55e3, 7.95e3), min_size=n - 1, max_size=n - 1),
        st.lists(st.floats(0.0, 100.0), min_size=n, max_size=n),
    )
)


@pytest.mark.parametrize("law", LAWS)
@given(platoon=platoons)
def test_demands_against_the_formula_in_kilometres(law, platoon):
    gaps, speed = platoon
    position = [100e3]
    for gap in gaps:
        position.append(position[-1] - gap)
    expected = formula(law, position, speed)
    assert outputs("bottom_demand", law, position=position, speed=speed) == pytest.approx(expected, rel=1e-8, abs=1e-8)


@pytest.mark.parametrize("law", LAWS)
def test_the_force_compensates_line_and_running_resistance(law):
    """Sections 1 and 2: R at the own speed, for the range law at the target speed: it then has R(v_r) - R(v) left."""
    for controller, v in zip(controllers(law, mass=123e3, line_resistance=0.05), SPEED, strict=True):
        out = controller.outputs()
        at = 70.0 if law is RangePotentialCruise else v
        resistance = 0.01176 + 0.00077616 * at + 0.00016 * at**2
        assert out["force"] == pytest.approx(123e3 * (resistance + 0.05 + out["demand"]), rel=1e-13)
        train = PointMassTrain(speed=v, force=out["force"] * 400.0 / 123.0, line_resistance=0.05)
        left = resistance - (0.01176 + 0.00077616 * v + 0.00016 * v**2)
        assert train.outputs()["acceleration"] == pytest.approx(out["demand"] + left, abs=1e-12)


def test_the_range_law_gives_train_5_a_push_at_the_start():
    """Section 2: +0.806 m/s2."""
    out = controllers(RangePotentialCruise)[-1].outputs()
    acceleration = PointMassTrain(speed=12.0, force=out["force"]).outputs()["acceleration"]
    assert acceleration - out["demand"] == pytest.approx(0.806, abs=5e-4)


@given(st.floats(7.27e3, 7.578e3))
def test_inside_the_range_nothing_pulls_under_the_range_law(gap):
    """Section 2: gaps stay where they are once speeds agree."""
    law = RangePotentialCruise(has_ahead=True, ahead_position=gap, k=0.0, alpha=0.0)
    assert law.outputs()["demand"] == 0.0


@given(st.floats(-1e6, 1e6))
def test_the_range_laws_pull_restores_beyond_the_range_too(gap):
    law = RangePotentialCruise(has_ahead=True, ahead_position=gap, k=0.0, alpha=0.0)
    assert law.outputs()["demand"] * (gap - 7.4e3) >= 0.0


# ---------------------------------------------------------------- the tunable potential


@pytest.mark.parametrize(("target", "gap"), [(70.0, 7400.0), (65.0, 6767.857)])
def test_the_desired_gap_follows_the_target_speed(target, gap):
    """Section 3: d*(70) = 7.400 km, d*(65) = 6.768 km."""
    assert TunablePotentialCruise(target_speed=target).initial()["desired_gap"] == pytest.approx(gap, abs=1e-3)


@given(st.floats(-50.0, 50.0))
def test_within_the_tolerance_nothing_pulls(error):
    quiet = {"k": 0.0, "alpha": 0.0, "desired_gap": 7400.0}
    ahead = TunablePotentialCruise(has_ahead=True, ahead_position=7400.0 + error, **quiet)
    assert ahead.outputs()["demand"] == 0.0


@given(st.floats(-1e9, 1e9), st.floats(0.0, 1e3))
def test_the_pull_is_bounded_and_restores(gap, tolerance):
    """Section 3: |P| < kappa for every gap; no admissible initial interval is needed."""
    law = TunablePotentialCruise(
        has_ahead=True, ahead_position=gap, k=0.0, alpha=0.0, gap_tolerance=tolerance, desired_gap=7400.0
    )
    demand = law.outputs()["demand"]
    assert abs(demand) <= 2.3
    assert demand * (gap - 7400.0) >= 0.0


def desired_gap(rate, times, step=0.5):
    """The desired gap at some times after the target speed fell from 70 to 65 m/s."""
    simulation = Simulation(TunablePotentialCruise(target_speed=70.0, gap_rate=rate))
    simulation.initialize()
    simulation.start()
    assert simulation.get("desired_gap") == 7400.0
    simulation.set("target_speed", 65.0)
    found = []
    for _ in range(round(max(times) / step)):
        simulation.step(step)
        if any(math.isclose(simulation.time, t) for t in times):
            found.append(simulation.get("desired_gap"))
    return found


def test_the_desired_gap_moves_at_a_limited_rate():
    """Section 3: 1 m/s; it comes to rest with a time constant of 1 s."""
    early, late, end = desired_gap(1.0, (100.0, 600.0, 650.0))
    assert early == pytest.approx(7300.0, abs=1e-6)
    assert late == pytest.approx(6800.0, abs=1e-6)
    assert end == pytest.approx(1800.0 + 30.0 * 65.0 + 65.0**2 / 1.4, abs=1e-3)


def test_the_rate_limit_can_be_put_out_of_reach():
    assert desired_gap(1e9, (10.0,)) == pytest.approx([6767.857 + 632.143 * math.exp(-10.0)], abs=0.01)


# ---------------------------------------------------------------- limits, ranges, ends


@pytest.mark.parametrize("law", LAWS)
@given(limit=st.floats(0.01, 3.0))
def test_the_limit_clips_the_demand_and_nothing_else(law, limit):
    free, held = controllers(law), controllers(law, acceleration_limit=limit)
    for a, b in zip(free, held, strict=True):
        demand = a.outputs()["demand"]
        assert b.outputs()["demand"] == min(max(demand, -limit), limit)
        assert b.outputs()["bottom_demand"] == demand


@pytest.mark.parametrize("law", LAWS)
def test_a_missing_neighbour_contributes_nothing_whatever_its_values(law):
    alone = law(speed=60.0, target_speed=70.0)
    assert law(speed=60.0, target_speed=70.0, **NONSENSE).outputs() == alone.outputs()
    assert alone.outputs()["demand"] == pytest.approx(10.0 * GAINS[law][0], rel=1e-14)


@pytest.mark.parametrize("law", LAWS)
@given(st.floats(-1e3, 10e3), st.floats(-1e3, 10e3))
def test_range_violated(law, ahead, behind):
    """Section 7: the range law has a range; the others have no bound but that trains do not run through one another."""
    out = law(has_ahead=True, has_behind=True, ahead_position=ahead, behind_position=-behind).outputs()
    inside = (lambda d: 6.5e3 < d < 8e3) if law is RangePotentialCruise else (lambda d: d > 0.0)
    assert out["range_violated"] is not (inside(ahead) and inside(behind))


@pytest.mark.parametrize("law", LAWS)
def test_a_leader_that_is_heard_draws_towards_its_speed(law):
    def demand(**more):
        return law(speed=60.0, target_speed=70.0, leader_speed=65.0, **more).outputs()["demand"]

    assert demand(has_leader=True) - demand() == pytest.approx(5.0 * GAINS[law][1], rel=1e-12)


@pytest.mark.parametrize("law", LAWS)
def test_the_label_stands_where_a_user_meets_the_law(law):
    assert "econstructed" in (law.__doc__ or "").splitlines()[0]
    assert law.note.startswith("Reconstructed")
    assert any("Reconstructed" in line for line in law.equations)


@pytest.mark.parametrize("law", LAWS)
@settings(max_examples=20)
@given(st.floats(0.0, 100.0))
def test_units_of_the_gains_are_not_shared(law, speed):
    """Section 9, 4: three units of kappa, three names: a swap cannot carry one into another."""
    own = {
        "FixedDistanceCruise": "gap_gain",
        "RangePotentialCruise": "field_gain",
        "TunablePotentialCruise": "pull_limit",
    }
    present = [name for name in own.values() if name in law.declarations]
    assert present == [own[law.__name__]]
    assert math.isfinite(law(speed=speed).outputs()["force"])
