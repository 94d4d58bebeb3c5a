"""The profile of least energy, driven through FMUs: a share of a per cent more energy, and on the spot in time."""

import csv

import numpy as np
import pytest
from railcosim.orchestrator import load, run
from railcosim.orchestrator.driving import load_case, optimise, profile_of
from railcosim.orchestrator.scenario import MODELS

PUBLISHED = 440.1406 * 3.6e6
"""J, by GPOPS-II."""


@pytest.mark.long
def test_both_controllers_drive_near_the_optimum_and_arrive():
    result = run(load("optimal_driving"))
    assert {check.verdict for check in result.requirements} == {"pass"}
    last, arrival = result.time[-1], 10.0 + 1548.87
    for k in (1, 2):
        used = result[f"drive[{k}].drawn_energy"][-1] - result[f"drive[{k}].recovered_energy"][-1]
        assert PUBLISHED < used < 1.002 * PUBLISHED
        assert abs(result[f"train[{k}].position"][-1] - 48532.28) < 0.05
        moving = result.time[np.abs(result[f"train[{k}].speed"]) > 0.01]
        assert moving.max() <= arrival + 1.0 < last


@pytest.mark.long
def test_the_shipped_profile_is_what_drive_finds():
    found = profile_of(optimise(load_case("virm6_limit_100", ["reserve=0.015", "jerk=0.5"])).solution)
    with (MODELS / "profiles" / "virm6_limit_100.csv").open(newline="") as stream:
        rows = [[float(value) for value in row] for row in list(csv.reader(stream))[1:]]
    position, time, speed, *_ = np.array(rows).T
    assert np.interp(position, found.position, found.time) == pytest.approx(time, abs=0.05)
    assert np.interp(position, found.position, found.speed) == pytest.approx(speed, abs=0.02)
