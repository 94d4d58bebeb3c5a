"""The timetable over a line: cycles, references and limits."""

import pytest
from railcosim.components import ComponentError, LineTimetable, ProfileTimetable, Simulation

SERVICE = {"acceleration": 1.0, "deceleration": 1.0, "jerk": 1.0, "margin": 2.0, "dwell": 5.0}
LINE = {
    "sections": [{"position": 0.0}],
    "speed_limits": [[0.0, 12.0], [150.0, 7.0]],
    "stops": [{"position": 0.0}, {"position": 100.0}, {"position": 200.0}],
}


def test_a_trip_goes_from_stop_to_stop_and_the_next_one_begins():
    timetable = Simulation(LineTimetable(line=LINE, train={"mass": 1e4}, service=SERVICE, sample_time=0.5, wait=2.0))
    timetable.initialize()
    timetable.start()
    rows = []
    for _ in range(200):
        timetable.step(0.5)
        rows.append({name: timetable.get(name) for name in ("trip", "trip_time", "reference_position", "speed_limit")})
    assert rows[0] == {"trip": 1, "trip_time": -1.5, "reference_position": 0.0, "speed_limit": 12.0}
    first = [row for row in rows if row["trip"] == 1]
    assert first[-1]["reference_position"] == 200.0
    halt = [row["trip_time"] for row in first if abs(row["reference_position"] - 100.0) < 1e-6]
    assert 4.5 <= halt[-1] - halt[0] <= 5.5
    assert {row["speed_limit"] for row in first} == {12.0, 7.0}
    assert next(row for row in rows if row["trip"] == 2)["reference_position"] == 0.0


def test_its_reference_moves_as_its_acceleration_says():
    values = {"line": LINE, "train": {"mass": 1e4}, "service": SERVICE, "sample_time": 0.1, "wait": 0.2}
    timetable = Simulation(LineTimetable(**values))
    timetable.initialize()
    timetable.start()
    speed = 0.0
    for _ in range(100):
        timetable.step(0.1)
        assert timetable.get("reference_speed") == pytest.approx(speed, abs=1e-9)
        speed += 0.1 * timetable.get("reference_acceleration")


def _columns(timetable, names, count, step):
    simulation = Simulation(timetable)
    simulation.initialize()
    simulation.start()
    rows = []
    for _ in range(count):
        simulation.step(step)
        rows.append([simulation.get(name) for name in names])
    return list(zip(*rows, strict=True))


def test_a_profile_is_met_row_by_row_and_led_from_and_to_rest():
    rows = [{"position": x, "time": t, "speed": v} for t, x, v in ((7.0, 100.0, 2.0), (11.0, 116.0, 6.0))]
    rows += [{"position": 146.0, "time": 16.0, "speed": 6.0}, {"position": 157.0, "time": 18.5, "speed": 3.0}]
    rows += [{"position": 160.0, "time": 20.5, "speed": 0.0}]  # not at one deceleration: 1.2, then 1.5 m/s2
    names = ("trip", "trip_time", "reference_position", "reference_speed", "reference_acceleration")
    timetable = ProfileTimetable(
        profile=rows, sample_time=0.5, wait=1.0, mean_acceleration=False, line=LINE, train={"mass": 1e4}
    )
    trip, time, x, v, a = _columns(timetable, names, 48, 0.5)
    at = {t: k for k, t in enumerate(time) if trip[k] == 1}
    # evenly to 1 m/s2 in four seconds, which are 2 m/s and 8/3 m, at the first row
    assert (x[at[0.0]], v[at[0.0]], a[at[0.0]]) == pytest.approx((100.0 - 8.0 / 3.0, 0.0, 0.0), abs=1e-9)
    assert a[at[2.0]] == pytest.approx(0.5)
    for row, t in zip(rows, (4.0, 8.0, 13.0, 15.5, 17.5), strict=True):
        assert (x[at[t]], v[at[t]]) == pytest.approx((row["position"], row["speed"]), abs=1e-9)
    assert max(at) == 22.5  # 5 s more
    assert (x[at[22.5]], v[at[22.5]]) == (160.0, 0.0)
    for k in range(at[0.0], at[17.0]):
        assert x[k + 1] - x[k] == pytest.approx(0.25 * (v[k] + v[k + 1]), abs=0.03)


def test_a_profile_that_ends_on_the_way_is_led_to_rest():
    timetable = ProfileTimetable(sample_time=0.5, wait=1.0)
    time, x, v = _columns(timetable, ("trip_time", "reference_position", "reference_speed"), 150, 0.5)
    stop = next(k for k, t in enumerate(time) if t > 1.0 and v[k] == 0.0)
    assert x[stop] == pytest.approx(1001.0 + 2.0 / 3.0, abs=0.01)  # 1 m/s on, from about 1 m/s2 evenly to nothing
    assert time[stop] == pytest.approx(72.1, abs=0.51)


@pytest.mark.parametrize(
    ("rows", "told"),
    [
        ([(0.0, 0.0, 1.0)], "has at least two rows"),
        ([(0.0, 0.0, 2.0), (10.0, 5.0, 2.0)], "begins at 2 m/s without a change of speed that leads to rest"),
        ([(0.0, 0.0, 0.0), (10.0, 5.0, 4.0)], "ends at 4 m/s without"),
        ([(0.0, 0.0, 1.0), (0.0, 5.0, 4.0)], "'position' must exceed 0"),
    ],
)
def test_profiles_of_no_trip(rows, told):
    with pytest.raises(ComponentError, match=told):
        ProfileTimetable(profile=[dict(zip(("position", "time", "speed"), row, strict=True)) for row in rows])
