"""Models, files and numbers of a draft; every message read."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from railcosim.orchestrator.errors import ScenarioError
from railcosim.orchestrator.problems import Problem
from railcosim.orchestrator.scenario.groups import (
    Entry,
    Group,
    Member,
    build_argument,
    choice,
    expand_group,
    number,
    positive,
    resolve_model,
    shown,
    truth,
    whole,
    whole_multiple,
)


@pytest.fixture
def folder(tmp_path):
    for name in ("mine.py", "plant.fmu", "Plant.FMU", "line.json"):
        (tmp_path / name).touch()
    return str(tmp_path)


@pytest.mark.parametrize(
    ("text", "kind", "model"),
    [
        ("PointMassTrain", "component", "PointMassTrain"),
        ("mine.py:Mine", "component", "{}/mine.py:Mine"),
        ("x/../mine.py:Mine", "component", "{}/mine.py:Mine"),
        ("plant.fmu", "fmu", "{}/plant.fmu"),
        ("./Plant.FMU", "", "{}/Plant.FMU"),
        ("PointMassTrain", "", "PointMassTrain"),
    ],
)
def test_models(folder, text, kind, model):
    assert resolve_model(text, folder, kind) == model.format(folder)


@pytest.mark.parametrize(
    ("text", "kind", "message"),
    [
        (3, "component", "takes a text: a component's name, 'file.py:Class', or the path of an .fmu"),
        (" ", "", "takes a text: a component's name, 'file.py:Class', or the path of an .fmu"),
        ("plant.fmu", "component", "'plant.fmu' is an FMU file; write fmu = ... instead of component = ..."),
        (
            "PointMassTrain",
            "fmu",
            "'PointMassTrain' does not end in .fmu; for a component of the catalogue write component = ...",
        ),
        ("plan.fmu", "fmu", "there is no file '{}/plan.fmu'; did you mean 'plant.fmu'?"),
        ("min.py:Mine", "component", "there is no file '{}/min.py'; did you mean 'mine.py'?"),
        ("gone/min.py:Mine", "component", "there is no file '{}/gone/min.py'"),
        ("mine.py", "component", "'mine.py' does not name a class; write 'file.py:Class'"),
        ("mine.py:My Class", "", "'mine.py:My Class' does not name a class; write 'file.py:Class'"),
        ("a/b", "", "'a/b' is neither a component's name, nor 'file.py:Class', nor the path of an .fmu"),
    ],
)
def test_models_that_are_none(folder, text, kind, message):
    with pytest.raises(ScenarioError) as caught:
        resolve_model(text, folder, kind)
    assert str(caught.value) == message.format(folder)


def test_build_arguments(folder):
    assert build_argument("line.json", folder) == f"{folder}/line.json"
    assert build_argument("m/s", folder) == "m/s"
    assert build_argument({"a": [1, {"b": True}]}, folder) == {"a": [1, {"b": True}]}
    with pytest.raises(ScenarioError, match=r"there is no file '.*lin\.json'; did you mean 'line.json'\?"):
        build_argument("lin.json", folder)


@given(st.integers(1, 10**6), st.integers(1, 10**4))
def test_a_whole_number_of_steps_is_recognised_in_spite_of_rounding(steps, part):
    step = 1.0 / part
    assert whole_multiple(steps * step, step)
    assert not whole_multiple((steps + 0.4) * step, step)


@pytest.mark.parametrize("value", [0.0, -1.0, 0.05, 1e308 * 10])
def test_no_number_of_steps(value):
    assert not whole_multiple(value, 0.1)


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (True, "true"),
        ("x", "'x'"),
        (math.inf, "inf"),
        (10**400, "a number of more than 50 digits"),
        (["a" * 100], f"['{'a' * 55}..."),
    ],
)
def test_what_is_not_a_number_is_shown_as_written(value, text):
    problems = []
    assert number(Entry(value, "x.toml:3", "a.b"), problems, 7.0) == 7.0
    assert problems == [Problem("x.toml:3: a.b", f"takes a finite number, not {text}")]
    assert shown(value) == text


@pytest.mark.parametrize(
    ("read", "value", "result", "message"),
    [
        (positive, 2, 2.0, None),
        (positive, 0, 1.0, "takes a number greater than 0, in s, not 0"),
        (positive, True, 1.0, "takes a number greater than 0, in s, not true"),
        (truth, False, False, None),
        (truth, 1, False, "takes true or false, not 1"),
        (lambda *of: whole(*of, lambda n: n > 3, "four or more"), 4, 4, None),
        (lambda *of: whole(*of, lambda n: n > 3, "four or more"), 3, 1, "takes four or more, not 3"),
        (lambda *of: whole(*of, lambda n: n > 0, "one or more"), True, 1, "takes one or more, not true"),
        (lambda *of: choice(*of, ("red", "green"), "colour"), "green", "green", None),
        (lambda *of: choice(*of, ("red", "green"), "colour"), "gren", "red", "there is no colour 'gren'; did you mean"),
        (
            lambda *of: choice(*of, ("red", "green"), "colour"),
            [1],
            "red",
            "there is no colour [1]; there are red, green",
        ),
    ],
)
def test_other_values(read, value, result, message):
    problems = []
    assert read(Entry(value, "x.toml:3", "a.b"), problems) == result
    assert len(problems) == (message is not None)
    assert not problems or str(problems[0]).startswith(f"x.toml:3: a.b: {message}")


def swapped(group):
    return [(instance.model, instance.swapped) for instance, _ in expand_group(group, [])]


def test_a_swap_makes_those_swapped_whose_model_it_changes():
    group = Group("a", "x.toml:1", "A", count=3, members={2: Member(model="B")})
    assert swapped(group) == [("A", False), ("B", False), ("A", False)]
    group.swap("B")
    assert swapped(group) == [("B", True), ("B", False), ("B", True)]
    group.swap("A", 2)
    group.swap("A", 2)  # once swapped is swapped
    assert swapped(group) == [("B", True), ("A", True), ("B", True)]
    group.swap("B")
    assert swapped(group) == [("B", True)] * 3


def test_one_may_be_swapped_where_the_others_are_not_and_the_other_way_round():
    group = Group("a", "x.toml:1", "A", count=2, swapped=True, members={2: Member(swapped=False)})
    assert swapped(group) == [("A", True), ("A", False)]
    group.swap("A")
    assert swapped(group) == [("A", True), ("A", False)]


def test_options_of_a_group_are_meant_for_all_that_have_none_of_their_own():
    group = Group("a", "x.toml:1", "A", count=2, options={"step": Entry(1, "x.toml:2"), "isolate": Entry(True, "")})
    group.members[2] = Member(options={"isolate": Entry(False, "x.toml:5"), "memory_limit": Entry(64, "x.toml:6")})
    (one, _), (two, origins) = expand_group(group, [])
    assert (one.step, one.isolate, one.step_timeout, one.memory_limit) == (1.0, True, None, None)
    assert (two.step, two.isolate, two.step_timeout, two.memory_limit) == (1.0, False, None, 64.0)
    assert origins == {
        "instances.a[2].step": "x.toml:2",
        "instances.a[2].isolate": "x.toml:5",
        "instances.a[2].memory_limit": "x.toml:6",
    }
    group.set_option("isolate", Entry("together", "--set"))
    group.set_option("step", Entry(3, "--set"), 1)
    assert [(i.step, i.isolate) for i, _ in expand_group(group, [])] == [(3.0, "together"), (1.0, "together")]


def test_a_group_without_a_count_keeps_lists_whole():
    (instance, origins), *others = expand_group(Group("a", "x.toml:1", "A", start={"x": Entry([1, 2], "x.toml:2")}), [])
    assert not others
    assert (instance.name, instance.index, instance.count, instance.start) == ("a", None, 1, {"x": [1, 2]})
    assert origins == {"a.x": "x.toml:2"}


def test_a_group_of_one_still_has_a_number():
    ((instance, _),) = expand_group(Group("a", "x.toml:1", "A", count=1, start={"x": Entry([[1, 2]], "x.toml:2")}), [])
    assert (instance.name, instance.index, instance.start) == ("a[1]", 1, {"x": [1, 2]})
