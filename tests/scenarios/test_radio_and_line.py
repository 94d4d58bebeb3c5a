"""Scenarios of our own around the reconstructed law: radio, fallback, slopes, braking wave, sinusoidal leader."""

import itertools
import runpy
from pathlib import Path

import numpy as np
import pytest
from railcosim.orchestrator import load, run

close = runpy.run_path(str(Path(__file__).with_name("close_following.py")))


def metrics(result):
    return {metric.name: metric.values for metric in result.metrics}


def verdicts(result):
    return {verdict.name: verdict.verdict for verdict in result.requirements}


def test_a_perfect_radio_is_a_wire_to_the_last_bit():
    changes = {"step": 0.1, "stop_time": 100.0, "settings": ["simulation.record=1"]}
    through = run(load("degraded_radio", preset="perfect", **changes))
    wired = run(load("tunable_potential", preset="tunable-comfort", **changes))
    for i in range(1, 6):
        for name in ("position", "speed", "acceleration"):
            assert (through[f"train[{i}].{name}"] == wired[f"train[{i}].{name}"]).all()


@pytest.mark.long
def test_the_same_seed_gives_the_same_run_and_another_one_another():
    def speeds(seed):
        result = run(load("degraded_radio", stop_time=60.0, settings=[f"simulation.seed={seed}"]))
        return result["train[3].speed"]

    assert (speeds(1) == speeds(1)).all()
    assert (speeds(1) != speeds(2)).any()


@pytest.mark.long
def test_native_fmus_and_plain_components_hear_the_same():
    changes = {"stop_time": 30.0}
    runs = [run(load("degraded_radio", **changes), kind=kind) for kind in ("auto", "plain")]
    assert all((runs[0][name] == runs[1][name]).all() for name in runs[0].names())


@pytest.fixture(scope="module")
def degraded():
    return {preset: run(load("degraded_radio", preset=preset)) for preset in ("degraded", "no-fallback", "late")}


def test_the_fallback_gets_the_trains_through_an_outage(degraded):
    result = degraded["degraded"]
    assert set(verdicts(result).values()) == {"pass"}
    found = metrics(result)
    assert all(value > 0.0 for value in found["braking_margin"].values())
    assert all(value > 110.0 for value in found["degraded_for"].values())
    time, flag = result.time, result["cruise[3].degraded"]
    assert flag[(time > 602.0) & (time < 720.0)].all()
    lowest = result["train[3].speed"][(time > 600.0)].min()
    assert 35.0 < lowest < 50.0
    # Rejoining: nothing jumps when the first message comes.
    around = np.abs(np.diff(result["train[3].acceleration"][(time >= 719.0) & (time <= 730.0)]))
    assert around.max() < 0.12


def test_without_it_stale_data_brake_the_trains(degraded):
    result = degraded["no-fallback"]
    assert verdicts(result)["back_in_time"] == "fail"
    assert not result["cruise[3].degraded"].any()
    assert result["train[3].speed"][(result.time > 620.0) & (result.time < 720.0)].min() < 60.0


def test_delay_alone_is_made_up_for(degraded):
    assert set(verdicts(degraded["late"]).values()) == {"pass"}
    assert metrics(degraded["late"])["age_max"][1] == pytest.approx(0.5, abs=1e-9)


@pytest.mark.parametrize(
    ("preset", "low", "high"), [("exact-map", 0.0, 1e-9), ("coarse-map", 1.5, 2.2), ("no-map", 8.0, 10.5)]
)
def test_slopes_and_curves_are_compensated_as_far_as_they_are_known(preset, low, high):
    result = run(load("hilly_line", preset=preset))
    errors = metrics(result)["speed_error_peak"].values()
    assert low <= min(errors) <= max(errors) <= high
    assert max(metrics(result)["line_resistance_peak"].values()) == pytest.approx(9.81 * 0.02, abs=1e-12)
    assert set(verdicts(result).values()) == {"pass"}


@pytest.mark.parametrize(
    ("preset", "dies_out"),
    [("both-sides", True), ("table-4", False), ("predecessor", False), ("predecessor-leader", False)],
)
def test_braking_wave(preset, dies_out):
    result = run(load("braking_wave", preset=preset))
    assert (verdicts(result)["wave_dies_out"] == "pass") is dies_out
    deviations = list(metrics(result)["speed_deviation"].values())
    if preset == "both-sides":
        assert all(b < a for a, b in itertools.pairwise(deviations))
        assert metrics(result)["string_ratio"][None] == pytest.approx(0.897, abs=0.005)
    if preset == "table-4":
        assert metrics(result)["string_ratio"][None] > 1.0


@pytest.mark.sample(2)
@pytest.mark.parametrize(
    ("preset", "bounded"),
    [
        ("both-sides", True),
        ("fast", True),
        ("slow", False),
        ("predecessor", False),
        ("not-told", False),
        ("table-4", False),
    ],
)
def test_sinusoidal_leader(preset, bounded):
    result = run(load("sinusoidal_leader", preset=preset))
    assert (verdicts(result)["no_growth"] == "pass") is bounded


# ---------------------------------------------------------------- virtual coupling


def margins(seeds, **safety):
    return [close["braking_margin"](run(close["close_system"](seed, **safety))) for seed in seeds]


@pytest.mark.long
def test_close_following_keeps_the_braking_distance_with_the_fallback_and_not_without():
    """Distances of 400 m at 60 m/s, emergency braking in an outage; the safe bound acts at all times (guard)."""
    assert min(margins(range(8))) > 0.0
    assert max(margins(range(2), fallback=False)) < 0.0


@pytest.mark.campaign
def test_close_following_in_many_cases():
    assert min(margins(range(50))) > 0.0
    assert max(margins(range(50), fallback=False)) < 0.0
