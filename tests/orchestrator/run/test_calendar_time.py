"""Runs whose times are large beside their step: seconds since 1970, microseconds after some minutes."""

import pytest
from railcosim.orchestrator import System, run
from railcosim.orchestrator.system import Event

EPOCH = 1700000000.0


def lag(mine, **simulation):
    system = System(**simulation)
    system.add("a", mine("Lag"), x=1.0)
    return system


@pytest.mark.parametrize(
    ("start", "stop", "step", "count"), [(EPOCH, EPOCH + 10.1, 0.1, 101), (1000.0, 1000.000003, 1e-6, 3)]
)
def test_the_points_of_a_run(mine, start, stop, step, count):
    outcome = run(lag(mine, start_time=start, stop_time=stop, step=step), kind="plain")
    assert (len(outcome.time), outcome.status) == (count + 1, "completed")
    assert list(outcome.time) == [start + k * step for k in range(count + 1)]


@pytest.mark.parametrize("algorithm", ["gauss-seidel", "jacobi"])
def test_events_and_windows_are_of_their_points(mine, algorithm):
    system = lag(mine, start_time=EPOCH, stop_time=EPOCH + 2.0, step=0.1)
    system.events.append(Event("a.u", "set", at=EPOCH + 0.7, value=1.0))
    system.judged.metrics["top"] = f"max(a.x, after={EPOCH + 0.3!r}, until={EPOCH + 1.3!r})"
    outcome = run(system, kind="plain", algorithm=algorithm)
    still = run(lag(mine, start_time=EPOCH, stop_time=EPOCH + 2.0, step=0.1), kind="plain", algorithm=algorithm)
    changed = [k for k, (x, y) in enumerate(zip(outcome["a.x"], still["a.x"], strict=True)) if x != y]
    assert changed[0] == 8
    assert next(iter(outcome.metrics[0].values.values())) == max(outcome["a.x"][3:14])


@pytest.mark.parametrize("algorithm", ["gauss-seidel", "iterative", "adaptive"])
@pytest.mark.parametrize("kind", ["plain", "native"])
def test_the_last_point_is_the_end_as_it_was_written(algorithm, kind):
    system = System(stop_time=0.3, step=0.1, algorithm=algorithm, requirements={"moves": "always train.speed > 0"})
    system.add("train", "PointMassTrain", speed=10.0, force=0.0)
    assert 3 * 0.1 != 0.3
    outcome = run(system, kind=kind)
    assert outcome.time[-1] == 0.3
    longer = run(system, kind=kind, stop_time=0.6)
    assert longer.time[-1] == 0.6
    if algorithm != "adaptive":  # which chooses its steps for the end
        assert longer["train.position"][3] == outcome["train.position"][-1]
