"""The fallback of the cruise controllers: what old data do, stage by stage (ours; the bound is that of Gipps 1981)."""

import itertools
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from railcosim.components import (
    ComfortCruise,
    DistributedMpc,
    FixedDistanceCruise,
    GuardedCruise,
    RangePotentialCruise,
    Simulation,
    TimeHeadwayCruise,
    TunablePotentialCruise,
)

LAWS = (
    ComfortCruise,
    DistributedMpc,
    FixedDistanceCruise,
    RangePotentialCruise,
    TimeHeadwayCruise,
    TunablePotentialCruise,
)
SCENE = {
    "position": 0.0,
    "speed": 70.0,
    "target_speed": 70.0,
    "has_ahead": True,
    "ahead_position": 7450.0,
    "ahead_speed": 68.0,
    "has_behind": True,
    "behind_position": -7300.0,
    "behind_speed": 71.0,
    "braking": 0.6,
    "guard": False,
}
"""Where a law has other defaults, these are meant."""


def safe_bound(gap, speed, ahead_speed):
    """By hand: the speed from which the train stops 250 m short of where the train ahead does."""
    b, ahead, reaction, rest = 0.6, 1.0, 1.0, 250.0
    stop = gap + ahead_speed**2 / (2 * ahead) - rest
    safe = -b * reaction + math.sqrt((b * reaction) ** 2 + 2 * b * max(stop, 0.0))
    return max(4.0 * (safe - speed) / reaction, -b)


def follow(law, silence, stop, step=0.1, **changes):
    """Demands and flags of a train behind one that runs at 68 m/s and is not heard for a while from the start on."""
    scene = SCENE | {"has_behind": False} | changes
    simulation = Simulation(law(**scene))
    simulation.initialize()
    simulation.start()
    x, v, demands, flags = 0.0, scene["speed"], [], []
    for k in range(round(stop / step)):
        t = k * step
        heard = 0.0 if t < silence else t
        heard_values = {"ahead_position": scene["ahead_position"] + 68.0 * heard, "ahead_age": t - heard}
        for name, value in ({"position": x, "speed": v} | heard_values).items():
            simulation.set(name, value)
        demands.append(a := simulation.get("demand"))
        flags.append(simulation.get("degraded"))
        x, v = x + v * step + 0.5 * a * step**2, v + a * step
        simulation.step(step)
    return demands, flags


# ---------------------------------------------------------------- fresh data


@pytest.mark.parametrize("law", LAWS)
@given(st.floats(0.0, 0.25), st.floats(0.0, 0.25), st.booleans())
def test_fresh_data_change_nothing_to_the_last_bit(law, ahead, behind, fallback):
    fresh = law(**SCENE).outputs()
    assert law(**SCENE, ahead_age=ahead, behind_age=behind, fallback=fallback).outputs() == fresh
    assert fresh["degraded"] is False


@pytest.mark.parametrize("law", LAWS)
def test_with_fresh_data_the_fallback_never_wakes(law):
    rates = law(**SCENE).derivatives()
    assert all(rates[name] == 0.0 for name in ("caution_ahead", "caution_behind", "caution_leader", "held_bound"))


@pytest.mark.parametrize("law", LAWS)
@given(st.floats(0.0, 1e6))
def test_switched_off_no_age_matters(law, age):
    ages = {"ahead_age": age, "behind_age": age, "leader_age": age, "has_leader": True, "leader_speed": 69.0}
    off = law(**(SCENE | ages | {"fallback": False, "guard": True})).outputs()
    assert off == law(**SCENE, has_leader=True, leader_speed=69.0, fallback=False).outputs()
    assert off["degraded"] is False


# ---------------------------------------------------------------- stage 1: extrapolation


@pytest.mark.parametrize("law", LAWS)
@given(st.floats(0.26, 0.99))
def test_older_data_are_extrapolated_at_the_speed_last_heard(law, age):
    old = law(**SCENE, ahead_age=age, behind_age=age).outputs()
    moved = {"ahead_position": 7450.0 + 68.0 * age, "behind_position": -7300.0 + 71.0 * age}
    assert old == law(**(SCENE | moved)).outputs()
    assert old["degraded"] is False


# ---------------------------------------------------------------- stage 2: the safe bound


@pytest.mark.parametrize("law", LAWS)
@given(st.floats(300.0, 20e3), st.floats(0.0, 100.0), st.floats(0.0, 100.0), st.floats(1.01, 1e3))
def test_with_data_too_old_the_demand_stays_below_the_safe_bound(law, gap, speed, ahead_speed, age):
    scene = SCENE | {"ahead_position": gap, "speed": speed, "ahead_speed": ahead_speed, "has_behind": False}
    out = law(**scene, ahead_age=age).outputs()
    moved = law(**(scene | {"ahead_position": gap + ahead_speed * age})).outputs()
    assert out["degraded"] is True
    # On what the train does: a law may compensate the resistance of another speed than the train's own.
    resistance = law(speed=speed)._davis(speed)
    does, would = (x["force"] / law().mass - resistance for x in (out, moved))
    assert does == pytest.approx(min(would, safe_bound(gap, speed, ahead_speed)), rel=1e-9, abs=1e-9)


def test_what_is_lost_already_is_answered_with_full_braking():
    out = TunablePotentialCruise(**(SCENE | {"ahead_position": 240.0, "ahead_speed": 0.0}), ahead_age=2.0).outputs()
    assert out["demand"] <= -0.6


@settings(max_examples=5, deadline=None)
@given(st.floats(10.0, 60.0), st.floats(0.0, 1.0), st.floats(0.5, 2.0))
def test_the_bound_stops_the_train_in_time(speed, share, b):
    """A train at the safe speed that keeps to the bound stops short of where the train ahead must have stopped."""
    ahead_speed = share * speed
    stop = speed**2 / (2 * b) + speed
    gap = stop - ahead_speed**2 / 2.0 + 250.0
    law = FixedDistanceCruise(
        has_ahead=True, ahead_position=gap, ahead_speed=ahead_speed, ahead_age=100.0, braking=b, target_speed=speed,
        speed=speed, k=0.0, alpha=0.0, gap_gain=0.0,
    )  # fmt: skip
    simulation = Simulation(law)
    simulation.initialize()
    simulation.start()
    x, v, step = 0.0, speed, 0.1
    for _ in range(4000):
        simulation.set("position", x)
        simulation.set("speed", v)
        a = simulation.get("demand")
        x, v = x + v * step + 0.5 * a * step**2, v + a * step
        simulation.step(step)
        if v <= 0.01:
            break
    assert x <= stop
    assert v < 0.5


# ---------------------------------------------------------------- stage 3: rejoining


def test_the_train_rejoins_without_a_jolt():
    """Forty seconds of silence, then fresh data: the demand goes on from where it was, and fades into the law's."""
    near = {"ahead_position": 2400.0, "gap_base": 2400.0, "gap_time": 0.0, "gap_braking": 1e9}
    demands, flags = follow(TunablePotentialCruise, 40.0, 400.0, **near)
    assert flags[:400] == [False] * 11 + [True] * 389
    assert not any(flags[400:])
    assert demands[399] == pytest.approx(-0.6, abs=0.02)
    assert max(abs(b - a) for a, b in itertools.pairwise(demands[399:])) < 0.05
    assert abs(demands[-1]) < 0.05
    careless, _ = follow(TunablePotentialCruise, 40.0, 60.0, **near, rejoin_time=0.1)
    assert max(abs(b - a) for a, b in itertools.pairwise(careless[399:])) > 0.5


def test_a_train_behind_that_is_silent_fades_out_and_in():
    """Its part of the demand: whole, then nearly nothing after ten seconds, and back within a minute."""

    def demand(simulation):
        return simulation.get("demand")

    alone = FixedDistanceCruise(**(SCENE | {"has_behind": False})).outputs()["demand"]
    simulation = Simulation(FixedDistanceCruise(**SCENE))
    simulation.initialize()
    simulation.start()
    whole = demand(simulation)
    simulation.set("behind_age", 5.0)
    assert simulation.get("degraded") is True
    for _ in range(200):
        simulation.step(0.1)
    assert demand(simulation) == pytest.approx(alone, abs=1e-3)
    simulation.set("behind_age", 0.0)
    assert demand(simulation) == pytest.approx(alone, abs=1e-3)
    for _ in range(900):
        simulation.step(0.1)
    assert demand(simulation) == pytest.approx(whole, abs=1e-3)


# ---------------------------------------------------------------- the guard


@given(st.floats(100.0, 5e3), st.floats(0.0, 100.0), st.floats(0.0, 100.0))
def test_the_guard_bounds_the_demand_at_all_times(gap, speed, ahead_speed):
    scene = SCENE | {"ahead_position": gap, "speed": speed, "ahead_speed": ahead_speed}
    free, guarded = (TunablePotentialCruise(**(scene | {"guard": guard})).outputs() for guard in (False, True))
    expected = min(free["demand"], safe_bound(gap, speed, ahead_speed))
    assert guarded["demand"] == pytest.approx(expected, rel=1e-9, abs=1e-9)
    assert guarded["degraded"] is False
    assert guarded["bottom_demand"] == free["bottom_demand"]


def test_a_train_without_one_ahead_needs_no_guard():
    scene = SCENE | {"has_ahead": False, "ahead_position": -1e300, "ahead_speed": 1e300}
    assert TunablePotentialCruise(**(scene | {"guard": True})).outputs() == TunablePotentialCruise(**scene).outputs()


def test_every_shipped_cruise_law_has_the_fallback():
    assert all(issubclass(law, GuardedCruise) for law in LAWS)
