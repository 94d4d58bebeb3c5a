"""Plans over a line: below every limit under the whole train, at rest at every stop, in as many pieces as needed."""

import bisect
import itertools
import json
from pathlib import Path

import numpy as np
import pytest
from railcosim import models
from railcosim.components.environment.profile import moved
from railcosim.components.environment.track import read_line
from railcosim.components.supervision.line_plan import SERVICE, plan

YIZHUANG = json.loads((Path(models.__file__).parent / "lines" / "yizhuang.json").read_text(encoding="utf-8"))
BRISK = SERVICE.record({"acceleration": 0.8, "deceleration": 0.7, "jerk": 0.5, "margin": 1.0, "dwell": 30.0})


def line(*limits, stops=(0.0, 1500.0)):
    ends = [{"position": position} for position in stops]
    return read_line({"sections": [{"position": 0.0}], "speed_limits": list(limits), "stops": ends})


def test_one_limit_by_hand():
    """Up to 19 m/s with 0.8, down with 0.7 m/s2, ramps of 1.6 and 1.4 s; the rest at 19 m/s."""
    found = plan(line([0.0, 20.0]), 0.0, 50.0, BRISK)
    up, down = 19.0 / 0.8 + 1.6, 19.0 / 0.7 + 1.4
    assert found.duration == pytest.approx(up + down + (1500.0 - 9.5 * (up + down)) / 19.0, rel=1e-12)
    assert found.profile.at(60.0).speed == pytest.approx(19.0, abs=1e-9)
    assert plan(line([0.0, 20.0]), 0.0, 10.0, BRISK).profile.at(60.0).speed == pytest.approx(10.0, abs=1e-9)


def test_the_yizhuang_line_there_and_back():
    track = read_line(YIZHUANG)
    found = plan(track, 117.0, 22.0, BRISK)
    assert found.distance == 2.0 * 22728.0
    end = found.profile.at(found.duration)
    assert (end.position, end.speed) == pytest.approx((found.distance, 0.0), abs=1e-6)
    halts = []
    steps = [*track.limits.steps, (1e9, 0.0)]
    for t in np.arange(0.0, found.duration, 5.0):
        k = bisect.bisect(found.profile.times, t) - 1
        motion = moved(found.profile.motions[k], float(t) - found.profile.times[k])
        under = [
            v for (b, v), (end, _) in itertools.pairwise(steps) if b < motion.position and end > motion.position - 117.0
        ]
        assert motion.speed <= min(under, default=50.0 / 3.6) - 1.0 + 1e-6
        assert -0.7 - 1e-9 <= motion.acceleration <= 0.8 + 1e-9
        if t and motion.speed < 1e-9:
            halts.append(round(motion.position, 3))
    assert sorted(set(halts)) == [stop.position for stop in track.stops][1:-1]


@pytest.mark.parametrize("middle", [100.0, 300.0, 310.0, 700.0, 1400.0])
def test_stretches_too_short_for_their_limit_are_run_as_fast_as_they_are_long(middle):
    track = line([0.0, 8.0], [middle, 25.0], [middle + 60.0, 6.0])
    found = plan(track, 40.0, 50.0, BRISK)
    assert found.profile.at(found.duration).position == pytest.approx(1500.0, abs=1e-7)
    for t in np.arange(0.0, found.duration, 1.0):
        motion = found.profile.at(float(t))
        assert motion.speed <= track.speed_limit(motion.position, 40.0) - 1.0 + 1e-6


def test_what_cannot_be_planned_is_refused():
    with pytest.raises(ValueError, match="fewer than two stops"):
        plan(line([0.0, 20.0], stops=(0.0,)), 0.0, 50.0, BRISK)
    with pytest.raises(ValueError, match="leaves no speed with a margin of 1 m/s"):
        plan(line([0.0, 20.0], [500.0, 1.0]), 0.0, 50.0, BRISK)
