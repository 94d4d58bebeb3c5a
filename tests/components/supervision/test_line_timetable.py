"""The timetable over a line: cycles, references and limits."""

import pytest
from railcosim.components import LineTimetable, Simulation

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
