"""What curves are made of: the same numbers as the curves themselves, wherever one point in time is enough."""

import numpy as np
import pytest
from railcosim.orchestrator import System, run
from railcosim.orchestrator.evaluation.functions import ARITHMETIC, ELEMENTWISE, LOGIC
from railcosim.orchestrator.figures import curves_of
from railcosim.orchestrator.report.live import tracks_of
from railcosim.orchestrator.report.live.tracks import OPERATIONS


@pytest.fixture(scope="module")
def results(mine):
    system = System(stop_time=2.0, step=0.1)
    for k in (1, 2, 3):
        system.add(f"lag[{k}]", mine("Lag"), x=0.5 * k, gain=float(k))
    system.add("wave", mine("Wave"))
    return run(system, kind="plain").results


def value(track, results):
    """The numbers of a track, of which `resources/live.js` makes the same."""
    if isinstance(track, float | str):
        return np.full(results.points, float(track))
    what, *rest = track
    if what == "time":
        return results.time
    if what in ("signal", "parameter"):
        return results[rest[0]] if what == "signal" else np.full(results.points, results.parameters[rest[0]])
    act = {**ARITHMETIC, **LOGIC, **{name: one.call for name, one in ELEMENTWISE.items()}}
    act["if"] = np.where
    return act[what](*(value(part, results) for part in rest))


@pytest.mark.parametrize(
    "panel",
    [
        {"y": ["lag[:].x", "wave.y"]},
        {"y": ["lag[i-1].x - lag[i].x"], "scale": 3.6},
        {"y": ["lag[i].gain * lag[i].x + i * pi", "time / 2"]},
        {"y": ["lag[:].x - wave.y"]},
        {"y": ["where(wave.y > 0, clip(lag[count].x, 0.2, 0.4), nan)"]},
        {"y": ["lag[1].x if wave.y < 0 and not lag[2].x > 0.4 else -tanh(lag[3].x)"]},
        {"y": "maximum(lag[1].x, 0.3)"},
    ],
)
def test_tracks_give_the_curves(results, panel):
    curves, tracks = curves_of(panel, results), tracks_of(panel, results)
    assert len(curves) == len(tracks)
    for curve, told in zip(curves, tracks, strict=True):
        found = value(told["track"], results)
        np.testing.assert_array_equal(np.broadcast_to(found, curve.y.shape), curve.y * panel.get("scale", 1.0))


def test_what_takes_more_than_a_point_has_none(results):
    panel = {"y": ["max(lag[1].x) - lag[1].x", "lag[1].x", "derivative(wave.y)"], "scale": 2.0}
    assert tracks_of(panel, results) == [{}, {"track": ["*", ["signal", "lag[1].x"], 2.0]}, {}]


def test_over_another_signal(results):
    """One for all curves, or one for each; over what a page cannot make there is no curve either."""
    one, each, none = (
        tracks_of({"x": x, "y": "lag[:].x"}, results) for x in ("wave.y", "lag[:].x", "max(wave.y) * wave.y")
    )
    assert [told["across"] for told in one] == [["signal", "wave.y"]] * 3
    assert [told["across"] for told in each] == [told["track"] for told in each]
    assert none == [{}, {}, {}]
    assert tracks_of({"x": "lag[1:2].x", "y": "lag[:].x"}, results) == [{}, {}, {}]


def test_functions_of_their_own_variable(results):
    panel = {"x": {"name": "d", "from": 0.0, "to": 1.0}, "y": ["d ** 2", "d * lag[i].gain"]}
    assert tracks_of(panel, results) == [{}] * len(curves_of(panel, results))


def test_every_operation_at_a_point_is_known():
    assert {*ARITHMETIC, *LOGIC, *ELEMENTWISE, "if"} == OPERATIONS


def test_names_that_are_numbers(results):
    panel = {"y": ["wave.y * inf", "wave.y * nan", "wave.y * true"]}
    infinite, unknown, one = (told["track"][2] for told in tracks_of(panel, results))
    assert (infinite, unknown, one) == ("Infinity", "NaN", 1.0), "as JSON can say them"
