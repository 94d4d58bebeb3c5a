"""The plan of a trip: the specification's reference trajectory, and plans that cannot be."""

import copy

import pytest
from railcosim.components.supervision.running_plan import PLAN, PLANS

PHASES = [  # t0, t1, x0, x1, v0, v1
    (0, 22.8049, 0, 221.715, 0, 19.44444),
    (26.0, 33.4778, 283.841, 439.628, 19.44444, 22.22222),
    (92.6074, 98.5, 1753.620, 1875.564, 22.22222, 19.16667),
    (111.0, 119.1722, 2115.147, 2284.267, 19.16667, 22.22222),
    (152.9590, 158.5, 3035.083, 3149.281, 22.22222, 18.99683),
    (165.1873, 190.0, 3276.319, 3512.0, 18.99683, 0),
]
POINTS = [
    (5, 8.766000, 3.96, 0.9), (20, 169.416, 17.46, 0.9), (30, 364.410952, 20.937778, 0.4),
    (60, 1029.010631, 22.222222, 0), (95, 1805.581281, 21.026667, -0.6), (105, 2000.146948, 19.166667, 0),
    (115, 2194.605911, 20.66, 0.4), (140, 2747.106053, 22.222222, 0), (155, 3079.546462, 21.120168, -0.7),
    (175, 3428.248296, 11.573333, -0.8), (189, 3511.875, 0.375, -0.75), (190, 3512, 0, 0),
]  # fmt: skip


@pytest.fixture(scope="module")
def plan():
    return PLANS.record(PLAN)


def test_phases(plan):
    """The table of `docs/models/cailc_ato.md`, section 3."""
    for t0, t1, x0, x1, v0, v1 in PHASES:
        begin, end = plan.profile.at(t0), plan.profile.at(t1)
        assert begin.position == pytest.approx(x0, abs=2e-3)
        assert end.position == pytest.approx(x1, abs=2e-3)
        assert (begin.speed, end.speed) == pytest.approx((v0, v1), abs=1e-5)
        assert end.acceleration == pytest.approx(0.0, abs=1e-4)


@pytest.mark.parametrize(("time", "position", "speed", "acceleration"), POINTS)
def test_check_values(plan, time, position, speed, acceleration):
    motion = plan.profile.at(float(time))
    assert motion[:3] == pytest.approx((position, speed, acceleration), abs=6e-7)


def test_the_solved_speed(plan):
    assert plan.profile.at(160.0).speed == pytest.approx(18.996834924925, abs=1e-11)


def test_jerk_and_acceleration_stay_within_their_bounds(plan):
    """Cubic pieces: jerk is one of three values, and the acceleration is largest at a breakpoint."""
    assert {abs(round(motion.jerk, 12)) for motion in plan.profile.motions} == {0.0, 0.75}
    assert max(abs(motion.acceleration) for motion in plan.profile.motions) == pytest.approx(0.9)


def test_speeds_may_be_given_in_either_unit():
    data = copy.deepcopy(PLAN)
    data["phases"][1] = {"begin": 26.0, "speed": 80.0 / 3.6, "acceleration": 0.4}
    assert PLANS.record(data).profile.at(60.0) == PLANS.record(PLAN).profile.at(60.0)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda d: d.pop("jerk"), "'jerk' must be a number in m/s3, not None"),
        (lambda d: d.update(phases=[]), "at least one"),
        (lambda d: d.update(phases=[{"begin": 0.0, "end": 1.0, "speed": 1.0, "acceleration": 1.0}]), "either 'begin'"),
        (lambda d: d["phases"][0].update(v=1.0), "phase 1"),
        (lambda d: d["phases"][0].update(acceleration="fast"), "must be a positive number"),
        (lambda d: d["phases"][1].update(begin=10.0), "ends at"),
        (lambda d: d["phases"][4].update(speed=19.0), "not at rest at 3512"),
        (lambda d: d["phases"].append({"begin": 0.0, "speed": "solve", "acceleration": 1.0}), "only one"),
        (lambda d: d.update(distance=9000.0), "no speed of the phase"),
        (lambda d: d.update(distance="far"), "must be a number"),
    ],
)
def test_plans_that_cannot_be(change, message):
    data = copy.deepcopy(PLAN)
    change(data)
    with pytest.raises(ValueError, match=message):
        PLANS.record(data)
