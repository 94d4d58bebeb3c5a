"""The reference solution reproduces the numbers of `docs/models/tunable_potential.md`, sections 2 to 7.

They are the specification's own measurements with an independent implementation. The laws are reconstructions.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

LAWS = ("FixedDistanceCruise", "RangePotentialCruise", "TunablePotentialCruise")


@pytest.fixture(scope="module")
def runs(platoon):
    """All three laws over the three phases."""
    return {name: platoon.dop853(law, stop=6000.0) for name, law in platoon.LAWS.items()}


# ---------------------------------------------------------------- Table 4


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("FixedDistanceCruise", (442.0, 9.65, 0.276, 2.874)),
        ("RangePotentialCruise", (100.0, 0.370, 0.220, 2.377)),
        ("TunablePotentialCruise", (299.0, 6.88, 0.244, 1.933)),
    ],
)
def test_table_4(platoon, runs, name, expected):
    found = platoon.indices(runs[name])
    for value, wanted, tolerance in zip(found, expected, (3.0, 0.05, 0.003, 0.01), strict=True):
        assert value == pytest.approx(wanted, abs=tolerance)


def test_under_the_range_law_speeds_agree_before_the_target_is_reached_and_gaps_stay(platoon, runs):
    """Section 2.1: 80 s, before 100 s; 38 m from then on, nothing once speeds are equal."""
    run = runs["RangePotentialCruise"]
    agreed = platoon.agreement(run)
    assert agreed == 80.0
    assert platoon.indices(run)[0] == 100.0
    change = np.abs(run.gaps - run.gaps[round(agreed)])
    assert change[round(agreed) :].max() == pytest.approx(0.0380, abs=5e-5)
    assert np.abs(run.gaps[1999:] - run.gaps[1999]).max() < 1e-9


def test_the_gentler_gains(platoon):
    """Section 7: 377 s, no overshoot, +0.341 km, 0.868 m/s2."""
    convergence, speed, gap, acceleration = platoon.indices(platoon.dop853(platoon.COMFORT))
    assert convergence == pytest.approx(377.0, abs=3.0)
    assert speed <= 0.0
    assert gap == pytest.approx(0.341, abs=0.003)
    assert acceleration == pytest.approx(0.868, abs=0.01)


def test_the_published_ordering(platoon, runs):
    """Section 4: acceleration [17] > [20] > proposed; the other three [20] < proposed < [17]."""
    fixed, ranged, tunable = (platoon.indices(runs[name]) for name in LAWS)
    assert fixed[3] > ranged[3] > tunable[3]
    assert all(ranged[k] < tunable[k] < fixed[k] for k in range(3))


def test_an_adaptive_eighth_order_integrator_agrees(platoon):
    """Section 8: 299 s, 6.882 m/s, 0.2442 km."""
    convergence, speed, gap, _ = platoon.indices(platoon.dop853(platoon.TUNABLE))
    assert convergence == 299.0
    assert speed == pytest.approx(6.882, abs=5e-4)
    assert gap == pytest.approx(0.2442, abs=5e-5)


# ---------------------------------------------------------------- phases


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("FixedDistanceCruise", [[7.4] * 4] * 3),
        ("RangePotentialCruise", [[7.578, 7.392, 7.578, 7.289]] * 3),
        (
            "TunablePotentialCruise",
            [[7.389, 7.406, 7.408, 7.400], [6.788, 6.770, 6.765, 6.777], [7.380, 7.398, 7.403, 7.391]],
        ),
    ],
)
def test_gaps_at_the_end_of_each_phase(runs, name, expected):
    found = [runs[name].gaps[k] for k in (1999, 3999, 6000)]
    assert np.array(found) == pytest.approx(np.array(expected), abs=0.001)


@pytest.mark.parametrize(
    ("name", "settling", "peak"),
    [
        ("FixedDistanceCruise", 248.0, 0.033),
        ("RangePotentialCruise", 54.0, 0.152),
        ("TunablePotentialCruise", 684.0, 0.113),
    ],
)
def test_after_the_step_of_the_target_speed(platoon, runs, name, settling, peak):
    convergence, _, _, acceleration = platoon.indices(runs[name], 2000.0, 4000.0)
    assert convergence == pytest.approx(settling, abs=3.0)
    assert acceleration == pytest.approx(peak, abs=0.002)


def test_gaps_follow_the_target_speed_for_the_tunable_law_and_not_for_its_rivals(runs):
    """Section 5: by 0.60 to 0.64 km, always within delta of d*; the others by less than a micrometre."""
    change = {name: run.gaps[3999] - run.gaps[1999] for name, run in runs.items()}
    assert ((change["TunablePotentialCruise"] > -0.645) & (change["TunablePotentialCruise"] < -0.595)).all()
    assert np.abs(change["FixedDistanceCruise"]).max() < 1e-9
    assert np.abs(change["RangePotentialCruise"]).max() < 1e-9
    tunable = runs["TunablePotentialCruise"]
    for k in (1999, 3999, 6000):
        assert np.abs(tunable.gaps[k] - tunable.desired[k]).max() <= 0.05 + 1e-6


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    ("rate", "excess", "settled"), [(0.5, 5.0, 1282.0), (1.0, 6.0, 684.0), (2.0, 11.1, 406.0), (1e9, 48.8, 272.0)]
)
def test_why_the_rate_of_the_desired_gap_is_limited(platoon, rate, excess, settled):
    """Section 3: the excess over v_r after 2000 s."""
    run = platoon.dop853(platoon.TUNABLE.changed(gap_rate=rate), stop=4000.0)
    convergence, speed, _, _ = platoon.indices(run, 2000.0, 4000.0)
    assert speed == pytest.approx(excess, abs=0.05)
    assert convergence == pytest.approx(settled, abs=2.0)


# ---------------------------------------------------------------- tuning parameter


def random_starts(count=60, seed=1):
    """Section 6: gaps 6.7 to 8.1 km, speeds 10 to 75 m/s."""
    rng = np.random.default_rng(seed)
    gaps, speed = rng.uniform(6.7e3, 8.1e3, (count, 4)), rng.uniform(10.0, 75.0, (count, 5))
    return 57.3e3 - np.concatenate([np.zeros((count, 1)), np.cumsum(gaps, axis=1)], axis=1), speed


TUNING = {  # delta: standard deviation, mean spread in one run, largest spread; km
    0.0: (0.0, 0.0, 0.0),
    0.02: (0.013, 0.013, 0.030),
    0.05: (0.031, 0.034, 0.079),
    0.10: (0.064, 0.082, 0.176),
    0.20: (0.136, 0.166, 0.353),
    0.30: (0.173, 0.278, 0.560),
}


@pytest.mark.long
def test_the_tuning_parameter_sets_the_range_of_stable_gaps(platoon):
    """The table of section 6, all starts and tolerances at once: the reachable range is exactly 7.4 km +- delta."""
    x, v = random_starts()
    deltas = np.array(list(TUNING))[:, None, None]
    shape = (len(TUNING), *x.shape)
    law = platoon.TUNABLE.changed(delta=deltas)
    run = platoon.march(law, np.broadcast_to(x, shape), np.broadcast_to(v, shape), report=200.0)
    for delta, gaps, expected in zip(TUNING, run.gaps[-1], TUNING.values(), strict=True):
        spread = np.ptp(gaps, axis=1)
        assert gaps.min() == pytest.approx(7.4 - delta, abs=5e-4)
        assert gaps.max() == pytest.approx(7.4 + delta, abs=5e-4)
        assert [gaps.std(), spread.mean(), spread.max()] == pytest.approx(expected, abs=6e-4)
    assert np.abs(run.v[-1] - 70.0).max() < 5e-4


@pytest.mark.long
def test_the_spread_of_one_run_need_not_grow_with_it(platoon):
    """Section 6, from the article's start."""
    found = [platoon.dop853(platoon.TUNABLE.changed(delta=d)).gaps[-1] for d in (0.05, 0.1, 0.15, 0.2)]
    assert [np.ptp(gaps) for gaps in found] == pytest.approx([0.019, 0.108, 0.081, 0.033], abs=1e-3)


@settings(max_examples=3, deadline=None)
@given(st.integers(2, 10**6), st.sampled_from([0.02, 0.05, 0.1, 0.2, 0.3]))
@pytest.mark.long
def test_stable_gaps_are_within_the_tolerance_from_every_start(platoon, seed, delta):
    """The domain of section 6: gaps 6.7 to 8.1 km, speeds 10 to 75 m/s; forty starts at a time."""
    run = platoon.march(platoon.TUNABLE.changed(delta=delta), *random_starts(40, seed), step=0.5, report=200.0)
    assert np.abs(run.gaps[-1] - 7.4).max() <= delta + 1e-4
    assert run.gaps.min() > 0.0


# ---------------------------------------------------------------- guarantees


@pytest.mark.parametrize("name", LAWS)
def test_the_lyapunov_sum_never_rises(platoon, name):
    """Section 7, constant v_r, no limit; with the geometric weights also for unequal coupling."""
    law = platoon.LAWS[name]
    run = platoon.dop853(law)
    w = platoon.lyapunov(law, run)
    assert (np.diff(w) <= 1e-6).all()
    e = run.v - 70.0
    weights = (law.rho * law.sigma) ** np.arange(5)
    relative = law.alpha * np.pad(-np.diff(e, axis=1), ((0, 0), (1, 1)))
    rate = (weights * e * (-law.k * e + relative[:, :-1] - law.rho * relative[:, 1:])).sum(axis=1)
    if name == "RangePotentialCruise":
        rate = rate - (weights * e * (platoon.resistance(run.v) - platoon.resistance(70.0))).sum(axis=1)
    trapezoid = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]))])
    assert w == pytest.approx(w[0] + trapezoid, rel=2e-3, abs=2.0)


@settings(max_examples=4, deadline=None)
@given(st.lists(st.floats(6.6, 7.9), min_size=4, max_size=4), st.lists(st.floats(50.0, 75.0), min_size=5, max_size=5))
@pytest.mark.parametrize("name", LAWS)
def test_it_never_rises_from_any_start(platoon, name, gaps, speed):
    law = platoon.LAWS[name]
    position = 57.3e3 - 1e3 * np.concatenate([[0.0], np.cumsum(gaps)])
    run = platoon.dop853(law, position, speed, stop=300.0)
    assert (np.diff(platoon.lyapunov(law, run)) <= 1e-6).all()
    if name == "RangePotentialCruise":
        assert 6.5 < run.gaps.min() < run.gaps.max() < 8.0


def test_with_a_hard_limit_it_does_rise(platoon):
    """Section 7: `TunablePotentialCruise`, limit 1 m/s2."""
    law = platoon.TUNABLE.changed(limit=1.0)
    assert np.diff(platoon.lyapunov(law, platoon.march(law, stop=300.0))).max() > 1.0


@pytest.mark.sample(2)
@pytest.mark.parametrize(
    ("name", "limit", "expected"),
    [
        ("FixedDistanceCruise", 1.5, (508.0, 13.5, 0.316)),
        ("FixedDistanceCruise", 1.0, (553.0, 14.0, 0.480)),
        ("FixedDistanceCruise", 0.8, (575.0, 11.5, 0.572)),
        ("TunablePotentialCruise", 1.5, (306.0, 8.3, 0.263)),
        ("TunablePotentialCruise", 1.0, (347.0, 17.0, 0.416)),
        ("TunablePotentialCruise", 0.8, (373.0, 17.5, 0.577)),
    ],
)
def test_what_a_hard_limit_costs(platoon, name, limit, expected):
    """The table of section 7."""
    found = platoon.indices(platoon.march(platoon.LAWS[name].changed(limit=limit), stop=1000.0), end=1000.0)
    for value, wanted, tolerance in zip(found, expected, (1.0, 0.06, 0.001), strict=False):
        assert value == pytest.approx(wanted, abs=tolerance)
