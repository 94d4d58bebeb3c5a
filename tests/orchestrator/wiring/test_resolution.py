"""A system against the interfaces of its models: what goes where, and everything that is wrong with it."""

import numpy as np
import pytest
from railcosim.orchestrator.fmi.models import load_models
from railcosim.orchestrator.fmi.reader import read_interface
from railcosim.orchestrator.system import System
from railcosim.orchestrator.wiring import is_direct, wire
from railcosim.orchestrator.wiring.starts import instance_seed

BODY = """
class Source(Base):
    '''One output of every type, and some units.'''

    metres = State("m", 1.0, output=True)
    kilometres = Memory("km", 2.0, output=True)
    kmh = Memory("km/h", 36.0, output=True)
    celsius = Memory("degC", 20.0, output=True)
    seconds = Memory("s", 3.0, output=True)
    plain = Memory("1", 4.0, output=True)
    whole = Memory("1", 5, type=int, output=True)
    truth = Memory("1", True, output=True)
    word = Memory("1", "six", output=True)
    row = Memory("m", shape=(3,), output=True)

    def derivatives(self):
        return {"metres": 0.0}

    def update(self):
        return {n: getattr(self, n) for n in "kilometres kmh celsius seconds plain whole truth word row".split()}


class Sink(Base):
    '''One input of every type.'''

    metres = Input("m", optional=True)
    speed = Input("m/s", optional=True)
    kelvin = Input("K", optional=True)
    plain = Input("1", optional=True)
    whole = Input("1", 0, type=int, optional=True)
    truth = Input("1", False, optional=True)
    word = Input("1", "", optional=True)
    row = Input("m", shape=(3,), optional=True)
    pair = Input("m", shape=(2,), optional=True)
    y = Output("m")

    def outputs(self):
        return {"y": self.metres}


class Settings(Base):
    '''Parameters of every type, with bounds.'''

    gain = Parameter("1/s", 1.0, minimum=0.0, maximum=2.0)
    gears = Parameter("1", 2, type=int, minimum=1, maximum=9)
    on = Parameter("1", False)
    label = Parameter("1", "name")
    row = Parameter("m", shape=(3,))
    one = Parameter("m", shape=(1,))
    x = State("m", 0.0, output=True)
    y = Output("m")

    def derivatives(self):
        return {"x": self.gain}

    def outputs(self):
        return {"y": self.x}


class Needy(Base):
    '''Needs one input and would like another.'''

    recommended_step = 0.1
    sample_time = Parameter("s", 0.2)
    needed = Input("m")
    needed_row = Input("m", shape=(2,))
    wanted = Input("m", optional=True)
    y = Memory("m", 0.0, output=True)

    def update(self):
        return {"y": self.needed}


class Dice(Base):
    '''Random.'''

    hold = Parameter("s", 0.1)
    draw = Noise(hold)
    y = Output("1")

    def outputs(self):
        return {"y": self.draw}
"""


def said(wiring):
    """The problems as they are printed."""
    return [str(problem) for problem in wiring.problems]


METRES_TO_TRACK = '<Unit name="km"><BaseUnit m="1" factor="1000"/></Unit><Unit name="m"><BaseUnit m="1"/></Unit>'


@pytest.fixture
def mine(components):
    return components(BODY)


@pytest.fixture
def resolve(workspace):
    """Wire a system of components in this process."""

    def run(system):
        models = load_models(system, workspace, "plain")
        return wire(system, {name: model.interface for name, model in models.items()})

    return run


@pytest.fixture
def pair(mine):
    def make():
        system = System()
        system.add("a", mine("Source"))
        system.add("b", mine("Sink"))
        return system

    return make


@pytest.fixture
def connected(pair, resolve):
    """Wire one connection between a source and a sink."""

    def run(source, target, **how):
        system = pair()
        system.connect(source, target, **how)
        return resolve(system)

    return run


# -------------------------------------------------------------------- units


@pytest.mark.parametrize(
    ("source", "target", "value", "expected"),
    [
        ("metres", "metres", 5.0, 5.0),
        ("kilometres", "metres", 5.0, 5000.0),
        ("kmh", "speed", 36.0, 10.0),
        ("celsius", "kelvin", 20.0, 293.15),
        ("plain", "plain", 5.0, 5.0),
        ("plain", "metres", 5.0, 5.0),  # a plain number says nothing of its unit
        ("whole", "plain", 5, 5),
    ],
)
def test_units_are_converted(connected, source, target, value, expected):
    wiring = connected(f"a.{source}", f"b.{target}")
    assert wiring.problems == []
    (link,) = wiring.links
    assert link.scale * value + link.offset == pytest.approx(expected, rel=1e-15)


def test_scale_and_offset_apply_after_the_conversion(connected):
    """Both are of the input's unit: twice the kilometres, less 100 m."""
    (link,) = connected("a.kilometres", "b.metres", scale=2.0, offset=-100.0).links
    assert link.scale * 5.0 + link.offset == 2.0 * 5000.0 - 100.0
    (link,) = connected("a.celsius", "b.kelvin", scale=2.0, offset=1.0).links
    assert link.scale * 20.0 + link.offset == pytest.approx(2.0 * 293.15 + 1.0)


def test_another_dimension_is_refused(connected):
    assert said(connected("a.seconds", "b.metres")) == ["'b.metres' = 'a.seconds': unit 's' does not convert to 'm'"]


def test_a_unit_that_nobody_defined_passes_values_as_they_are_and_is_told(resolve, foreign, xml, mine):
    """Many tools write units without defining them: the scenario shall run, and say what it takes for granted."""
    path = foreign([xml["variable"]("y", "output", unit="furlong"), xml["variable"]("z", "output", unit="furlong")])
    system = System()
    system.add("a", path)
    system.add("b", mine("Sink"))
    system.connect("a.y", "b.metres")
    system.connect("a.z", "b.speed")
    system.connect("a.z", "b.kelvin", scale=2.0)  # whoever gives a scale knows
    wiring = resolve(system)
    assert wiring.problems == [p for p in wiring.problems if "required input" in p.message]
    assert [(link.scale, link.offset) for link in wiring.links] == [(1.0, 0.0), (1.0, 0.0), (2.0, 0.0)]
    note = "'furlong' is not defined in SI units by Foreign: what is in 'furlong' is taken for"
    assert [text for text in wiring.notes if note in text] == [
        f"'b.{target}' = 'a.{source}': {note} '{unit}' as it is; where they differ, give the connection a scale"
        for source, target, unit in (("y", "metres", "m"), ("z", "speed", "m/s"))
    ]


def test_the_units_of_another_maker_s_fmu(resolve, foreign, xml, mine):
    system = System()
    system.add("a", foreign([xml["variable"]("y", "output", unit="km")], units=METRES_TO_TRACK))
    system.add("b", mine("Sink"))
    system.connect("a.y", "b.metres")
    (link,) = resolve(system).links
    assert (link.scale, link.offset) == (1000.0, 0.0)


# -------------------------------------------------------------------- types


@pytest.mark.parametrize(("source", "target"), [("whole", "whole"), ("truth", "truth"), ("word", "word")])
def test_every_type_connects_to_its_own(connected, source, target):
    wiring = connected(f"a.{source}", f"b.{target}")
    assert wiring.problems == []
    assert [(x.source, x.target) for x in wiring.links] == [(("a", source), ("b", target))]


@pytest.mark.parametrize(
    ("source", "target", "a", "b"),
    [
        ("plain", "whole", "Real", "Integer"),
        ("truth", "whole", "Boolean", "Integer"),
        ("truth", "plain", "Boolean", "Real"),
        ("whole", "truth", "Integer", "Boolean"),
        ("plain", "truth", "Real", "Boolean"),
        ("word", "plain", "String", "Real"),
        ("plain", "word", "Real", "String"),
    ],
)
def test_other_types_are_refused(connected, source, target, a, b):
    wiring = connected(f"a.{source}", f"b.{target}")
    assert said(wiring) == [f"'b.{target}' = 'a.{source}': a {a} output cannot feed a {b} input"]
    assert wiring.links == []


def test_an_integer_is_not_scaled(connected):
    assert said(connected("a.whole", "b.whole", scale=2.0)) == [
        "'b.whole' = 'a.whole': scale and offset apply to Real inputs, not to Integer"
    ]


@pytest.mark.parametrize("delay", [-1, 1.0, True, "1"])
def test_a_delay_counts(connected, delay):
    assert said(connected("a.metres", "b.metres", delay=delay)) == [
        f"'b.metres' = 'a.metres': delay counts communication points: 0, 1, 2, ..., not {delay!r}"
    ]


# -------------------------------------------------------------------- names


@pytest.mark.parametrize(
    ("source", "target", "problem"),
    [
        ("a.metres", "b.meters", "Sink (b) has no variable 'meters'; did you mean 'metres'?"),
        ("a.kilometers", "b.metres", "Source (a) has no variable 'kilometers'; did you mean 'kilometres'?"),
        ("a.rwo", "b.row", "Source (a) has no variable 'rwo'; did you mean 'row'?"),
        ("a.qqq", "b.metres", "Source (a) has no variable 'qqq'; its outputs are metres, kilometres, kmh"),
        ("aa.metres", "b.metres", "there is no instance 'aa'; did you mean 'a'?"),
        ("a.metres", "train[3].metres", "there is no instance 'train[3]'"),
        ("a", "b.metres", "Source (a) has no variable ''"),
        ("b.metres", "b.metres", "b.metres is not an output but input"),
        ("a.metres", "b.y", "b.y is not an input but output"),
    ],
)
def test_a_wrong_name_gets_the_nearest(connected, source, target, problem):
    (found,) = said(connected(source, target))
    assert found.startswith(f"{target!r} = {source!r}: {problem}")


def test_all_problems_are_found_and_say_where_they_were_written(pair, resolve):
    system = pair()
    system.connect("a.nothing", "b.nothing")
    system.connect("a.seconds", "b.metres")
    system.connect("a.plain", "b.plain")
    system.connections[0].origin, system.connections[1].origin = "x.toml:8", "x.toml:9"
    system.instances["b"].origin = "x.toml:4"
    system.instances["b"].start["wrod"] = "x"
    found = said(resolve(system))
    assert len(found) == 4
    assert found[0].startswith("x.toml:4: b.wrod: Sink has no such variable; did you mean 'word'?")
    assert [text.partition(": ")[0] for text in found] == ["x.toml:4", "x.toml:8", "x.toml:8", "x.toml:9"]


# -------------------------------------------------------------------- arrays


def test_arrays_connect_by_name(connected):
    wiring = connected("a.row", "b.row", delay=2, scale=3.0)
    assert wiring.problems == []
    assert [(x.source[1], x.target[1], x.delay, x.scale) for x in wiring.links] == [
        (f"row[{k}]", f"row[{k}]", 2, 3.0) for k in (1, 2, 3)
    ]


def test_one_element_connects_alone(connected):
    (link,) = connected("a.row[3]", "b.pair[1]").links
    assert (link.source, link.target) == (("a", "row[3]"), ("b", "pair[1]"))


@pytest.mark.parametrize(
    ("source", "target", "lengths"),
    [("row", "pair", "the output has 3 elements, the input 2"), ("metres", "pair", "the output has 1 elements")],
)
def test_arrays_of_other_lengths_are_refused(connected, source, target, lengths):
    (found,) = said(connected(f"a.{source}", f"b.{target}"))
    assert found.startswith(f"'b.{target}' = 'a.{source}': {lengths}")


# -------------------------------------------------------------------- start values


@pytest.fixture
def started(resolve, mine):
    """Start values of one instance of Settings; its problems, and what came out."""

    def run(index=None, count=1, swapped=False, **start):
        system = System()
        instance = system.add("s", mine("Settings"), **start)
        instance.index, instance.count, instance.swapped = index, count, swapped
        wiring = resolve(system)
        return said(wiring), wiring.starts["s"], wiring.notes

    return run


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ({"gain": 2}, {"gain": 2.0}),
        ({"gain": np.float32(0.5), "gears": np.int64(3)}, {"gain": 0.5, "gears": 3}),
        ({"gain": "i / count"}, {"gain": 0.5}),
        ({"gears": "1 + i"}, {"gears": 3}),
        ({"gears": 3.0}, {"gears": 3}),
        ({"on": True}, {"on": 1}),
        ({"on": "i < count"}, {"on": 1}),
        ({"on": "i == count"}, {"on": 0}),
        ({"label": "i < count"}, {"label": "i < count"}),  # a text stays a text
        ({"row": 7.0}, {"row[1]": 7.0, "row[2]": 7.0, "row[3]": 7.0}),
        ({"row": [1, 2.0, "i"]}, {"row[1]": 1.0, "row[2]": 2.0, "row[3]": 2.0}),
        ({"row": (1.0, 2.0, 3.0)}, {"row[1]": 1.0, "row[2]": 2.0, "row[3]": 3.0}),
        ({"row": np.arange(3.0)}, {"row[1]": 0.0, "row[2]": 1.0, "row[3]": 2.0}),
        ({"row[2]": 5.0}, {"row[2]": 5.0}),
        ({"one": [5.0]}, {"one[1]": 5.0}),  # an array of one is an array
        ({"x": -3.0}, {"x": -3.0}),
    ],
)
def test_start_values(started, given, expected):
    problems, values, _ = started(index=2, count=4, **given)
    assert problems == []
    assert values == expected
    assert [type(v) for v in values.values()] == [type(v) for v in expected.values()]


@pytest.mark.parametrize(
    ("given", "problem"),
    [
        ({"gian": 1.0}, "s.gian: Settings has no such variable; did you mean 'gain'?"),
        ({"gain": True}, "s.gain: takes a number, not True"),
        ({"gain": None}, "s.gain: takes a number, not None"),
        ({"gain": {"a": 1}}, "s.gain: takes a number, not {'a': 1}"),
        ({"gain": float("nan")}, "s.gain: takes a finite number, not nan"),
        ({"gain": float("inf")}, "s.gain: takes a finite number, not inf"),
        ({"gain": 10**400}, f"s.gain: takes a finite number, not {10**400}"),
        ({"gain": -1.0}, "s.gain: -1.0 is below the limit 0 1/s"),
        ({"gain": 2.5}, "s.gain: 2.5 is above the limit 2 1/s"),
        ({"gears": 0}, "s.gears: 0 is below the limit 1"),
        ({"gears": 10}, "s.gears: 10 is above the limit 9"),
        ({"gears": 2.5}, "s.gears: takes a whole number, not 2.5"),
        ({"on": 1}, "s.on: takes true or false, not 1"),
        ({"on": "1 + 1"}, "s.on: takes true or false, not 2"),
        ({"label": 3}, "s.label: takes text, not 3"),
        ({"row": [1.0, 2.0]}, "s.row: takes 3 values, 2 given"),
        ({"row": [1.0]}, "s.row: takes 3 values, 1 given"),
        ({"row": [1.0, 2.0, True]}, "s.row: takes a number, not True"),
        ({"gain": [1.0]}, "s.gain: takes a single value, not the list [1.0]"),
        ({"y": 1.0}, "s.y: it is computed (causality output) and cannot be set"),
        ({"gain": "j + 1"}, "s.gain: 'j + 1', column 1: unknown name 'j'"),
        ({"gain": "train.speed"}, "s.gain: 'train.speed': a signal such as 'train.speed' has no value before the run"),
    ],
)
def test_wrong_start_values(started, given, problem):
    problems, _, _ = started(index=1, count=2, **given)
    assert len(problems) == 1
    assert problems[0].startswith(problem)


def test_without_a_count_there_is_no_index(started):
    (problem,), _, _ = started(gain="i / 2")
    assert "unknown name 'i'" in problem


def test_a_constant_of_another_maker_cannot_be_set(resolve, foreign, xml):
    system = System()
    v = xml["variable"]("g", "local", start=9.81, variability="constant", initial="exact")
    system.add("a", foreign([v, xml["variable"]("y", "output")]), g=3.0)
    assert said(resolve(system)) == ["a.g: it is a constant of the model and cannot be set"]


def test_a_swap_drops_what_the_new_model_lacks(started):
    problems, values, notes = started(swapped=True, gain=0.5, alpha=1.0, beta=2.0)
    assert (problems, values) == ([], {"gain": 0.5})
    assert notes == ["s: Settings has no alpha, beta; dropped with the swap"]


# -------------------------------------------------------------------- inputs


def test_a_required_input_that_nothing_feeds(resolve, mine):
    system = System(step=0.2)
    system.add("it", mine("Needy"))
    remedy = "is a required input and nothing feeds it: connect it, or give it a start value to hold it constant"
    assert said(resolve(system)) == [f"it.{n} {remedy}" for n in ("needed", "needed_row[1]", "needed_row[2]")]
    system.instances["it"].start.update(needed=1.0, needed_row=2.0)
    assert resolve(system).problems == []


def test_an_input_with_a_broken_connection_is_not_told_twice(resolve, mine, pair):
    system = pair()
    system.step = 0.2
    system.add("it", mine("Needy"))
    system.connect("a.qqq", "it.needed")
    system.connect("a.row", "it.needed_row")
    found = said(resolve(system))
    assert len(found) == 2
    assert "has no variable 'qqq'" in found[0]
    assert "3 elements, the input 2" in found[1]


def test_fed_twice(pair, resolve):
    system = pair()
    system.connect("a.metres", "b.row[2]")
    system.connect("a.row", "b.row")
    system.connections[1].origin = "x.toml:9"
    assert said(resolve(system)) == ["x.toml:9: b.row[2] is fed twice: by 'a.metres' and by 'a.row'"]


def test_an_open_input_of_another_maker_s_fmu_keeps_its_start_value(resolve, foreign, xml):
    system = System()
    system.add("a", foreign([xml["variable"]("u", "input", start=3.5), xml["variable"]("y", "output")]))
    wiring = resolve(system)
    assert wiring.problems == []
    assert "a.u is not connected; it keeps 3.5" in wiring.notes


# -------------------------------------------------------------------- feed-through


def test_feed_through_is_read_off_the_interface(pair, resolve, workspace):
    system = pair()
    system.connect("a.metres", "b.metres")
    system.connect("b.y", "b.plain")
    assert [link.direct for link in resolve(system).links] == [False, True]


@pytest.mark.parametrize(("listed", "direct"), [(["u"], True), (["p"], False), ([], False), (None, False)])
def test_feed_through_of_another_maker_s_fmu(workspace, foreign, xml, listed, direct):
    """Without a list none is assumed (ordinary plants have none and list nothing), and `check` says so."""
    v = xml["variable"]
    system = System()
    path = foreign([v("u", "input", start=0.0), v("p", "parameter", start=1.0, variability="fixed", initial="exact"),
                    v("y", "output", dependencies=listed)])  # fmt: skip
    system.add("a", path)
    interface = load_models(system, workspace)["a"].interface
    assert is_direct(interface, interface.variables["y"]) is direct


# -------------------------------------------------------------------- samples, seeds


@pytest.mark.parametrize(
    ("step", "fits"), [(0.2, True), (0.4, True), (0.6000000000000001, True), (0.1, False), (0.3, False)]
)
def test_a_step_off_the_sample_time(resolve, mine, step, fits):
    system = System(step=step)
    system.add("it", mine("Needy"), needed=0.0, needed_row=0.0)
    problem = (
        f"it: the communication step {step:g} s is not a whole multiple of its sample_time 0.2 s: "
        "set step or it.sample_time"
    )
    assert said(resolve(system)) == ([] if fits else [problem])


def test_a_sample_time_that_was_set_counts(resolve, mine):
    system = System(step=0.3)
    system.add("it", mine("Needy"), needed=0.0, needed_row=0.0, sample_time=0.1)
    assert resolve(system).problems == []


def test_a_sample_time_that_divides_nothing(resolve, mine):
    system = System(step=0.3)
    system.add("it", mine("Needy"), needed=0.0, needed_row=0.0, sample_time=1e-320)
    assert "is not a whole multiple of its sample_time 9.99989e-321 s" in said(resolve(system))[0]


@pytest.mark.parametrize("own", ["", "String"])
def test_an_annotation_that_promises_a_sample_time_that_is_none(xml, tmp_path, own):
    variables = [xml["variable"]("y", "output")]
    variables += [xml["variable"]("sample_time", "local", own, start="x")] if own else []
    ours = '<VendorAnnotations><Tool name="railcosim"><component name="A" sampled="true"/></Tool></VendorAnnotations>'
    text = xml["description"](variables).replace("<ModelVariables>", f"{ours}<ModelVariables>")
    (tmp_path / "modelDescription.xml").write_text(text, encoding="utf-8")
    system = System()
    system.add("it", "their.fmu")
    assert wire(system, {"it": read_interface(tmp_path, "their.fmu")}).problems == []


def test_a_changed_step_takes_the_sample_times_that_were_equal_along(resolve, mine):
    system = System(step=0.05, rescaled_from=0.2)
    system.add("same", mine("Needy"), needed=0.0, needed_row=0.0)
    system.add("other", mine("Needy"), needed=0.0, needed_row=0.0, sample_time=0.025)
    wiring = resolve(system)
    assert wiring.problems == []
    assert [wiring.starts[name]["sample_time"] for name in ("same", "other")] == [0.05, 0.025]


def test_a_step_longer_than_advised_is_noted_once(resolve, mine):
    system = System(step=0.2)
    for name in ("one", "two"):
        system.add(name, mine("Needy"), needed=0.0, needed_row=0.0)
    note = "Needy is advised to step at 0.1 s or faster; this run steps at 0.2 s"
    assert resolve(system).notes == [note]
    system.step, system.rescaled_from = 0.1, 0.2
    assert resolve(system).notes == []


def test_every_instance_has_its_own_seed(resolve, mine):
    system = System(seed=1)
    system.add("dice[1]", mine("Dice"))
    system.add("dice[2]", mine("Dice"))
    system.add("fixed", mine("Dice"), seed=5)
    starts = resolve(system).starts
    assert starts["dice[1]"]["seed"] == instance_seed(1, "dice[1]")
    assert starts["dice[1]"]["seed"] != starts["dice[2]"]["seed"]
    assert starts["fixed"]["seed"] == 5


def test_seeds_are_the_same_on_every_machine():
    """The first four bytes of SHA-256 of "1:train[1]", without the lowest bit."""
    assert instance_seed(1, "train[1]") == 0xE67D29DA >> 1
    assert len({instance_seed(s, f"train[{i}]") for s in range(10) for i in range(10)}) == 100
