"""The traced closed loop: the run itself, its exact gradients, and the systems that have none."""

from dataclasses import replace

import numpy as np
import pytest
from railcosim.orchestrator import System
from railcosim.orchestrator.errors import ScenarioError
from railcosim.orchestrator.run import check, execute
from railcosim.orchestrator.study.batch import Batch
from railcosim.orchestrator.study.search.traced import TracedLoop
from railcosim.orchestrator.system import Event


@pytest.fixture
def loop_of(workspace):
    """A checked system, and its loop."""

    def build(system):
        checked = check(system, workspace, "plain")
        return checked, TracedLoop(checked)

    return build


@pytest.fixture
def pushed(mine):
    """A mass that a spring of gain and bias pushes back, and its sampled echo."""

    def build(**values):
        system = System(step=0.02, **{"stop_time": 5.0} | values)
        system.add("target", "Schedule", {"points": 2}, times=[0.0, 1.0], values=[1.0, 3.0])
        system.add("spring", mine("Affine"), gain=-4.0)
        system.add("mass", mine("Mass"), x=2.0, max_step=0.01)
        system.add("echo", mine("Sampled"))
        system.add("other", mine("Sampled"))
        system.connect("mass.x", "spring.u")
        system.connect("target.value", "spring.w", scale=2.0, offset=0.5)
        system.connect("spring.y", "mass.a")
        system.connect("mass.v", "echo.u")
        system.connect("echo.y", "other.u")
        return system

    return build


@pytest.mark.parametrize("algorithm", ["gauss-seidel", "jacobi"])
def test_the_loop_is_the_run_and_its_gradient_that_of_runs(pushed, loop_of, algorithm):
    """Place 130 is in the second chunk of steps, and no multiple of it: central differences of runs agree."""
    system = pushed(algorithm=algorithm)
    checked, loop = loop_of(system)
    results = execute(system, kind="plain").results
    given = loop.values(checked)
    names = ["mass.x", "mass.v", "spring.y", "echo.y", "other.y", "target.value"]
    flight = loop.fly(given, names)
    assert np.array_equal(flight.columns["time"], results.time)
    for name in names:
        assert flight.columns[name] == pytest.approx(results[name], rel=1e-10, abs=1e-10)
    step, nominal = 1e-4, {"mass.x": 2.0, "spring.gain": -4.0, "target.values[1]": 1.0, "target.values[2]": 3.0}
    with Batch(system, kind="plain", record=["mass.x", "echo.y"]) as batch:
        for key, start in nominal.items():
            ends = [batch.run({key: start + by}).series for by in (step, -step)]
            high, low = (series["mass.x"] + 2.0 * series["echo.y"] for series in ends)
            at = loop.places.get(f"{key}_start", loop.places[key])
            for place in (250, 130, 100):
                pulled = loop.pull(flight, {"mass.x": 1.0, "echo.y": 2.0}, place)[at]
                assert pulled == pytest.approx((high - low)[place] / (2.0 * step), rel=1e-6, abs=1e-8), key


def test_start_values_that_are_computed_count_at_the_first_point(mine, loop_of):
    system = System(stop_time=1.0, step=0.1)
    system.add("target", "Schedule", values=3.0)
    system.add("rest", mine("Resting"))
    system.connect("target.value", "rest.u")
    checked, loop = loop_of(system)
    flight = loop.fly(loop.values(checked), ["rest.x"])
    assert flight.columns["rest.x"] == pytest.approx(np.full(11, 3.0))
    for place in (0, 4):
        assert loop.pull(flight, {"rest.x": 1.0}, place)[loop.places["target.values[1]"]] == pytest.approx(1.0)


def test_one_instance_alone(mine, loop_of):
    system = System(stop_time=1.0, step=0.1)
    system.add("lag", mine("Lag"), rate=2.0, u=0.0)
    checked, loop = loop_of(system)
    flight = loop.fly(loop.values(checked), ["lag.x"])
    assert flight.columns["lag.x"][-1] == pytest.approx(np.exp(-2.0), rel=1e-4)
    assert loop.pull(flight, {"lag.x": 1.0}, 10)[loop.places["lag.x_start"]] == pytest.approx(np.exp(-2.0), rel=1e-4)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda s, mine: s.changed(algorithm="iterative"), "algorithm 'iterative' takes no fixed sequence of steps"),
        (lambda s, mine: s.changed(refresh=True), "outputs are refreshed at each communication point"),
        (lambda s, mine: s.changed(algebraic_loops="solve"), "algebraic loops are solved"),
        (lambda s, mine: s.changed(events=[Event("target.value", "bias", at=1.0, value=2.0)]), "events act on the way"),
        (lambda s, mine: s.add("noise", mine("Noisy")), "instance 'noise': Noisy draws random numbers"),
        (lambda s, mine: setattr(s.instances["echo"], "step", 0.04), "instance 'echo': it takes steps of its own"),
        (lambda s, mine: s.add("slow", mine("Count"), sample_time=0.5), "instance 'slow': it samples every 0.5 s"),
        (
            lambda s, mine: (s.add("late", mine("Lag")), s.connect("mass.x", "late.u", delay=1)),
            "instance 'late': the connection to late.u is delayed",
        ),
        (
            lambda s, mine: (s.add("hot", mine("Heater")), s.connect("mass.x", "hot.on", threshold=1.0)),
            "the connection to hot.on turns a number into another type",
        ),
    ],
)
def test_what_has_no_gradient_is_told_with_the_remedy(pushed, mine, loop_of, change, said):
    system = pushed()
    changed = change(system, mine)
    with pytest.raises(ScenarioError) as refused:
        loop_of(changed if isinstance(changed, System) else system)
    assert said in str(refused.value)
    assert "choose another --method" in str(refused.value)


def test_an_fmu_of_a_user_has_no_gradient(pushed, workspace):
    checked = check(pushed(), workspace, "plain")
    others = checked.models | {"mass": replace(checked.models["mass"], kind="fmu")}
    with pytest.raises(ScenarioError, match=r"instance 'mass': .*Mass is an FMU whose equations are not known"):
        TracedLoop(replace(checked, models=others))
