"""The vehicles' table, and the share of each vehicle in a total force."""

import numpy as np
import pytest
from railcosim.components.trains.vehicles import SUBWAY, added, distribute, pattern
from railcosim.components.trains.vehicles import VEHICLES as TABLE

VEHICLES = TABLE.read(SUBWAY)
WEIGHTS = [v.weight for v in VEHICLES]
MOTORED = [v.motored for v in VEHICLES]


def test_the_train_of_the_source():
    assert added(v.mass for v in VEHICLES) == 194295.0
    assert [k for k, v in enumerate(VEHICLES, 1) if v.motored] == [2, 4, 5]


@pytest.mark.parametrize(
    ("force", "forces", "shares"),
    [
        (100e3, [0, 31.056, 0, 37.267, 62.112, 0], [0, 0.1553, 0, 0.2236, 0.6211, 0]),
        (
            -100e3,
            [-33.113, -16.556, -13.245, -19.868, -33.113, -16.556],
            [0.3311, 0.0828, 0.0530, 0.1192, 0.3311, 0.0828],
        ),
        (0.0, [0.0] * 6, None),
    ],
)
def test_distribution_of_the_specification(force, forces, shares):
    """The table of `docs/models/cailc_ato.md`, section 4.2."""
    found = distribute(force, WEIGHTS, MOTORED, [0.1] * 6)
    assert [f / 1e3 for f in found] == pytest.approx(forces, abs=5e-4)
    if shares:
        assert [mu * f / force for mu, f in zip(WEIGHTS, found, strict=True)] == pytest.approx(shares, abs=5e-5)


@pytest.mark.parametrize("force", [80e3, -80e3])
def test_the_forces_are_the_cheapest_that_add_up(force):
    """Lagrange: at the optimum q F / mu is the same for all vehicles that act, and the sum is the demand."""
    rng = np.random.default_rng(1)
    weights, cost = rng.uniform(0.3, 1.0, 7), rng.uniform(0.1, 2.0, 7)
    allowed = [True, False, True, True, False, True, False]
    found = np.array(distribute(force, weights, allowed, cost))
    assert weights @ found == pytest.approx(force, rel=1e-14)
    acting = np.array(allowed) if force > 0 else np.ones(7, bool)
    multipliers = (cost * found / weights)[acting]
    assert multipliers == pytest.approx(np.full(len(multipliers), multipliers[0]), rel=1e-12)
    assert not found[~acting].any()


def test_the_literal_reading_loses_almost_half_of_the_traction():
    """Eqs. 54-55 as printed: solved over all six vehicles, and the trailers' traction dropped: 0.5331 u arrives."""
    everyone = distribute(100e3, WEIGHTS, [True] * 6, [0.1] * 6)
    arriving = added(mu * f for mu, f, motored in zip(WEIGHTS, everyone, MOTORED, strict=True) if motored)
    assert arriving / 100e3 == pytest.approx(0.5331, abs=5e-5)


def test_no_vehicle_that_may_act_gives_no_force():
    assert distribute(1e3, [1.0, 1.0], [False, False], [1.0, 1.0]) == [0.0, 0.0]


def test_a_short_table_is_repeated_and_a_long_one_cut():
    assert pattern("abc", 5) == list("abcab")
    assert pattern("abc", 2) == list("ab")


@pytest.mark.parametrize(
    "rows",
    [
        "x",
        [],
        [{"mass": 1.0}],
        [{"mass": 0.0, "weight": 1.0, "motored": True}],
        [{"mass": 1.0, "weight": 1.0, "motored": 1}],
    ],
)
def test_unusable_vehicles_are_refused(rows):
    with pytest.raises(ValueError, match="vehicle"):
        TABLE.read(rows)
