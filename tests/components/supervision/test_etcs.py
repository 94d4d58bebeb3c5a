"""ETCS supervision: where it warns and brakes against limits computed otherwise; statuses, latches, releases."""

import pytest
from railcosim.components import ComponentError, EtcsSupervision
from railcosim.components.trains.etcs_brakes import FLIRT

from .test_etcs_curves import integrated

GRADIENTS = [(0.0, 0.0), (2000.0, -0.008), (3500.0, 0.005), (5000.0, 0.0)]
LINE = {
    "sections": [{"position": x, "gradient": g} for x, g in GRADIENTS],
    "speed_limits": [[0.0, 36.0], [4000.0, 22.0], [6000.0, 36.0]],
}
FLAT = {"sections": [{"position": 0.0}], "speed_limits": [[0.0, 36.0]]}
EXACT = {"odometer_offset": 0.0, "odometer_share": 0.0}
SAFE = [(0.0, 0.9 * 0.72), (20.0, 0.85 * 0.72), (40.0, 0.8 * 0.72), (60.0, 0.75 * 0.72)]
SERVICE = [(0.0, 0.55), (20.0, 0.5), (40.0, 0.45), (60.0, 0.4)]
# lowest gradient under 58.6 m of train, rotating mass 10 % (3.13.4)
BEGINS = [0.0, 2000.0, 3558.6, 5000.0]
ACCELERATIONS = [0.0, -9.81 * 0.008 / 1.1, 9.81 * 0.005 / 1.1, 0.0]
MASS = 122e3 * 1.1
KMH = 1.0 / 3.6


def place_where(rises, low, high, **values):
    """The position from which an output is what is asked for, by bisection."""
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if rises(EtcsSupervision(position=middle, **values).outputs()) else (middle, high)
    return high


def uncertainty(v):
    """f41 of SUBSET-041."""
    return (2.0 + 10.0 * max(v / KMH - 30.0, 0.0) / 470.0) * KMH


@pytest.mark.parametrize("speed", [25.0, 30.0, 35.0])
def test_limits_before_a_lower_speed_limit(speed):
    """EBI, SBI2, W, P and I from an EBD integrated by SciPy through 22 m/s + 7.5 km/h at 4000 m, over gradients."""
    bec = speed + uncertainty(speed)
    (ebd,) = integrated(SAFE, BEGINS, ACCELERATIONS, (4000.0, 22.0 + 7.5 * KMH), [bec])
    ebi = ebd - bec * 4.0
    sbi = ebi - speed * 3.0
    expected = {"I": sbi - speed * (4.0 + 9.0), "P": sbi - speed * 4.0, "W": sbi - speed * 2.0, "SBI": sbi, "EBI": ebi}
    values = {"line": LINE, "speed": speed, **EXACT}
    found = {
        "I": place_where(lambda out: out["status"] >= 1, 500.0, 4000.0, **values),
        "P": place_where(lambda out: out["status"] >= 2, 500.0, 4000.0, **values),
        "W": place_where(lambda out: out["traction_cutoff"], 500.0, 4000.0, **values),
        "SBI": place_where(lambda out: out["service_brake"], 500.0, 4000.0, **values),
        "EBI": place_where(lambda out: out["emergency_brake"], 500.0, 4000.0, **values),
    }
    assert found == pytest.approx(expected, abs=0.1)
    # what is shown agrees with where it is exceeded
    assert EtcsSupervision(position=expected["P"], **values).outputs()["permitted_speed"] == pytest.approx(
        speed, abs=1e-3
    )
    assert EtcsSupervision(position=expected["SBI"], **values).outputs()["service_speed"] == pytest.approx(
        speed, abs=1e-3
    )


@pytest.mark.parametrize("speed", [12.0, 30.0])
def test_limits_before_an_end_of_authority(speed):
    """SBI1 from the EoA's SBD, EBI from the EBD of the SvL 100 m further."""
    bec = speed + uncertainty(speed)
    (sbd,) = integrated(SERVICE, BEGINS, ACCELERATIONS, (3800.0, 0.0), [speed])
    (ebd,) = integrated(SAFE, BEGINS, ACCELERATIONS, (3900.0, 0.0), [bec])
    sbi = min(sbd - speed * 3.0, ebd - bec * 4.0 - speed * 3.0)
    values = {
        "line": LINE, "speed": speed, "has_authority": True, "end_of_authority": 3800.0, "supervised_location": 3900.0,
        **EXACT,
    }  # fmt: skip
    found = {
        "P": place_where(lambda out: out["status"] >= 2, 500.0, 3800.0, **values),
        "SBI": place_where(lambda out: out["service_brake"], 500.0, 3800.0, **values),
        "EBI": place_where(lambda out: out["emergency_brake"], 500.0, 3899.0, **values),
    }
    assert found == pytest.approx({"P": sbi - 4.0 * speed, "SBI": sbi, "EBI": min(ebd - bec * 4.0, 3800.0)}, abs=0.1)


def test_a_limit_of_authority_is_a_lower_speed_limit_there():
    values = {"speed": 25.0, **EXACT}
    loa = {"line": FLAT, "has_authority": True, "end_of_authority": 4000.0, "authority_speed": 10.0}
    fall = {"line": {**FLAT, "speed_limits": [[0.0, 36.0], [4000.0, 10.0]]}}
    for name in ("traction_cutoff", "service_brake", "emergency_brake"):
        places = [place_where(lambda out: out[name], 1000.0, 4000.0, **values, **case) for case in (loa, fall)]  # noqa: B023
        assert places[0] == pytest.approx(places[1], abs=1e-6)


def test_acceleration_and_speed_error_bring_the_limits_forward():
    values = {"line": LINE, "speed": 30.0}
    plain, pulling, trusted, late = (
        place_where(lambda out: out["emergency_brake"], 500.0, 4000.0, **values, **{**EXACT, **more})
        for more in ({}, {"acceleration": 0.6}, {"compensate_speed": False}, {"odometer_offset": 12.0})
    )
    assert pulling < plain - 30.0
    assert trusted > plain + 30.0
    assert late == pytest.approx(plain - 12.0, abs=1e-3)


def test_a_train_that_knows_its_speed_error():
    train = {**FLIRT, "etcs": {**FLIRT["etcs"], "speed_uncertainty": 0.0298}}
    exact, known = (
        place_where(
            lambda out: out["emergency_brake"],
            1000.0,
            6000.0,
            line=LINE,
            speed=30.0,
            train=t,
            compensate_speed=c,
            **EXACT,
        )
        for t, c in ((train, False), (train, True))
    )
    bec = 30.0 * 1.0298
    places = integrated(SAFE, BEGINS, ACCELERATIONS, (4000.0, 22.0 + 7.5 * KMH), [30.0, bec])
    assert exact == pytest.approx(places[0] - 120.0, abs=0.1)
    assert known == pytest.approx(places[1] - 4.0 * bec, abs=0.1)


@pytest.mark.parametrize(
    ("over", "status", "service", "emergency"),
    [
        (-0.1, 0, False, False),
        (0.5, 2, False, False),
        (1.3, 3, False, False),
        (1.7, 4, True, False),
        (2.2, 4, True, True),
    ],
)
def test_ceiling_speed_monitoring(over, status, service, emergency):
    """Table 5; margins of 36 m/s = 129.6 km/h: 4.653, 6.382 and 8.970 km/h."""
    limit = 20.0
    out = EtcsSupervision(
        line={**FLAT, "speed_limits": [[0.0, limit]]}, speed=limit + over, demanded_force=1e5
    ).outputs()
    assert (out["status"], out["service_brake"], out["emergency_brake"]) == (status, service, emergency)
    assert out["monitoring"] == 0
    assert not out["traction_cutoff"]
    deceleration = 0.9 if over > 2.0 and limit + over < 20.0 else 0.85
    expected = -MASS * (deceleration if emergency else 0.5) if service or emergency else 1e5
    assert out["force"] == pytest.approx(expected)


def test_a_higher_limit_counts_once_the_rear_has_passed():
    """58.6 m of train and 10 m of the position's error on either side."""
    line = {**FLAT, "speed_limits": [[0.0, 20.0], [1000.0, 30.0], [2000.0, 15.0]]}
    ten = {"odometer_offset": 10.0, "odometer_share": 0.0}
    speeds = [
        EtcsSupervision(line=line, position=x, **ten).outputs()["speed_limit"] for x in (1068.0, 1069.0, 1989.0, 1991.0)
    ]
    assert speeds == [20.0, 30.0, 30.0, 15.0]


def test_the_position_error_grows_from_balise_to_balise():
    out = [
        EtcsSupervision(
            line=FLAT, position=x, has_authority=True, end_of_authority=2000.0, supervised_location=2000.0, speed=20.0
        )
        for x in (1000.0, 1499.0)
    ]
    assert [x._front() for x in out] == pytest.approx([1005.0, 1499.0 + 5.0 + 0.05 * 499.0])


# ---------------------------------------------------------------- over time


class Ride:
    """A supervision that is sampled while a test says where the train is."""

    def __init__(self, running, **values):
        self.simulation = running(EtcsSupervision(**EXACT, **values))

    def at(self, step=0.1, **values):
        for name, value in values.items():
            self.simulation.set(name, value)
        self.simulation.step(step)
        return {
            name: self.simulation.get(name)
            for name in (
                "status",
                "monitoring",
                "service_brake",
                "emergency_brake",
                "traction_cutoff",
                "force",
                "tripped",
            )
        }


def test_brakes_are_held_until_the_tables_revoke_them(running):
    """Table 6: the service brake below the limit, the emergency brake at standstill."""
    ride = Ride(running, line=FLAT)
    assert ride.at(position=100.0, speed=37.9)["service_brake"]
    held = ride.at(position=110.0, speed=36.1)
    assert (held["service_brake"], held["status"]) == (True, 4)
    released = ride.at(position=120.0, speed=36.0)
    assert (released["service_brake"], released["status"]) == (False, 0)
    assert ride.at(position=130.0, speed=39.0)["emergency_brake"]
    assert ride.at(position=500.0, speed=1.0)["emergency_brake"]
    standing = ride.at(position=500.1, speed=0.0)
    assert (standing["emergency_brake"], standing["status"]) == (False, 0)


def test_an_emergency_brake_that_may_be_released_early(running):
    ride = Ride(running, line=FLAT, release_early=True)
    assert ride.at(position=130.0, speed=39.0)["emergency_brake"]
    assert ride.at(position=140.0, speed=36.5)["emergency_brake"]
    assert not ride.at(position=150.0, speed=35.9)["emergency_brake"]


def test_without_a_service_brake_the_emergency_brake_stands_in_and_is_revoked_like_it(running):
    """3.13.10.2.3 and 3.13.10.2.4."""
    ride = Ride(running, line=FLAT, service_available=False)
    out = ride.at(position=100.0, speed=37.9)
    assert (out["service_brake"], out["emergency_brake"]) == (False, True)
    assert not ride.at(position=120.0, speed=35.0)["emergency_brake"]


def test_target_speed_monitoring_from_the_indication_to_the_target(running):
    """Statuses rise, stay until revoked, and the monitoring ends where the target is passed (tables 12 and 16)."""
    ride = Ride(running, line=LINE)
    seen = [
        ride.at(position=x, speed=30.0, demanded_force=1e5) for x in (1000.0, 3110.0, 3380.0, 3440.0, 3500.0, 3590.0)
    ]
    assert [(out["monitoring"], out["status"]) for out in seen] == [(0, 0), (1, 1), (1, 2), (1, 3), (1, 4), (1, 4)]
    assert [out["traction_cutoff"] for out in seen] == [False, False, False, True, True, True]
    assert [out["force"] for out in seen[:4]] == [1e5, 1e5, 1e5, 0.0]
    slower = ride.at(position=3650.0, speed=21.9)  # below the target's speed: all is revoked but the emergency brake
    assert (slower["service_brake"], slower["traction_cutoff"], slower["monitoring"]) == (False, False, 1)
    assert ride.at(position=3999.0, speed=21.0)["monitoring"] == 1
    assert ride.at(position=4001.0, speed=21.0)["monitoring"] == 0


def test_a_warning_stays_until_the_permitted_speed_is_kept(running):
    ride = Ride(running, line=LINE)
    assert ride.at(position=3440.0, speed=30.0)["status"] == 3
    assert ride.at(position=3441.0, speed=29.95)["status"] == 3  # below the warning limit, above the permitted speed
    assert ride.at(position=3442.0, speed=26.0)["status"] == 1


def test_the_most_relevant_target_is_the_one_that_permits_least():
    line = {**FLAT, "speed_limits": [[0.0, 36.0], [3000.0, 30.0], [3200.0, 10.0]]}
    out = EtcsSupervision(line=line, position=2300.0, speed=34.0, **EXACT).outputs()
    assert (out["target_speed"], out["target_distance"]) == (10.0, 900.0)


def test_an_authority_that_moves_on_ends_target_speed_monitoring(running):
    ride = Ride(running, line=FLAT, has_authority=True)
    near = ride.at(position=1600.0, speed=25.0, end_of_authority=2500.0, supervised_location=2550.0)
    assert near["monitoring"] == 1
    assert ride.at(position=1602.0, speed=12.0)["monitoring"] == 1
    assert ride.at(position=1604.0, speed=12.0, end_of_authority=9000.0, supervised_location=9050.0)["monitoring"] == 0


def test_release_speed_monitoring(running):
    """Tables 13 and 14: from the start of RSM on only the release speed counts, by the emergency brake."""
    ends = {"has_authority": True, "end_of_authority": 2000.0, "supervised_location": 2100.0}
    ride = Ride(running, line=FLAT, release_speed=5.0)
    assert ride.at(position=1800.0, speed=10.0, **ends)["monitoring"] == 1
    slow = ride.at(position=1970.0, speed=4.9)
    assert (slow["monitoring"], slow["status"], slow["service_brake"]) == (2, 1, False)
    fast = ride.at(position=1975.0, speed=5.1)
    assert (fast["emergency_brake"], fast["service_brake"], fast["status"]) == (True, False, 4)
    assert ride.at(position=1978.0, speed=1.0)["emergency_brake"]
    assert not ride.at(position=1978.5, speed=0.0)["emergency_brake"]
    # without a release speed the same train is braked
    assert Ride(running, line=FLAT).at(position=1985.0, speed=4.9, **ends)["service_brake"]


def test_a_train_that_passes_its_authority_is_tripped(running):
    ride = Ride(running, line=FLAT, has_authority=True)
    ends = {"end_of_authority": 2000.0, "supervised_location": 2100.0}
    assert not ride.at(position=1999.9, speed=0.5, **ends)["tripped"]
    passed = ride.at(position=2000.1, speed=0.5)
    assert (passed["tripped"], passed["emergency_brake"]) == (True, True)
    standing = ride.at(position=2000.2, speed=0.0, end_of_authority=9000.0)
    assert (standing["tripped"], standing["emergency_brake"]) == (True, True)


def test_a_brake_is_never_weaker_than_the_controllers_and_holds_at_standstill():
    braked = {"line": FLAT, "speed": 38.0}
    assert EtcsSupervision(**braked, demanded_force=-3e5).outputs()["force"] == pytest.approx(-3e5)
    assert EtcsSupervision(**braked, demanded_force=1e5, intervene=False).outputs()["force"] == 1e5
    held = EtcsSupervision(line=FLAT, speed=0.0, position=10.0, hold_position=10.01, trip_latched=True).outputs()
    assert held["force"] == pytest.approx(MASS * 4.0 * 0.01)


def test_a_brake_too_weak_for_the_line_is_refused():
    with pytest.raises(ComponentError, match=r"EtcsSupervision: a brake of 0\.6\d* m/s2 does not slow .* at 500 m"):
        EtcsSupervision(line={"sections": [{"position": 0.0}, {"position": 500.0, "gradient": -0.14}]})
