"""Every shipped scenario can be interrupted and resumed, and nobody can tell."""

import json

import pytest
from railcosim.orchestrator import load
from railcosim.orchestrator.run import checkpoint
from railcosim.orchestrator.run.execution import go_on, run
from railcosim.orchestrator.scenario import shipped
from railcosim.orchestrator.system import Event

SHORT, TRIPS = 40.0, 450.0
"""s; where trains learn from trip to trip, until the third of them is under way."""


@pytest.mark.long
@pytest.mark.parametrize("name", [name for name, _ in shipped()])
def test_a_resumed_run_has_the_same_results(name, tmp_path):
    """Stopped in the middle (where there are trips, of the second), with a sensor fault under way."""
    system = load(name)
    stop = TRIPS if "timetable" in system.instances else SHORT
    train = next(each for each in system.instances if each.startswith("train"))
    system.stepping.stop_time, middle = stop, 0.6 * stop
    system.events.append(Event(f"{train}.speed", "bias", middle - 2.0, 0.05, duration=5.0))
    whole, parts = tmp_path / "whole", tmp_path / "parts"
    one = run(system, output=whole, figures=False)
    assert one.status == "completed"
    run(system, output=parts, figures=False, checkpoint_every=middle)
    point = checkpoint.read_checkpoint(parts)
    assert point.time == pytest.approx(middle)
    again = go_on(parts, figures=False)
    assert again.status == "completed"
    assert again.seconds["steps"] == pytest.approx((stop - middle) / system.stepping.step)
    assert (parts / "results.csv").read_bytes() == (whole / "results.csv").read_bytes()
    metrics = [json.loads((folder / "metrics.json").read_text()) for folder in (whole, parts)]
    assert metrics[0] == metrics[1]


@pytest.mark.long
@pytest.mark.parametrize("name", ["cailc", "ato_comparison"])
def test_what_was_learned_is_in_the_checkpoint(name, tmp_path):
    """The third trip is better than the second by what the second taught, though the process is another one."""
    system = load(name, stop_time=620.0)
    whole = run(system, figures=False)
    short = load(name, stop_time=450.0)
    run(short, output=tmp_path, figures=False, checkpoint_every=410.0)
    again = go_on(tmp_path, stop_time=620.0, figures=False)
    signal = next(x for x in whole.names() if x.endswith(("position_error", "speed_error")))
    for result in (whole, again):
        first, third = (abs(result[signal][(result.time > a) & (result.time < a + 200.0)]).max() for a in (0.0, 400.0))
        assert third < first
    assert again[signal].tobytes() == whole[signal].tobytes()
