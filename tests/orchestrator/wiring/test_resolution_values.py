"""A system against the interfaces of its models: start values, sample times and seeds."""

import numpy as np
import pytest
from railcosim.orchestrator.fmi.reader import read_interface
from railcosim.orchestrator.scenario import changed
from railcosim.orchestrator.system import System
from railcosim.orchestrator.wiring import wire
from railcosim.orchestrator.wiring.starts import instance_seed

# -------------------------------------------------------------------- start values


@pytest.fixture
def started(resolve, mine):
    """Start values of one instance of Settings; its problems, and what came out."""

    def run(index=None, count=1, swapped=False, **start):
        system = System()
        instance = system.add("s", mine("Settings"), **start)
        instance.index, instance.count, instance.swapped = index, count, swapped
        wiring = resolve(system)
        return [str(problem) for problem in wiring.problems], wiring.starts["s"], wiring.notes

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
        ({"x": -3.0}, {"x_start": -3.0}),  # a state begins at a parameter, by either name
        ({"x_start": -3.0}, {"x_start": -3.0}),
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
        ({"x": 1.0, "x_start": 1.0}, "s.x: it is given twice, as x and as x_start"),
        ({"y": 1.0}, "s.y: it is computed (causality output) and cannot be set"),
        ({"gain": "j + 1"}, "s.gain: 'j + 1', column 1: unknown name 'j'"),
        ({"gain": "train.speed"}, "s.gain: 'train.speed': a signal such as 'train.speed' has no value before the run"),
    ],
)
def test_wrong_start_values(started, given, problem):
    problems, _, _ = started(index=1, count=2, **given)
    assert len(problems) == 1
    assert problems[0].startswith(problem)


@pytest.mark.parametrize("written", ["x", "x_start"])
@pytest.mark.parametrize("given", ["x", "x_start"])
def test_what_a_user_sets_wins_by_either_name(resolve, mine, written, given):
    system = System()
    system.add("s", mine("Settings"), **{written: 1.0})
    wiring = resolve(changed(system, {f"s.{given}": 2.0}))
    assert (wiring.problems, wiring.starts["s"]) == ([], {"x_start": 2.0})


def test_without_a_count_there_is_no_index(started):
    (problem,), _, _ = started(gain="i / 2")
    assert "unknown name 'i'" in problem


def test_a_constant_of_another_maker_cannot_be_set(resolve, foreign, xml):
    system = System()
    v = xml["variable"]("g", "local", start=9.81, variability="constant", initial="exact")
    system.add("a", foreign([v, xml["variable"]("y", "output")]), g=3.0)
    assert [str(problem) for problem in resolve(system).problems] == [
        "a.g: it is a constant of the model and cannot be set"
    ]


def test_a_swap_drops_what_the_new_model_lacks(started):
    problems, values, notes = started(swapped=True, gain=0.5, alpha=1.0, beta=2.0)
    assert (problems, values) == ([], {"gain": 0.5})
    assert notes == ["s: Settings has no alpha, beta; dropped with the swap"]


# -------------------------------------------------------------------- samples, seeds


@pytest.mark.parametrize(
    ("step", "fits"), [(0.2, True), (0.4, True), (0.6000000000000001, True), (0.1, True), (0.3, False), (0.15, False)]
)
def test_steps_and_samples_that_do_not_meet_are_noted(resolve, mine, step, fits):
    system = System(step=step)
    system.add("it", mine("Needy"), needed=0.0, needed_row=0.0)
    note = (
        f"it: the communication step {step:g} s is not a whole multiple of its sample_time 0.2 s: "
        "it samples by a clock of its own"
    )
    assert resolve(system).problems == []
    assert [n for n in resolve(system).notes if "sample" in n] == ([] if fits else [note])


def test_a_sample_time_that_was_set_counts(resolve, mine):
    system = System(step=0.3)
    system.add("it", mine("Needy"), needed=0.0, needed_row=0.0, sample_time=0.1)
    assert resolve(system).problems == []


def test_a_sample_time_that_divides_nothing(resolve, mine):
    system = System(step=0.3)
    system.add("it", mine("Needy"), needed=0.0, needed_row=0.0, sample_time=1e-320)
    assert "is too great a multiple of its sample_time 1e-320 s; set step" in str(resolve(system).problems[0])


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
    system.stepping.step, system.provenance.rescaled_from = 0.1, 0.2
    assert resolve(system).notes == []


def test_every_instance_has_its_own_seed(resolve, mine):
    system = System(seed=1)
    system.add("dice[1]", mine("Random"))
    system.add("dice[2]", mine("Random"))
    system.add("fixed", mine("Random"), seed=5)
    starts = resolve(system).starts
    assert starts["dice[1]"]["seed"] == instance_seed(1, "dice[1]")
    assert starts["dice[1]"]["seed"] != starts["dice[2]"]["seed"]
    assert starts["fixed"]["seed"] == 5


def test_seeds_are_the_same_on_every_machine():
    """The first four bytes of SHA-256 of "1:train[1]", without the lowest bit."""
    assert instance_seed(1, "train[1]") == 0xE67D29DA >> 1
    assert len({instance_seed(s, f"train[{i}]") for s in range(10) for i in range(10)}) == 100
