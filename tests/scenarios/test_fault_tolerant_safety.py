"""Bounds hit on purpose: the flag rises, the safe action is taken, a requirement reports it, and nothing is NaN."""

import numpy as np
import pytest
from railcosim.orchestrator import load, run


def hit(*settings, stop=60.0, builds=()):
    settings = [f"simulation.stop_time={stop}", *settings]
    system = load("fault_tolerant_cruise", preset="nominal", step=0.02, settings=settings, builds=builds)
    result = run(system, figures=False)
    for name in result.names():
        assert np.isfinite(np.asarray(result[name], dtype=float)).all(), name
    failed = {v.name: v for v in result.requirements if v.verdict == "fail"}
    return result, failed


@pytest.mark.long
def test_a_fault_larger_than_the_actuator():
    """Train 1 is pushed back by 150 kN on every carriage for 30 s, and no actuator gives more than 60 kN.

    It loses the virtual leader by 2 km. The trains behind hear the jerk that its limited command gives, and brake as
    hard as they can: they come closer faster than R3 allows, but R2 holds. Then everything is brought back.
    """
    rows = ", ".join(f"{{carriage={j}, constant=-150e3, from=10.0, until=40.0}}" for j in (1, 2, 3))
    limit = [f"{name}.{what}" for name in ("train", "cruise") for what in ("limit_force=true", "force_limit=60e3")]
    result, failed = hit(*limit, stop=300.0, builds=[f"faults[1].schedule=[{rows}]"])
    assert {"barrier", "r2_range_first", "r3_range_first", "r3_range"} <= failed.keys()
    assert "r2_range" not in failed
    assert result["cruise[1].force_limited"].any()
    assert not result["cruise[1].force_limited"][-1]
    first = result.time[np.argmax(result["cruise[1].barrier_violated"])]
    assert 10.0 < first < 15.0
    assert first - 0.1 < failed["barrier"].time <= first, "seen at every step, recorded every 0.1 s"
    assert not any(result[f"cruise[{i}].barrier_violated"][-1] for i in (1, 2, 3))


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    ("start", "bound"),
    [([4124.9, 4100.1, 4074.9], 5810.0), ([7434.9, 7410.1, 7384.9], 2500.0), ([6114.9, 6090.1, 6064.9], 3820.0)],
)
def test_a_bad_initial_gap(start, bound):
    """Train 2 starts too far back, or within emergency braking distance: flag and condition from the first moment."""
    result, failed = hit(f"train[2].position={start}")
    assert result["train[1].tail_position"][0] - start[0] == pytest.approx(bound)
    assert result["cruise[2].barrier_violated"][0]
    assert result["cruise[2].failed_condition"][0] == 3
    assert {"barrier", "conditions", "r2_range"} <= failed.keys()
    assert failed["r2_range"].margin < 0.0
    # The demand of the safe action is bounded: k_z s_z(0.9) = 3.6 m/s2, and what the start itself asks for.
    assert np.abs(result["train[2].acceleration[1]"]).max() < 5.0


def test_z_outside_at_the_start_is_brought_back():
    """The specification's starts with z(0) = 3.82: inside again without divergence."""
    result, failed = hit("train[2].position=[6483.47, 6458.67, 6433.47]")
    z = result["cruise[2].combined_error"]
    assert z[0] == pytest.approx(3.82, abs=0.01)
    assert failed.keys() >= {"barrier", "conditions"}
    assert "r2_range" not in failed
    assert "r3_range" not in failed
    assert np.abs(z[result.time > 10.0]).max() < 3.0


def test_wrong_parameters_are_reported_and_harmless():
    """rho so large that the z range vanishes: the condition fails, everything stays finite."""
    result, failed = hit("cruise.rho=0.03", stop=20.0)
    assert "conditions" in failed
    assert (result["cruise[1].failed_condition"] == 1).all()
