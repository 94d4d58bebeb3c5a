"""Events while a run goes: what each does to whom, from when to when, with answers known by hand."""

import json

import pytest
from railcosim.orchestrator.errors import FmuError
from railcosim.orchestrator.master import compiled
from railcosim.orchestrator.run.execution import execute, run
from railcosim.orchestrator.system import Event, System

ALGORITHMS = pytest.mark.parametrize("algorithm", ["gauss-seidel", "jacobi"])


@pytest.fixture(params=["plain", "compiled"])
def go(request, monkeypatch):
    """Run a system: as Python objects, or as FMUs in the compiled loop, which then must have been used."""
    if request.param == "compiled" and compiled.kernel is None:
        pytest.skip("installed without the compiled step loop")
    blocks = []

    def counted(*arguments):
        blocks.append(arguments)
        return kernel.run(*arguments)

    def attempt(system, **how):
        result = run(system, kind="plain" if request.param == "plain" else "python", **how)
        assert (request.param == "compiled") == bool(blocks)
        return result

    kernel = compiled.kernel
    if request.param == "compiled":
        stand_in = type("Kernel", (), {"run": staticmethod(counted), "HAS_THREADS": False})
        monkeypatch.setattr(compiled, "kernel", stand_in)
    return attempt


@pytest.fixture
def chain(mine):
    """A counter, what passes its value on at once, and what keeps it: with events."""

    def make(*events, **how):
        system = System(**{"stop_time": 5.0, "step": 1.0} | how, events=list(events))
        system.add("source", mine("Count"))
        system.add("through", mine("Pass"))
        system.add("end", mine("Keep"))
        system.connect("source.n", "through.u")
        system.connect("through.y", "end.u")
        return system

    return make


def series(result, *names):
    return [list(result[name]) for name in names]


# -------------------------------------------------------------------- each action


ACTIONS = {
    "override": (Event("", "override", 2.0, 99.0, duration=2.0), [10, 11, 99, 99, 14, 15]),
    "for ever": (Event("", "override", 2.0, 99.0), [10, 11, 99, 99, 99, 99]),
    "freeze": (Event("", "freeze", 2.0, duration=2.0), [10, 11, 12, 12, 14, 15]),
    "bias": (Event("", "bias", 2.0, 100.0, duration=2.0), [10, 11, 112, 113, 14, 15]),
    "ramp": (Event("", "ramp", 2.0, rate=5.0, duration=3.0), [10, 11, 12, 18, 24, 15]),
}


@pytest.mark.sample(8)
@ALGORITHMS
@pytest.mark.parametrize("name", ACTIONS)
def test_on_an_output_everyone_sees_it_and_so_does_the_record(go, chain, algorithm, name):
    event, values = ACTIONS[name]
    event.signal = "source.n"
    result = go(chain(event, algorithm=algorithm))
    first = values[:1]
    n, y, seen = series(result, "source.n", "through.y", "end.seen")
    assert n == values
    assert y == first + values[:-1]
    assert seen == [-1, *(y[1:] if algorithm == "gauss-seidel" else y[:-1])]


@pytest.mark.sample(8)
@ALGORITHMS
@pytest.mark.parametrize("name", ACTIONS)
def test_on_an_input_that_receiver_alone_sees_it(go, chain, mine, algorithm, name):
    event, values = ACTIONS[name]
    event.signal = "through.u"
    system = chain(event, algorithm=algorithm)
    system.add("other", mine("Pass"))
    system.connect("source.n", "other.u")
    result = go(system)
    n, y, other = series(result, "source.n", "through.y", "other.y")
    assert n == [10, 11, 12, 13, 14, 15]
    assert other == [10, 10, 11, 12, 13, 14]
    assert y == [10, *values[:-1]]


def test_a_direct_output_is_changed_for_the_steps_that_begin_meanwhile(go, chain):
    """And in the record at those points, where it still is what was computed for the step before."""
    result = go(chain(Event("through.y", "bias", 2.0, 100.0, duration=2.0)))
    y, seen = series(result, "through.y", "end.seen")
    assert y == [10, 10, 111, 112, 13, 14]
    assert seen == [-1, 10, 11, 112, 113, 14]


TYPES = [
    ("override", 40, "m", [1, 1, 40, 40, 1, 1]),
    ("freeze", None, "m", [1, 1, 1, 1, 1, 1]),
    ("override", True, "off", [1, 0, 1, 1, 0, 0]),
    ("override", False, "off", [1, 0, 0, 0, 0, 0]),
    ("freeze", None, "off", [1, 0, 0, 0, 0, 0]),
    ("override", "loud", "said", ["a", "b", "loud", "loud", "b", "b"]),
    ("freeze", None, "said", ["a", "b", "b", "b", "b", "b"]),
]


@pytest.mark.parametrize("kind", ["plain", "python"])
@pytest.mark.parametrize("case", TYPES)
def test_every_type_as_an_output(mine, kind, case):
    action, value, name, values = case
    system = System(stop_time=5.0, step=1.0, events=[Event(f"it.{name}", action, 2.0, value, duration=2.0)])
    system.add("it", mine("EveryType"))
    assert list(run(system, kind=kind)[f"it.{name}"]) == values


@pytest.mark.parametrize("kind", ["plain", "python"])
def test_every_type_as_an_input(mine, kind):
    """A ring of one: each value comes back a step later, and what is frozen does not."""
    events = [
        Event("it.n", "override", 2.0, 40, duration=2.0),
        Event("it.on", "override", 2.0, False, duration=2.0),
        Event("it.word", "freeze", 2.0, duration=2.0),
    ]
    system = System(stop_time=5.0, step=1.0, events=events)
    system.add("it", mine("EveryType"))
    for source, target in (("m", "n"), ("off", "on"), ("said", "word")):
        system.connect(f"it.{source}", f"it.{target}")
    result = run(system, kind=kind)
    assert list(result["it.m"]) == [1, 2, 3, 41, 41, 42]
    assert list(result["it.off"]) == [1, 1, 1, 0, 0, 0]
    assert list(result["it.said"]) == ["a", "ab", "abb", "abbb", "abbb", "abbbb"]


def test_arrays_as_a_whole_and_by_element(go, mine):
    events = [
        Event("a.x", "override", 2.0, -5.0, duration=1.0),
        Event("b.u[2]", "bias", 3.0, 100.0, duration=1.0),
        Event("a.x[3]", "freeze", 4.0),
    ]
    system = System(stop_time=6.0, step=1.0, events=events)
    system.add("a", mine("Row"))
    system.add("b", mine("Row"))
    system.connect("a.x", "b.u")
    result = go(system)
    names = [f"a.x[{k}]" for k in (1, 2, 3)] + [f"b.seen[{k}]" for k in (1, 2, 3)]
    assert series(result, *names) == [
        [1, 2, -5, 4, 5, 6, 7],
        [1, 2, -5, 4, 5, 6, 7],
        [1, 2, -5, 4, 5, 5, 5],
        [0, 1, 2, -5, 4, 5, 6],
        [0, 1, 2, -5, 104, 5, 6],
        [0, 1, 2, -5, 4, 5, 5],
    ]
    assert [what["signal"] for what in result.coupling["events"] if what["time"] == 2.0] == names[:3]


def test_a_value_is_in_the_unit_of_the_signal_itself(go, mine):
    """On the output in km, before conversion and scale; on the input in m, after both."""
    for signal, value in (("far.d", 7.0), ("near.u", 3501.0)):
        system = System(stop_time=4.0, step=1.0, events=[Event(signal, "override", 2.0, value, duration=1.0)])
        system.add("far", mine("Kilometres"))
        system.add("near", mine("Metres"))
        system.connect("far.d", "near.u", scale=0.5, offset=1.0)
        result = go(system)
        assert list(result["near.y"]) == [501.0, 501.0, 1001.0, 3501.0, 2001.0]
        assert list(result["far.d"]) == [1.0, 2.0, 7.0 if signal == "far.d" else 3.0, 4.0, 5.0]


@pytest.mark.parametrize("delay", [1, 2])
def test_a_change_of_an_output_is_delayed_with_it_and_one_of_an_input_is_not(go, chain, delay):
    """An output: what was changed then arrives now. An input: what arrives now is changed."""
    plain = [10] * delay + [10, 11, 12, 13, 14, 15]
    for signal in ("source.n", "through.u"):
        system = chain(Event(signal, "bias", 2.0, 100.0, duration=2.0))
        system.connections[0].delay = delay
        received = list(go(system)["through.y"])[1:]
        late = delay if signal == "source.n" else 0
        assert received == [plain[k] + 100.0 * (2 <= k - late < 4) for k in range(5)]


# -------------------------------------------------------------------- when


def test_of_several_the_one_that_began_last_acts_and_then_the_other_again(go, chain):
    events = [
        Event("source.n", "override", 1.0, 50.0, duration=5.0),
        Event("source.n", "bias", 2.0, 100.0, duration=2.0),
        Event("source.n", "freeze", 3.0, duration=2.0),
        Event("source.n", "override", 3.0, 70.0, duration=1.0),
    ]
    # 1: the first; 2: the bias of the true value; 3: the freeze of that, and the last in the file of the two
    result = go(chain(*events, stop_time=8.0))
    assert list(result["source.n"]) == [10, 50, 112, 70, 113, 50, 16, 17, 18]
    assert [(what["time"], what["phase"], what["value"]) for what in result.coupling["events"]] == [
        (1.0, "begin", 50.0),
        (2.0, "begin", 100.0),
        (3.0, "begin", 113.0),
        (3.0, "begin", 70.0),
        (4.0, "end", 100.0),
        (4.0, "end", 70.0),
        (5.0, "end", None),
        (6.0, "end", 50.0),
    ]


@ALGORITHMS
def test_again_and_again(go, chain, algorithm):
    event = Event("source.n", "bias", 1.0, 100.0, duration=2.0, every=4.0)
    result = go(chain(event, stop_time=11.0, algorithm=algorithm))
    assert list(result["source.n"]) == [10 + k + 100 * (k % 4 in (1, 2)) for k in range(12)]


@pytest.mark.parametrize("step", [1.0, 0.3])
def test_one_that_begins_again_as_it_ends_samples_and_holds(go, chain, step):
    """Whatever rounding makes of 0.9 k and 0.9 (k - 1) + 0.9: for some k the end comes later than the next begin."""
    event = Event("source.n", "freeze", 3 * step, duration=3 * step, every=3 * step)
    result = go(chain(event, step=step, stop_time=60 * step))
    assert list(result["source.n"]) == [10 + (k if k < 3 else k // 3 * 3) for k in range(61)]
    assert len(result.coupling["events"]) == 39


def test_a_value_is_set_again_and_again(go, chain):
    """The second one undoes what the first one did."""
    events = [
        Event("through.gain", "set", 1.0, 2.0, every=4.0),
        Event("through.gain", "set", 3.0, 3.0, every=4.0),
    ]
    result = go(chain(*events, stop_time=10.0))
    gains = [1, 2, 2, 3, 3, 2, 2, 3, 3, 2]
    assert list(result["through.y"])[1:] == [(10 + k) * gain for k, gain in enumerate(gains)]


def test_at_the_start(go, chain):
    """The first row shows it."""
    result = go(chain(Event("source.n", "override", 0.0, 99.0, duration=2.0)))
    assert series(result, "source.n", "through.y") == [[99, 99, 12, 13, 14, 15], [10, 99, 99, 12, 13, 14]]
    frozen = go(chain(Event("through.u", "freeze", 0.0, duration=2.0)))
    assert list(frozen["through.y"]) == [10, 10, 10, 12, 13, 14]


def test_at_the_end(go, chain):
    """The last row shows it, and nobody else can."""
    result = go(chain(Event("source.n", "override", 5.0, 99.0)))
    assert series(result, "source.n", "through.y") == [[10, 11, 12, 13, 14, 99], [10, 10, 11, 12, 13, 14]]
    assert [what["time"] for what in result.coupling["events"]] == [5.0]
    late = go(chain(Event("source.n", "override", 5.1, 99.0)))
    assert (list(late["source.n"])[-1], late.coupling["events"]) == (15, [])


def test_between_two_points_it_begins_and_ends_at_the_next(go, chain):
    result = go(chain(Event("source.n", "bias", 1.5, 100.0, duration=2.0)))
    assert list(result["source.n"]) == [10, 11, 112, 113, 14, 15]


def test_a_ramp_counts_from_its_own_begin(go, chain):
    """Not from the point at which it is first felt: a longer step sees the same course."""
    result = go(chain(Event("source.n", "ramp", 1.5, rate=10.0)))
    assert list(result["source.n"]) == [10, 11, 12 + 5, 13 + 15, 14 + 25, 15 + 35]


@pytest.mark.parametrize(
    ("event", "values"),
    [
        (Event("source.n", "override", -7.0, 99.0, duration=9.0), [99, 99, 12, 13, 14, 15]),
        (Event("source.n", "override", -7.0, 99.0, duration=7.0), [10, 11, 12, 13, 14, 15]),
        (Event("source.n", "ramp", -7.0, rate=1.0, duration=9.0), [17, 19, 12, 13, 14, 15]),
        (Event("source.n", "bias", -1e7, 100.0, duration=1.0, every=5.0), [110, 11, 12, 13, 14, 115]),
        (Event("source.n", "bias", -1e7 - 1.0, 100.0, duration=3.0, every=5.0), [110, 111, 12, 13, 114, 115]),
    ],
)
def test_before_the_start(go, chain, event, values):
    """What began before acts from the start on, and what was over is not told of."""
    result = go(chain(event))
    assert list(result["source.n"]) == values
    times = [what["time"] for what in result.coupling["events"]]
    assert all(time >= 0.0 for time in times)
    assert len(times) <= 4


@pytest.mark.parametrize("every", [None, 20.0])
def test_what_was_set_before_the_start_is_set(go, chain, every):
    result = go(chain(Event("through.gain", "set", -5.0, 2.0, every=every)))
    assert list(result["through.y"]) == [10, 20, 22, 24, 26, 28]


@pytest.mark.parametrize("start", [0.0, -3.7, 1e5])
def test_a_late_start_shifts_nothing(go, chain, start):
    event = Event("source.n", "bias", start + 1.2, 100.0, duration=1.2)
    result = go(chain(event, start_time=start, stop_time=start + 4.0, step=0.4))
    assert list(result["source.n"]) == [10 + k + 100 * (3 <= k < 6) for k in range(11)]


def test_a_record_that_is_coarser_than_the_steps(go, chain):
    """Rows are of their own points, whether anything happens there or between."""
    events = [Event("source.n", "bias", 1.0, 100.0, duration=1.0), Event("source.n", "bias", 3.0, 200.0, duration=3.0)]
    result = go(chain(*events, stop_time=7.0, record=3.0))
    assert list(result.time) == [0, 3, 6, 7]
    assert list(result["source.n"]) == [10, 213, 16, 17]
    assert list(result["through.y"]) == [10, 12, 215, 16]


# -------------------------------------------------------------------- setting


def test_an_unconnected_input_keeps_what_it_was_set_to(go, chain, mine):
    system = chain(Event("free.u", "set", 2.0, 7), Event("free.u", "set", 3.5, -7.5))
    system.add("free", mine("Pass"), u=1.0)
    assert list(go(system)["free.y"]) == [1, 1, 1, 7, 7, -7.5]


@pytest.mark.parametrize("kind", ["native", "python", "plain"])
def test_a_tunable_parameter_changes_what_the_model_does(mine, kind):
    system = System(stop_time=4.0, step=1.0, events=[Event("it.gain", "set", 2.0, 3.0)])
    system.add("it", mine("Pass"), u=5.0)
    assert list(run(system, kind=kind)["it.y"]) == [5, 5, 5, 15, 15]


def test_setting_at_a_point_does_not_show_there_whatever_else_happens(go, chain):
    """Another event of the same instance has its outputs looked at: what was set counts from the next step on."""
    for events in ([], [Event("through.y", "bias", 1.0, 0.0, duration=1.0)]):
        result = go(chain(Event("through.gain", "set", 2.0, 10.0), *events))
        assert list(result["through.y"]) == [10, 10, 11, 120, 130, 140]


def test_an_fmu_that_refuses_what_is_set_is_named_with_the_time(foreign, xml):
    v = xml["variable"]
    body = "    def set_real(self, references, values):\n        1 / (values[0] - 7.0)\n"
    path = foreign([v("p", "parameter", start=1.0, variability="tunable"), v("y", "output")], body)
    system = System(stop_time=5.0, step=1.0, events=[Event("it.p", "set", 3.0, 7.0)])
    system.add("it", path)
    outcome = execute(system)
    assert (outcome.status, outcome.error.instance, outcome.error.time) == ("failed", "it", 3.0)
    assert list(outcome.time) == [0.0, 1.0, 2.0, 3.0], "the step to there went well"


# -------------------------------------------------------------------- what is not finite


@pytest.mark.parametrize("action", ["override", "bias"])
def test_what_is_not_finite_is_blamed_on_its_source_even_if_nobody_sees_it(mine, action):
    system = System(stop_time=5.0, step=1.0, events=[Event("bad.y", action, 1.0, 5.0)])
    system.add("bad", mine("Fails"), until=2.5)
    system.add("end", mine("Keep"))
    system.connect("bad.y", "end.u")
    with pytest.raises(FmuError, match=r"^bad, t = "):
        run(system, kind="plain")


# -------------------------------------------------------------------- the record of the run


def test_run_json_tells_what_was_asked_for_and_what_happened(chain, tmp_path):
    run(chain(Event("source.n", "freeze", 1.5, duration=2.0)), kind="plain", output=tmp_path)
    record = json.loads((tmp_path / "run.json").read_text())
    (asked,) = record["events"]
    assert (asked["signal"], asked["action"], asked["at"], asked["duration"]) == ("source.n", "freeze", 1.5, 2.0)
    assert record["coupling"]["events"] == [
        {"time": 2.0, "signal": "source.n", "action": "freeze", "phase": "begin", "value": 12.0, "rate": None},
        {"time": 4.0, "signal": "source.n", "action": "freeze", "phase": "end", "value": None, "rate": None},
    ]
