"""What is said about events before a run: each mistake once, with its place and a remedy."""

import math

import pytest
from railcosim.orchestrator.errors import ScenarioError
from railcosim.orchestrator.run.checking import check
from railcosim.orchestrator.run.execution import run
from railcosim.orchestrator.scenario.loading import loads
from railcosim.orchestrator.system import Connection, Event, System

BODY = """
class Outputs(Base):
    '''An output of each type, and parameters.'''

    fixed = Parameter("1", 1.0)
    gain = Parameter("1", 1.0, minimum=0.0, maximum=10.0, tunable=True)
    mode = Parameter("1", 1, type=int, tunable=True)
    x = Memory("m", 0.0, output=True, minimum=-50.0, maximum=50.0)
    k = Memory("1", 0, output=True, type=int)
    on = Memory("1", False, output=True)
    word = Memory("1", "a", output=True)
    row = Memory("1", 0.0, shape=(3,), output=True)
    inner = Memory("1", 0.0)

    def update(self):
        return {"x": self.x, "k": self.k, "on": self.on, "word": self.word, "row": self.row, "inner": self.inner}


class Sum(Base):
    '''Inputs.'''

    u = Input("m", optional=True)
    free = Input("m", optional=True)
    y = Output("m")

    def outputs(self):
        return {"y": self.u + self.free}
"""


@pytest.fixture
def system(components):
    def make(*events, **how):
        it = System(**{"stop_time": 10.0, "step": 0.5} | how, events=list(events))
        it.add("source", components(BODY)("Outputs"))
        it.add("sink", components(BODY)("Sum"))
        it.connect("source.x", "sink.u")
        return it

    return make


@pytest.fixture
def problems(system, workspace):
    def of(*events, **how):
        with pytest.raises(ScenarioError) as caught:
            check(system(*events, **how), workspace, "plain")
        return [str(problem) for problem in caught.value.problems]

    return of


FINE = [
    Event("source.x", "freeze", 1.0),
    Event("source.x", "override", 1, -50),
    Event("source.x", "bias", -1.0, 1e9, duration=0.5, every=0.5),
    Event("source.x", "ramp", 1.0, rate=-1),
    Event("source.k", "override", 1.0, 3.0),
    Event("source.on", "override", 1.0, True),
    Event("source.word", "override", 1.0, ""),
    Event("source.row", "override", 1.0, 5.0),
    Event("source.row[2]", "bias", 1.0, 5.0),
    Event("source.gain", "set", 1.0, 10),
    Event("source.mode", "set", 1.0, -7, every=100.0),
    Event("sink.free", "set", 99.0, 1.0),
    Event("sink.u", "override", 1.0, 1.0, duration=math.pi),
    Event("sink.y", "freeze", 1.0),
]


@pytest.mark.parametrize("event", FINE, ids=lambda event: f"{event.action} {event.signal}")
def test_nothing_is_said_about_what_is_fine(system, workspace, event):
    check(system(event), workspace, "plain")


WRONG = [
    (("sorce.x", "freeze", 1.0), "there is no instance 'sorce'; did you mean 'source'?"),
    (("x", "freeze", 1.0), "there is no instance 'x'"),
    (("source.rwo", "freeze", 1.0), "Outputs has no variable 'rwo'; did you mean 'row'?"),
    (("source.row[4]", "freeze", 1.0), "Outputs has no variable 'row[4]'; there are 'row[1]' to 'row[3]'"),
    (("source", "freeze", 1.0), "Outputs has no variable ''"),
    (("source.x", "frezee", 1.0), "there is no action 'frezee'; did you mean 'freeze'?"),
    (("source.fixed", "set", 1.0, 2.0), "it is a fixed parameter: only tunable ones can change"),
    (("source.gain", "freeze", 1.0), "'freeze' is for outputs and connected inputs, not for causality parameter"),
    (("source.inner", "bias", 1.0, 1.0), "'bias' is for outputs and connected inputs, not for causality local"),
    (
        ("source.x", "set", 1.0, 1.0),
        "'set' is for inputs and tunable parameters, not for a variable of causality output",
    ),
    (("sink.u", "set", 1.0, 1.0), "it is connected; 'override' replaces what it receives"),
    (("sink.free", "freeze", 1.0), "nothing is connected to it, so there is nothing to freeze; use 'set'"),
    (("sink.free", "override", 1.0, 1.0), "nothing is connected to it, so there is nothing to override; use 'set'"),
    (("source.x", "override", 1.0), "takes a finite number, not None"),
    (("source.x", "override", 1.0, True), "takes a finite number, not True"),
    (("source.x", "override", 1.0, "fast"), "takes a finite number, not 'fast'"),
    (("source.x", "override", 1.0, math.nan), "takes a finite number, not nan"),
    (("source.x", "override", 1.0, 51.0), "51.0 is above the limit 50 m"),
    (("source.x", "override", 1.0, -51.0), "-51.0 is below the limit -50 m"),
    (("source.gain", "set", 1.0, 11), "11 is above the limit 10"),
    (("source.k", "override", 1.0, 1.5), "takes a whole number, not 1.5"),
    (("source.k", "override", 1.0, 2**31), "takes a whole number from -2147483648 to 2147483647, not 2147483648"),
    (("source.k", "bias", 1.0, 1.0), "'bias' is for Real variables, not for Integer"),
    (("source.on", "ramp", 1.0, None, 1.0), "'ramp' is for Real variables, not for Boolean"),
    (("source.on", "override", 1.0, 1), "takes true or false, not 1"),
    (("source.word", "override", 1.0, 1), "takes text, not 1"),
    (("source.row", "override", 1.0, "a"), "takes a finite number, not 'a'"),
    (("source.x", "bias", 1.0, math.inf), "value takes a finite number, not inf"),
    (("source.x", "bias", 1.0), "value takes a finite number, not None"),
    (("source.x", "ramp", 1.0), "rate takes a finite number, not None"),
    (("source.x", "freeze", math.nan), "at takes a finite number, not nan"),
    (("source.x", "freeze", 1.0, None, None, -1.0), "duration takes a number greater than 0, not -1.0"),
    (("source.x", "freeze", 1.0, None, None, math.inf), "duration takes a number greater than 0, not inf"),
    (("source.gain", "set", 1.0, 1.0, None, 5.0), "'set' takes no duration; take 'override' for a value that lasts"),
    (("source.gain", "set", 1.0, 1.0, None, None, 0.0), "every takes a number greater than 0, not 0.0"),
    (("source.x", "freeze", 1.0, None, None, None, 5.0), "what begins again must end before: give a duration"),
    (("source.x", "freeze", 1.0, None, None, 6.0, 5.0), "what begins again must end before: give a duration"),
    (
        ("source.x", "freeze", 1.0, None, None, 0.4),
        "duration = 0.4 s is shorter than the step, 0.5 s: it may pass between two points unnoticed",
    ),
    (("source.gain", "set", 1.0, 1.0, None, None, 0.1), "every = 0.1 s is shorter than the step, 0.5 s"),
]


@pytest.mark.parametrize(("arguments", "message"), WRONG, ids=lambda x: " ".join(map(str, x[:2])) if x else "")
def test_each_mistake_is_told_once(problems, arguments, message):
    (problem,) = problems(Event(*arguments))
    assert problem.startswith(f"event on {arguments[0]!r}: {message}")


def test_a_whole_number_of_an_enumeration_may_be_named(foreign, xml, workspace):
    v = xml["variable"]
    types = '</UnitDefinitions><TypeDefinitions><SimpleType name="Gear"><Enumeration><Item name="north" value="1"/>'
    types += '<Item name="south" value="4"/></Enumeration></SimpleType></TypeDefinitions><UnitDefinitions>'
    variables = [
        v("way", "input", "Enumeration", 1, declaredType="Gear", variability="discrete"),
        v("y", "output", "Enumeration", 1, declaredType="Gear", variability="discrete"),
    ]
    path = foreign(variables, "    def step(self, t, h, v):\n        v[1] = v[0]\n", units=types)
    system = System(stop_time=4.0, step=1.0)
    system.add("it", path)
    system.events = [Event("it.way", "set", 1.0, "south"), Event("it.y", "override", 3.0, "north")]
    assert list(run(system)["it.y"])[1:] == [1, 4, 1, 1]
    system.events = [Event("it.way", "set", 1.0, "west")]
    with pytest.raises(ScenarioError, match="takes a finite number, not 'west'"):
        check(system, workspace)
    system.events = [Event("it.way", "set", 1.0, 3)]
    with pytest.raises(ScenarioError, match=r"takes one of north \(1\), south \(4\), not 3"):
        check(system, workspace)


def test_an_adaptive_run_lands_on_both_ends_of_the_shortest_event(components, workspace):
    body = "class Grow(Base):\n    x = State('1', 0.0, output=True)\n" \
           "    def derivatives(self):\n        return {'x': 1.0}\n"  # fmt: skip
    it = System(stop_time=1.0, step=0.5, algorithm="adaptive", events=[Event("grow.x", "freeze", 0.3, duration=0.01)])
    it.add("grow", components(body, "grow.py")("Grow"))
    check(it, workspace, "plain")


def test_an_input_is_read_at_its_instance_s_own_steps_only(system, workspace):
    """An output, though, is changed for those that step more often."""
    it = system(Event("sink.u", "freeze", 1.0, duration=0.5), Event("sink.y", "freeze", 1.0, duration=0.5))
    it.instances["sink"].step = 1.0
    with pytest.raises(ScenarioError) as caught:
        check(it, workspace, "plain")
    assert str(caught.value).splitlines() == [
        "event on 'sink.u': duration = 0.5 s is shorter than the step, 1 s: it may pass between two points unnoticed"
    ]


def test_each_instance_s_mistake_stands_at_its_place_in_the_file(components, workspace):
    model = components(BODY)("Outputs")
    text = f'[simulation]\nstop_time = 1.0\n[instances.source]\ncomponent = "{model}"\ncount = 3\n'
    text += '[[events]]\nsignal = "source.xx"\naction = "freeze"\nat = 0.5\n'
    with pytest.raises(ScenarioError) as caught:
        check(loads(text, "x.toml"), workspace, "plain")
    assert str(caught.value).splitlines() == [
        f"x.toml:6: event on 'source[{k}].xx': Outputs has no variable 'xx'; did you mean 'x'?" for k in (1, 2, 3)
    ]


def connect(signal="sink.u", source="source.x", at=1.0, **how):
    return Event(signal, "connect", at, source=source and Connection(source, signal), **how)


@pytest.mark.parametrize(
    ("event", "problem"),
    [
        (connect("sink.free"), "it follows nothing before; connect it to something in [connections]"),
        (connect("source.x"), "'connect' is for inputs, not for causality output"),
        (connect(source=None), "no source is given; say what the input follows"),
        (connect(fade=-1.0), "fade takes a number greater than 0, not -1.0"),
        (connect(fade=0.1), "fade = 0.1 s is shorter than the step, 0.5 s: it may pass between two points unnoticed"),
        (connect(every=5.0), "what begins again must end before: give a duration that is not longer than every"),
    ],
)
def test_a_connection_that_cannot_be_made(problems, event, problem):
    assert problems(event) == [f"event on {event.signal!r}: {problem}"]


def test_a_source_that_is_not_there(problems):
    (problem,) = problems(connect(source="source.y"))
    assert problem.startswith("event on 'sink.u', from 'source.y': Outputs (source) has no variable 'y'")


def test_only_what_is_real_can_fade(mine, workspace):
    system = System(events=[connect("a.n", "a.m", fade=1.0)])
    system.add("a", mine("EveryType"))
    system.connect("a.m", "a.n")
    with pytest.raises(ScenarioError, match=r"'a\.n': fade is for Real variables, not for Integer"):
        check(system, workspace, "plain")
