"""The predictive controller as a component: one sample by hand, and a train that follows another."""

import itertools

import pytest
from railcosim.components import DistributedMpc, Simulation

FOLLOWS = {"has_ahead": True, "speed": 40.0, "ahead_speed": 40.0, "target_speed": 50.0, "ahead_average": 40.0}
KEPT = 270.0 + 20.0 * 40.0


def after(step=0.1, **values):
    return DistributedMpc(**(FOLLOWS | {"ahead_position": KEPT} | values), step=step)


def drive(ahead, *, stop, told=None, step=0.1, **values):
    """A train behind one whose position and speed at a time are given; rows of gap, speed, demand."""
    train = Simulation(DistributedMpc(**values))
    train.initialize()
    train.start()
    x, v, rows = 0.0, values["speed"], []
    for k in range(round(stop / step)):
        position, speed = ahead(k * step)
        heard = {"position": x, "speed": v, "ahead_position": position, "ahead_speed": speed}
        if told:
            heard["ahead_plan"] = [told(k * step + 2.0 * n) for n in range(11)]
        for name, value in heard.items():
            train.set(name, value)
        a = train.get("demand")
        rows.append((position - x, v, a))
        train.step(step)
        x, v = x + step * v + 0.5 * step * step * a, v + step * a
    return rows, train


def test_in_equilibrium_nothing_is_done():
    rows, train = drive(lambda t: (KEPT + 40.0 * t, 40.0), stop=2.0, **FOLLOWS)
    assert max(abs(a) for *_, a in rows) < 1e-4
    assert train.get("plan") == pytest.approx([0.0] * 11, abs=1e-3)
    assert not any(train.get(name) for name in ("infeasible", "range_violated", "degraded"))


def test_the_force_is_that_of_the_demand_against_resistance():
    out = DistributedMpc(speed=30.0, target_speed=30.0, planned_demand=0.2).outputs()
    assert out["demand"] == out["bottom_demand"] == 0.2
    assert out["force"] == pytest.approx(400e3 * (0.2 + 0.01176 + 0.00077616 * 30.0 + 0.00016 * 900.0))


def test_the_first_train_reaches_the_target_within_its_limits():
    rows, _ = drive(lambda _: (0.0, 0.0), stop=20.0, speed=40.0, target_speed=50.0)
    demands = [a for *_, a in rows]
    assert max(demands) <= 0.6 + 1e-3
    assert max(abs(b - a) for a, b in itertools.pairwise(demands)) <= 0.05 + 1e-9
    assert rows[-1][1] > 43.0


def test_a_plan_is_answered_before_the_speed_shows_it():
    """The train ahead will brake by 0.5 m/s2 from 6 s on: with its plan the follower is at it before."""
    braking = {"ahead": lambda t: (KEPT + 40.0 * t - 0.25 * max(t - 6.0, 0.0) ** 2, 40.0 - 0.5 * max(t - 6.0, 0.0))}
    informed, _ = drive(**braking, stop=6.0, told=lambda t: -0.5 if t >= 6.0 else 0.0, has_plan=True, **FOLLOWS)
    guessing, _ = drive(**braking, stop=6.0, **FOLLOWS)
    assert informed[-1][2] < -0.03
    assert abs(guessing[-1][2]) < 1e-3


def test_without_a_plan_the_acceleration_that_speeds_show_goes_on():
    ahead, _ = DistributedMpc(**(FOLLOWS | {"ahead_position": KEPT, "ahead_average": 40.5}), ahead_age=0.5)._ahead()
    assert ahead.acceleration[0] == pytest.approx(-0.5)
    assert ahead.speed[1] == pytest.approx(40.0 - 0.5 * 2.5)


@pytest.mark.parametrize("has_plan", [True, False])
def test_the_time_in_which_the_train_ahead_was_not_heard_counts_as_braked(has_plan):
    """It ran at 40 m/s when last heard: by what it may have braked since it stops 800 m on, however old that is."""
    values = FOLLOWS | {"ahead_position": 1000.0, "ahead_age": 0.8, "has_plan": has_plan}
    follower = DistributedMpc(**values)
    stop = follower._problem(*follower._ahead()).stop
    assert stop == pytest.approx([1000.0 + 80.0 * k + 800.0 - 250.0 for k in range(1, 11)])


def test_a_plan_that_says_less_than_is_seen_is_not_relied_on():
    """Planned are 40 m/s, seen is braking by 0.5 m/s2: after two seconds the train ahead can stop that much earlier."""
    values = FOLLOWS | {"ahead_position": 1000.0, "ahead_average": 40.5, "has_plan": True}
    follower = DistributedMpc(**values)
    stop = follower._problem(*follower._ahead()).stop
    assert stop[0] == pytest.approx(1000.0 + 80.0 - 1.0 + 39.0**2 / 2.0 - 250.0)


def test_it_stops_behind_a_train_that_breaks_down():
    """It brakes by 1 m/s2, which no plan told, to a stand: the guard and the plan keep the gap at rest."""

    def ahead(t):
        return (1000.0 + 40.0 * t - 0.5 * t * t, 40.0 - t) if t < 40.0 else (1800.0, 0.0)

    rows, train = drive(ahead, stop=70.0, step=0.5, **FOLLOWS, has_plan=True)
    assert min(gap for gap, *_ in rows) > 249.0
    assert rows[-1][1] < 5.0
    assert train.get("degraded") is False


def test_traction_is_bounded_by_power():
    """2 MW at 40 m/s are 0.125 m/s2 for 400 t; resistance takes more than that."""
    rows, train = drive(
        lambda _: (0.0, 0.0), stop=12.0, speed=40.0, target_speed=60.0, power_limit=2e6, c2=0.0, c1=0.0, c0=0.05
    )
    forces = [400e3 * (a + 0.05) * v for _, v, a in rows]
    assert 1.9e6 < max(forces) < 2.02e6
    assert train.get("infeasible") is False


def test_a_problem_without_solution_is_told():
    _, train = drive(lambda _: (300.0, 0.0), stop=0.2, **FOLLOWS)
    assert train.get("infeasible") is True
    assert train.get("demand") == pytest.approx(-0.8)
