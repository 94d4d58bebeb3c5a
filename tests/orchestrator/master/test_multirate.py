"""Instances with a step of their own: what acts when, told by sequences known by hand; and in both loops alike."""

import numpy as np
import pytest
from railcosim.orchestrator import load
from railcosim.orchestrator.cli import app as cli
from railcosim.orchestrator.errors import ScenarioError
from railcosim.orchestrator.master import compiled
from railcosim.orchestrator.run.checking import check, describe_stepping
from railcosim.orchestrator.run.execution import at_half_the_step, execute, run
from railcosim.orchestrator.scenario.loading import loads
from railcosim.orchestrator.system import Event, System

ALGORITHMS = pytest.mark.parametrize("algorithm", ["gauss-seidel", "jacobi"])


@pytest.fixture
def system(mine):
    """Instances by name (class, step, start values) and connections, nine steps of 1 s."""

    def make(instances, wires=(), *events, **how):
        it = System(**{"stop_time": 9.0, "step": 1.0} | how, events=list(events))
        for name, (cls, step, *start) in instances.items():
            it.add(name, mine(cls), **(start[0] if start else {})).step = step
        for source, target, *delay in wires:
            it.connect(source, target, delay=delay[0] if delay else 0)
        return it

    return make


@pytest.fixture
def go(monkeypatch):
    """Run as Python objects, as FMUs in the Python loop and in the compiled one, which all give the same bits."""

    def thrice(it):
        plain = run(it, kind="plain")
        with monkeypatch.context() as patch:
            patch.setattr(compiled, "kernel", None)
            slow = run(it, kind="python")
        for other in (slow, run(it, kind="python")):
            for name in plain.names():
                assert plain[name].tobytes() == other[name].tobytes(), name
        return plain

    return thrice


def series(result, *names):
    return [list(result[name]) for name in names]


# -------------------------------------------------------------------- what acts when


@ALGORITHMS
def test_a_slow_receiver_reads_at_the_begin_of_its_interval_and_shows_at_its_end(go, system, algorithm):
    instances = {"source": ("Count", None), "end": ("Keep", 3.0)}
    result = go(system(instances, [("source.n", "end.u")], algorithm=algorithm))
    assert list(result["source.n"]) == [10, 11, 12, 13, 14, 15, 16, 17, 18, 19]
    assert list(result["end.seen"]) == [-1, -1, -1, 10, 10, 10, 13, 13, 13, 16]


@ALGORITHMS
def test_what_a_slow_source_shows_changes_at_the_end_of_its_interval(go, system, algorithm):
    instances = {"end": ("Keep", None), "source": ("Count", 3.0)}
    result = go(system(instances, [("source.n", "end.u")], algorithm=algorithm))
    n, seen = series(result, "source.n", "end.seen")
    assert n == [10, 10, 10, 11, 11, 11, 12, 12, 12, 13]
    assert seen == [-1, *n[:-1]]


@ALGORITHMS
@pytest.mark.parametrize("cls", ["Pass", "Sampled"])
def test_what_passes_directly_through_a_slow_one_acts_at_once_and_is_held(go, system, algorithm, cls):
    instances = {"source": ("Count", None), "through": (cls, 3.0), "end": ("Keep", None)}
    wires = [("source.n", "through.u"), ("through.y", "end.u")]
    result = go(system(instances, wires, algorithm=algorithm))
    y, seen = series(result, "through.y", "end.seen")
    assert y == [10, 10, 10, 10, 13, 13, 13, 16, 16, 16]
    assert seen == [-1, *(y[1:] if algorithm == "gauss-seidel" else y[:-1])]
    if cls == "Sampled":
        assert list(result["through.k"]) == [0, 0, 0, 0, 1, 1, 1, 2, 2, 2]


@ALGORITHMS
def test_two_of_different_steps_of_their_own(go, system, algorithm):
    instances = {"source": ("Count", 2.0), "end": ("Keep", 3.0), "fast": ("Keep", None)}
    wires = [("source.n", "end.u"), ("source.n", "fast.u")]
    result = go(system(instances, wires, algorithm=algorithm, stop_time=12.0))
    n, seen, fast = series(result, "source.n", "end.seen", "fast.seen")
    assert n == [10 + k // 2 for k in range(13)]
    assert seen == [-1, -1, -1, 10, 10, 10, 11, 11, 11, 13, 13, 13, 14]
    assert fast == [-1, *n[:-1]]


@ALGORITHMS
@pytest.mark.parametrize("delay", [1, 2, 4])
def test_a_delay_counts_the_system_s_points(go, system, algorithm, delay):
    instances = {"source": ("Count", 3.0), "through": ("Pass", 3.0), "end": ("Keep", None), "late": ("Keep", None)}
    wires = [("source.n", "through.u"), ("through.y", "end.u", delay), ("source.n", "late.u", delay)]
    result = go(system(instances, wires, algorithm=algorithm))
    n, y, end, late = series(result, "source.n", "through.y", "end.seen", "late.seen")
    assert y == [10, 10, 10, 10, 11, 11, 11, 12, 12, 12]
    lag = delay + (algorithm == "jacobi")
    assert end == [-1, *(y[max(0, k + 1 - lag)] for k in range(9))]
    assert late == [-1, *(n[max(0, k - delay)] for k in range(9))]


@pytest.mark.parametrize("delay", [0, 1, 3])
def test_a_slow_receiver_of_a_delayed_value(go, system, delay):
    instances = {"source": ("Count", None), "end": ("Keep", 3.0)}
    seen = list(go(system(instances, [("source.n", "end.u", delay)]))["end.seen"])
    assert seen[3::3] == [max(10, 10 + k - delay) for k in (0, 3, 6)]


@pytest.mark.parametrize(
    ("sample_time", "counts"),
    [
        (0.0, [10, 10, 10, 11, 11, 11, 12, 12, 12, 13]),
        (3.0, [10, 10, 10, 11, 11, 11, 12, 12, 12, 13]),
        (1.5, [10, 10, 10, 12, 12, 12, 14, 14, 14, 16]),
        (1.0, [10, 10, 10, 13, 13, 13, 16, 16, 16, 19]),
    ],
)
def test_a_sampled_component_samples_within_its_own_step(go, system, sample_time, counts):
    result = go(system({"source": ("Count", 3.0, {"sample_time": sample_time})}))
    assert list(result["source.n"]) == counts


def test_states_are_integrated_over_the_longer_step(go, system):
    """x' = -x in steps of 3 s with the default sub-steps, and in steps of 1 s: the same at their common points."""
    result = go(system({"slow": ("Lag", 3.0), "fast": ("Lag", None)}))
    slow, fast = result["slow.x"], result["fast.x"]
    assert slow[::3] == pytest.approx(fast[::3], rel=1e-9)
    assert [list(slow[k : k + 3]) for k in (0, 3, 6)] == [[slow[k]] * 3 for k in (0, 3, 6)]


@pytest.mark.parametrize("record", [2.0, 4.0])
def test_rows_between_two_points_of_a_slow_instance(go, system, record):
    instances = {"source": ("Count", 3.0), "through": ("Pass", 3.0)}
    wires = [("source.n", "through.u")]
    fine = go(system(instances, wires))
    coarse = go(system(instances, wires, record=record))
    rows = sorted({*range(0, 10, round(record)), 9})
    assert list(coarse.time) == rows
    for name in fine.names():
        assert np.array_equal(coarse[name], fine[name][rows])


# -------------------------------------------------------------------- with events

SLOW = {
    "within one interval": (Event("source.n", "override", 4.0, 99.0, duration=1.0), {4: 99}),
    "over an interval's end": (Event("source.n", "bias", 4.0, 100.0, duration=4.0), {4: 111, 5: 111, 6: 112, 7: 112}),
    "over a whole interval": (Event("source.n", "bias", 2.0, 100.0, duration=6.0),
                              {2: 110, 3: 111, 4: 111, 5: 111, 6: 112, 7: 112}),
    "at an interval's end": (Event("source.n", "freeze", 3.0, duration=3.0), {}),
    "held beyond": (Event("source.n", "freeze", 4.0, duration=4.0), {6: 11, 7: 11}),
    "again and again": (Event("source.n", "override", 1.0, 0.0, duration=1.0, every=2.0),
                        dict.fromkeys((1, 3, 5, 7, 9), 0)),
}  # fmt: skip


@pytest.mark.sample(5)
@ALGORITHMS
@pytest.mark.parametrize("name", SLOW)
def test_a_slow_output_is_changed_at_once_and_its_own_value_comes_back(go, system, algorithm, name):
    """Though the instance is at the end of its interval already: what it will show there is not told before."""
    event, changed = SLOW[name]
    instances = {"end": ("Keep", None), "source": ("Count", 3.0)}
    result = go(system(instances, [("source.n", "end.u")], event, algorithm=algorithm))
    n = [changed.get(k, 10 + k // 3) for k in range(10)]
    assert series(result, "source.n", "end.seen") == [n, [-1, *n[:-1]]]


@ALGORITHMS
def test_of_two_on_a_slow_output_the_first_acts_again(go, system, algorithm):
    events = Event("source.n", "bias", 1.0, 100.0, duration=7.0), Event("source.n", "override", 4.0, 0.0, duration=3.0)
    result = go(system({"source": ("Count", 3.0)}, (), *events, algorithm=algorithm))
    assert list(result["source.n"]) == [10, 110, 110, 111, 0, 0, 0, 112, 12, 13]


def test_a_ramp_on_a_slow_output_steps_with_it(go, system):
    result = go(system({"source": ("Count", 3.0)}, (), Event("source.n", "ramp", 1.0, rate=1.0)))
    assert list(result["source.n"]) == [10, 10, 10, 13, 13, 13, 17, 17, 17, 21]


@ALGORITHMS
def test_an_event_on_a_slow_input_counts_where_it_is_read(go, system, algorithm):
    instances = {"source": ("Count", None), "end": ("Keep", 3.0)}
    event = Event("end.u", "override", 1.0, 99.0, duration=3.0)
    result = go(system(instances, [("source.n", "end.u")], event, algorithm=algorithm))
    assert list(result["end.seen"]) == [-1, -1, -1, 10, 10, 10, 99, 99, 99, 16]


def test_an_event_on_a_direct_slow_output(go, system):
    instances = {"source": ("Count", None), "through": ("Sampled", 3.0), "end": ("Keep", None)}
    wires = [("source.n", "through.u"), ("through.y", "end.u")]
    result = go(system(instances, wires, Event("through.y", "bias", 2.0, 100.0, duration=3.0)))
    y, seen = series(result, "through.y", "end.seen")
    assert y == [10, 10, 110, 110, 113, 13, 13, 16, 16, 16]
    # Step 2 passes on 110, step 3 the new 113, step 4 that too; at 5 it is over.
    assert seen == [-1, 10, 10, 110, 113, 113, 13, 16, 16, 16]


# -------------------------------------------------------------------- what is refused, and how it is told


@pytest.mark.parametrize(
    ("step", "how", "message"),
    [
        (2.5, {}, "source: its step = 2.5 s is not a whole multiple of the system's, 1 s"),
        (0.5, {}, "source: its step = 0.5 s is not a whole multiple of the system's, 1 s"),
        (2.0, {}, "source: its step = 2 s does not divide the run of 9 s into whole steps"),
        (3.0, {"algorithm": "iterative"}, "source has a step of its own, which goes with gauss-seidel and jacobi only"),
        (
            3.0,
            {"algebraic_loops": "solve"},
            "source has a step of its own, with which algebraic_loops = 'solve' does not go",
        ),
        (3.0, {"algorithm": "adaptive"}, "source has a step of its own, which goes with gauss-seidel and jacobi only"),
    ],
)
def test_steps_that_do_not_go(system, workspace, step, how, message):
    with pytest.raises(ScenarioError) as caught:
        check(system({"source": ("Lag", step)}, **how), workspace, "plain")
    assert str(caught.value).splitlines() == [message]


def test_a_sample_time_that_does_not_divide_the_instance_s_own_step_is_told(system, workspace):
    checked = check(system({"source": ("Count", 3.0, {"sample_time": 2.0})}), workspace, "plain")
    assert any("source: the communication step 3 s is not a whole multiple of its sample" in n for n in checked.notes)


@pytest.mark.parametrize("how", [{"algorithm": "iterative"}, {"algorithm": "adaptive"}, {"algebraic_loops": "solve"}])
def test_a_step_of_its_own_that_is_the_system_s_is_none(system, workspace, how):
    check(system({"source": ("Lag", 1.0)}, **how), workspace, "plain")


def test_check_tells_of_a_step_of_its_own(system, workspace):
    checked = check(system({"slow": ("Count", 3.0), "fast": ("Lag", None)}), workspace, "plain")
    assert describe_stepping(checked)[1:] == ["slow steps every 3 s"]


# -------------------------------------------------------------------- another step for all

TEXT = """[simulation]
stop_time = 6.0
step = 0.5
[instances.equal]
component = "{0}"
step = 0.5
start.sample_time = 0.5
[instances.slow]
component = "{0}"
count = 2
step = 2.0
start.sample_time = [2.0, 0.5]
[instances."slow[2]"]
step = 0.5
"""


@pytest.fixture
def text(mine):
    return TEXT.format(mine("Count"))


def steps(system):
    return [x.step for x in system.instances.values()], [x.start["sample_time"] for x in system.instances.values()]


@pytest.mark.parametrize("way", ["--step", "--set", "run"])
def test_a_step_of_its_own_stays_unless_it_is_the_system_s(text, way):
    """As a sample time does."""
    changes = {"--step": {"step": 0.25}, "--set": {"settings": ["simulation.step=0.25"]}, "run": {}}[way]
    system = loads(text, "x.toml", **changes)
    if way == "run":
        assert steps(system) == ([0.5, 2.0, 0.5], [0.5, 2.0, 0.5])
        system = run(system, step=0.25, kind="plain").system
    assert steps(system) == ([0.25, 2.0, 0.25], [0.25, 2.0, 0.25])
    assert (system.stepping.step, system.provenance.rescaled_from) == (0.25, 0.5)


def test_half_the_step_halves_the_base(text, tmp_path, capsys):
    """What samples twice as often counts twice as far, and what keeps its own step counts as before."""
    half = at_half_the_step(loads(text, "x.toml"))
    assert (half.stepping.step, half.stepping.record, half.provenance.rescaled_from) == (0.25, 0.5, 0.5)
    assert steps(half) == ([0.25, 2.0, 0.25], [0.25, 2.0, 0.25])
    result = execute(half, kind="plain")
    assert list(result.time) == [0.5 * k for k in range(13)]
    assert [result[f"{name}.n"][-1] for name in ("equal", "slow[1]", "slow[2]")] == [34, 13, 34]
    (tmp_path / "x.toml").write_text(text + '[metrics]\nequal = "final(equal.n)"\nslow = "final(slow[1].n)"\n')
    arguments = ["run", str(tmp_path / "x.toml"), "--verify-step", "--kind", "plain", "-o", str(tmp_path / "out")]
    assert cli.call(arguments) == 1  # too coarse: numbers that count samples change with the step
    words = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert ["equal", "22", "34", "+12"] in words
    assert ["slow", "13", "13", "+0"] in words


def test_a_step_that_no_longer_divides_an_instance_s_own_is_refused(text, workspace):
    with pytest.raises(
        ScenarioError, match=r"slow\[1\]: its step = 2 s is not a whole multiple of the system's, 0\.6 s"
    ):
        check(loads(text, "x.toml", step=0.6), workspace, "plain")


# -------------------------------------------------------------------- a real scenario


@ALGORITHMS
def test_a_platoon_whose_controllers_act_once_in_a_second(algorithm):
    """The force is held in between, and the trains end up where they would have."""
    fast = execute(load("comfort_cruise", algorithm=algorithm, stop_time=100.0))
    slow = execute(load("comfort_cruise", algorithm=algorithm, stop_time=100.0, settings=["cruise.step=1.0"]))
    force = slow["cruise[2].force"]
    changes = np.flatnonzero(np.diff(force)) + 1
    assert set(changes % 10) == {1}, "a new force is recorded at the point after the one it was computed for"
    assert len(changes) == 99
    assert len(set(fast["cruise[2].force"])) > 900
    for name in ("train[2].position", "train[4].position"):
        assert slow[name] == pytest.approx(fast[name], abs=15.0)
        assert not np.array_equal(slow[name], fast[name])


def test_a_slow_train_is_seen_at_its_own_points(go):
    """Its speed is new every second, though the cruise controller looks ten times as often."""
    system = load("comfort_cruise", stop_time=20.0, settings=["train[3].step=1.0"])
    result = execute(system)
    for name in ("position", "speed"):
        values = result[f"train[3].{name}"]
        assert set(np.flatnonzero(np.diff(values)) % 10) == {9}
    assert len(set(result["train[2].speed"])) == 201
