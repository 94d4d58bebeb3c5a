"""Whatever happens to whatever steps how often: the compiled loop and the loop in Python give the same bits."""

import random

import numpy as np
import pytest
from railcosim.orchestrator.master import compiled
from railcosim.orchestrator.master.varying import Blocks
from railcosim.orchestrator.run.execution import execute, run
from railcosim.orchestrator.system import Connection, Event, System

pytestmark = pytest.mark.skipif(compiled.kernel is None, reason="installed without the compiled step loop")
STEP = 0.25
INPUTS = {"u": "Real", "v": "Real", "m": "Integer", "on": "Boolean"}
OUTPUTS = {"x": "Real", "y": "Real", "n": "Integer", "off": "Boolean"}


@pytest.fixture
def both(monkeypatch):
    """Run compiled, then in Python; gives the first outcome when the two are the same to the bit."""

    def go(system, *, log=True):
        used, threads = [], None
        with monkeypatch.context() as patch:
            loop = compiled.CompiledLoop.run
            patch.setattr(compiled.CompiledLoop, "run", lambda *args, **how: used.append(1) or loop(*args, **how))
            take = Blocks.take
            patch.setattr(Blocks, "take", lambda *args: used.append(1) or take(*args))
            fast = execute(system)
        assert used or len(fast.time) <= 1  # in the first step nobody knows who refuses to be refreshed
        with monkeypatch.context() as patch:
            patch.setattr(compiled, "kernel", None)
            slow = execute(system)
        said = [str(x.error) if log else str(x.error).partition("\n")[0] for x in (fast, slow)]
        assert (fast.status, said[0]) == (slow.status, said[1])
        assert fast.time.tobytes() == slow.time.tobytes()
        for name in fast.names():
            assert fast[name].tobytes() == slow[name].tobytes(), name
        assert fast.coupling == slow.coupling
        assert not log or getattr(fast.error, "log", None) == getattr(slow.error, "log", None)
        is_shared = system.stepping.algorithm == "jacobi" and not system.stepping.refresh
        for name in fast.names() if is_shared else ():
            threads = threads or execute(system, threads=2)
            assert fast[name].tobytes() == threads[name].tobytes(), name
        return fast

    return go


def some_value(draw, kind):
    return {
        "Real": draw.uniform(-3.0, 3.0),
        "Integer": draw.randrange(-1000, 1000),
        "Boolean": draw.random() < 0.5,
    }[kind]


def some_system(draw, model):
    """Instances with steps of their own, connected at random, and events on all that can have some."""
    start = draw.choice([0.0, -3.7, 1e4])
    system = System(
        start_time=start,
        stop_time=start + 36 * STEP,
        step=STEP,
        record=draw.choice([None, 3 * STEP]),
        algorithm=draw.choice(["gauss-seidel", "jacobi"]),
    )
    names = [f"odd[{k}]" for k in range(draw.randrange(2, 6))]
    for name in names:
        start_values = {"u": 1.5, "v": draw.uniform(-2, 2), "m": draw.randrange(9), "on": draw.random() < 0.5}
        system.add(name, model, **start_values).step = draw.choice([None, None, STEP, 2 * STEP, 3 * STEP])
    fed = set()
    for target in names:
        for variable, kind in INPUTS.items():
            if draw.random() < 0.7:
                sources = [f"{name}.{other}" for name in names for other, k in OUTPUTS.items() if k == kind]
                sources = [x for x in sources if not (variable == "v" and x.endswith(".y"))]  # no algebraic loop
                is_real = kind == "Real" and draw.random() < 0.5
                scale, offset = (draw.uniform(-1, 1), draw.uniform(-1, 1)) if is_real else (1.0, 0.0)
                system.connect(
                    draw.choice(sources),
                    f"{target}.{variable}",
                    delay=draw.choice([0, 0, 1, 4]),
                    scale=scale,
                    offset=offset,
                )
                fed.add((target, variable))
    for _ in range(draw.randrange(1, 9)):
        system.events.append(some_event(draw, system, names, fed))
    return system


def some_coupling(draw, model):
    """The same with inputs that go on, feed-through that is refreshed, steps that are repeated, and what fails."""
    system = some_system(draw, model)
    way = system.stepping
    way.algorithm = draw.choice(["gauss-seidel", "jacobi", "iterative", "iterative", "iterative"])
    way.extrapolation = draw.choice([0, 1, 2])
    way.refresh = way.algorithm != "iterative" and draw.random() < 0.6
    way.acceleration = draw.choice(["none", "aitken", "anderson", "anderson"])
    way.max_iterations, way.relaxation = draw.choice([2, 5, 20]), draw.choice([1.0, draw.uniform(0.3, 1.2)])
    way.unsettled = draw.choice(["go-on", "go-on", "stop"])
    way.tolerance = draw.choice([None, 1e-3, 1e-13])
    if way.algorithm == "iterative" or way.refresh:
        for instance in system.instances.values():
            instance.step = None
    if draw.random() < 0.6:  # whole numbers in a circle never agree
        for link in system.connections:
            link.delay = link.delay or int(link.target.endswith(".m"))
    if draw.random() < 0.3:
        failing = [10, 2, 3, 9, 22, 32, 33, 40, 41, 42, 44, 62, 72, 82, 83, 91, 92, 102, 113, 122]
        draw.choice([*system.instances.values()]).start["mode"] = draw.choice(failing)
    return system


def some_variation(draw, model):
    """The same in steps of varying length."""
    system = some_system(draw, model)
    way = system.stepping
    way.algorithm, way.tolerance = "adaptive", draw.choice([1e-1, 1e-2, 3e-3])
    way.stop_time = way.start_time + 6.0  # FMUs fail from 5 s on, if they do
    way.extrapolation, way.refresh = draw.choice([0, 1, 2]), draw.random() < 0.5
    way.min_step = draw.choice([None, STEP / 50])
    for instance in system.instances.values():
        instance.step = None
    for link in [*system.connections, *(event.source for event in system.events if event.source)]:
        link.delay = 0
    if draw.random() < 0.3:
        failing = [10, 2, 3, 9, 22, 32, 33, 40, 41, 42, 44, 62, 72, 82, 83, 91, 92, 102, 113, 122]
        draw.choice([*system.instances.values()]).start["mode"] = draw.choice(failing)
    return system


def some_event(draw, system, names, fed):
    name = draw.choice(names)
    variable, kind = draw.choice([*INPUTS.items(), *OUTPUTS.items()])
    at = system.stepping.start_time + draw.choice([draw.uniform(-2.0, 10.0), STEP * draw.randrange(36)])
    if variable in INPUTS and (name, variable) not in fed:
        return Event(f"{name}.{variable}", "set", at, some_value(draw, kind), every=draw.choice([None, 2.0]))
    connects = ["connect", "connect"] * ((name, variable) in fed)
    action = draw.choice(["override", "freeze", *connects] + ["bias", "ramp"] * (kind == "Real"))
    duration = draw.choice([None, 0.75, draw.uniform(0.75, 4.0)])
    every = None if duration is None else draw.choice([None, duration, duration + 0.5])
    value = some_value(draw, kind) if action in ("override", "bias") else None
    rate = draw.uniform(-1, 1) if action == "ramp" else None
    event = Event(f"{name}.{variable}", action, at, value, rate, duration, every)
    if action == "connect":
        others = [k for k, other in OUTPUTS.items() if other == kind and (variable, k) != ("v", "y")]
        event.source = Connection(f"{draw.choice(names)}.{draw.choice(others)}", "", delay=draw.choice([0, 0, 2, 6]))
        event.fade = draw.choice([None, 1.3, 5.0]) if kind == "Real" else None
    return event


@pytest.mark.sample(12)
@pytest.mark.unmeasured
@pytest.mark.parametrize("seed", range(40))
def test_the_same_bits(both, odd, seed):
    draw = random.Random(seed)
    outcome = both(some_system(draw, odd))
    assert outcome.status == "completed"


@pytest.mark.parametrize(
    "seed",
    [
        *(pytest.param(seed, marks=pytest.mark.long) for seed in range(40, 200)),
        *(pytest.param(seed, marks=pytest.mark.campaign) for seed in range(200, 1000)),
    ],
)
def test_the_same_bits_of_many_more(both, odd, seed):
    assert both(some_system(random.Random(seed), odd)).status == "completed"


def test_the_random_systems_are_of_many_kinds(odd):
    """Else the tests above would not say much."""
    systems = [some_system(random.Random(seed), odd) for seed in range(40)]
    happened = [what for system in systems for what in execute(system).coupling["events"]]
    assert {event.action for system in systems for event in system.events} == {
        "set", "override", "freeze", "bias", "ramp", "connect",
    }  # fmt: skip
    assert len(happened) > 500
    slow = {x.name for x in systems[0].instances.values() if x.step}
    assert slow
    assert {system.stepping.algorithm for system in systems} == {"gauss-seidel", "jacobi"}


@pytest.mark.parametrize("algorithm", ["gauss-seidel", "jacobi"])
@pytest.mark.parametrize("how", [10, 11, 2, 22, 32])
def test_a_failure_while_events_act(both, odd, algorithm, how):
    """A value that is not finite, a step that is discarded, a failing get and set: told alike, rows and all."""
    events = [Event(f"odd[{k}].{name}", "freeze", 1.0) for k in (0, 1) for name in ("y", "u")]
    system = System(stop_time=10.0, step=STEP, algorithm=algorithm, events=events)
    for k in (0, 1):
        system.add(f"odd[{k}]", odd, mode=how * k).step = (k + 1) * STEP
        system.connect(f"odd[{1 - k}].y", f"odd[{k}].u")
    outcome = both(system)
    assert (outcome.status, outcome.error.instance) == ("failed", "odd[1]")
    assert 4.5 <= outcome.time[-1] <= 5.0


def test_a_tunable_parameter_makes_an_fmu_fail_from_then_on(both, odd):
    """Set at 6 s; what the block before it recorded is there in both loops."""
    system = System(stop_time=10.0, step=STEP, events=[Event("odd.mode", "set", 6.0, 3)])
    system.add("odd", odd)
    outcome = both(system)
    assert (outcome.error.instance, outcome.error.time, outcome.time[-1]) == ("odd", 6.0, 6.0)


def test_events_are_seen_by_a_run_that_is_stopped_at_them(odd):
    """The observer is told after the event, with the row of the point."""
    system = System(stop_time=10.0, step=STEP, events=[Event("odd.x", "override", 5.0, 77.0)])
    system.add("odd", odd, u=1.0)
    result = run(system)
    at = np.flatnonzero(result["odd.x"] == 77.0)
    assert result.time[at[0]] == 5.0


# -------------------------------------------------------------------- ways to couple


@pytest.mark.sample(8)
@pytest.mark.parametrize(
    "seed",
    [
        *range(24),
        *(pytest.param(seed, marks=pytest.mark.long) for seed in range(24, 100)),
        *(pytest.param(seed, marks=pytest.mark.campaign) for seed in range(100, 2000)),
    ],
)
def test_ways_to_couple(both, able, seed):
    both(some_coupling(random.Random(seed), able))


@pytest.mark.parametrize(
    "seed",
    [
        *range(5),
        *(pytest.param(seed, marks=pytest.mark.long) for seed in range(5, 20)),
        *(pytest.param(seed, marks=pytest.mark.campaign) for seed in range(20, 2000)),
    ],
)
def test_ways_to_vary(both, able, seed):
    both(some_variation(random.Random(seed), able), log=False)
