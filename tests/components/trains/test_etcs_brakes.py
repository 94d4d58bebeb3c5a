"""Braking data for ETCS: factors, the conversion models, and what is refused."""

import pytest
from railcosim.components.trains.etcs_brakes import BRAKES, basic_deceleration, build_up_times

GAMMA = {"A_brake_emergency": [[0.0, 0.9], [20.0, 0.8]], "A_brake_service": [[0.0, 0.6]]}


def test_the_safe_deceleration_of_a_train_that_knows_its_brakes():
    """3.13.6.2.1.4 by hand: Kdry (Kwet + M_NVAVADH (1 - Kwet)) A."""
    brakes = BRAKES.record({**GAMMA, "K_dry_rst": 0.8, "K_wet_rst": 0.9, "T_be": 4.0, "T_bs": 3.0})
    assert dict(brakes.safe(0.0)) == pytest.approx({0.0: 0.648, 20.0: 0.576})
    assert dict(brakes.safe(0.5)) == pytest.approx({0.0: 0.684, 20.0: 0.608})
    assert brakes.times(58.6, 60.0) == ((4.0, 4.0), (3.0, 3.0))
    slippery = BRAKES.record({**GAMMA, "A_MAXREDADH": 0.85})
    assert slippery.safe(0.0) == ((0.0, 0.85), (20.0, 0.8))


def test_basic_deceleration_by_hand():
    """A.3.7 for 100 %: V_lim = 16.85 * 100^0.428 = 120.95 km/h, so the steps n = 1 and n = 2 are left out."""
    steps = basic_deceleration(100.0)
    assert [begin * 3.6 for begin, _ in steps] == pytest.approx([0.0, 120.9483, 150.0, 180.0], abs=1e-3)
    assert [a for _, a in steps] == pytest.approx([0.826, 0.6171, 0.5915, 0.58173])
    assert len(basic_deceleration(50.0)) == 6
    assert [begin * 3.6 for begin, _ in basic_deceleration(50.0)][1:] == pytest.approx(
        [16.85 * 50.0**0.428, 100.0, 120.0, 150.0, 180.0]
    )


def test_a_service_brake_is_that_of_at_most_135_per_cent():
    """A.3.7.1, where a published tool errs: the emergency brake has all of the percentage, the service brake not."""
    strong, limit = (BRAKES.record({"brake_percentage": p}) for p in (180.0, 135.0))
    assert strong.service == limit.service == basic_deceleration(135.0)
    assert strong.emergency == basic_deceleration(180.0)
    assert dict(strong.safe(0.7)) == pytest.approx({b: 0.63 * a for b, a in strong.emergency})
    stepped = BRAKES.record({"brake_percentage": 100.0, "Kv_int": [[0.0, 0.7], [30.0, 0.6]], "Kr_int": 1.0})
    assert dict(stepped.safe(0.0))[30.0] == pytest.approx(0.6 * 0.826)


@pytest.mark.parametrize(
    ("length", "freight", "g", "expected"),
    [
        (200.0, False, False, (2.30 + 0.17 * 16, 3.0 + 3.0 + 0.4, 1.2)),
        (600.0, True, False, (2.30 + 0.17 * 36, 3.0 + 2.77 * 6, 1.2)),
        (1200.0, True, False, (-0.4 + 19.2 + 0.03 * 144, 10.5 + 0.32 * 12 + 0.18 * 144, 1.2)),
        (300.0, True, True, (12.0 + 0.05 * 9, 3.0 + 2.77 * 4, 1.16)),
        (1000.0, True, True, (-0.4 + 16.0 + 3.0, 10.5 + 3.2 + 18.0, 1.16)),
    ],
)
def test_build_up_times_by_hand(length, freight, g, expected):
    """A.3.8 and A.3.9."""
    assert build_up_times(length, freight, g) == pytest.approx(expected)


def test_times_of_the_conversion_model():
    brakes = BRAKES.record({"brake_percentage": 80.0, "brake_position": "freight G"})
    (stop, other), (service_stop, service_other) = brakes.times(500.0, 27.0)
    assert (stop, other) == pytest.approx((1.1 * 13.25, 1.1 * 1.16 * 13.25))
    assert brakes.times(500.0, 27.0, 1.0)[0] == pytest.approx((13.25, 1.16 * 13.25))
    assert (service_stop, service_other) == pytest.approx((16.85, 1.16 * 16.85))


@pytest.mark.parametrize(
    ("change", "length", "max_speed"),
    [
        ({"brake_percentage": 25.0}, 100.0, 40.0),
        ({"brake_percentage": 90.0}, 100.0, 60.0),
        ({"brake_percentage": 90.0}, 950.0, 40.0),
        ({"brake_percentage": 90.0, "brake_position": "freight P"}, 1600.0, 25.0),
    ],
)
def test_a_train_beyond_the_conversion_model_is_refused(change, length, max_speed):
    with pytest.raises(ValueError, match=r"conversion model holds for brake percentages of 30 to 250"):
        BRAKES.record(change).times(length, max_speed)


@pytest.mark.parametrize(
    ("data", "said"),
    [
        ({}, "'brake_percentage' alone"),
        ({**GAMMA, "brake_percentage": 90.0}, "'brake_percentage' alone"),
        ({"A_brake_emergency": [[0.0, 0.9]]}, "'brake_percentage' alone"),
        ({**GAMMA, "A_brake_service": [[1.0, 0.6]]}, "begins at 0 m/s"),
        ({**GAMMA, "K_dry_rst": 80.0}, "another unit"),
    ],
)
def test_unusable_braking_data(data, said):
    with pytest.raises(ValueError, match=said):
        BRAKES.record(data)
