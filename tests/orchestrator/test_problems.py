"""What is wrong with a user's input, and where: one value that is added to from the inside out, and printed once."""

import pickle

import pytest
from railcosim.orchestrator.errors import ExpressionError, ScenarioError
from railcosim.orchestrator.names import SignalName
from railcosim.orchestrator.problems import Problem, suggestion


@pytest.mark.parametrize(
    ("problem", "text"),
    [
        (Problem("", "wrong"), "wrong"),
        (Problem("x.toml:3", "wrong"), "x.toml:3: wrong"),
        (Problem("", "wrong", "mend it"), "wrong; mend it"),
        (Problem("x.toml:3", "wrong", "mend it"), "x.toml:3: wrong; mend it"),
    ],
)
def test_text(problem, text):
    assert str(problem) == text


def test_places_are_added_from_the_inside_out():
    inner = Problem("", "wrong", "mend it")
    assert inner.at("") == inner
    assert inner.at("train.mass").at("").at("x.toml:3") == Problem("x.toml:3: train.mass", "wrong", "mend it")


def test_names_are_carried_along_and_make_no_difference():
    first, second = SignalName("train[1]", "x"), SignalName("gust", "y")
    problem = Problem("", "wrong", names=(first,)).at("x.toml:3", second)
    assert problem.names == (first, second)
    assert problem == Problem("x.toml:3", "wrong")
    assert len({problem, Problem("x.toml:3", "wrong")}) == 1


@pytest.mark.parametrize(
    ("message", "name", "kind"),
    [
        ("train[2].x is wrong", "train[2].x", "train[i].x is wrong"),
        ("train[2].x[3] is wrong in train[2]", "train[2].x[3]", "train[i].x[i] is wrong in train[i]"),
        ("gust.x[1] is wrong", "gust.x[1]", "gust.x[i] is wrong"),
        ("train[2].x is 5, not a[3]", "train[2].x", "train[i].x is 5, not a[3]"),
        ("order: 'train[2]' is missing", "train[2]", "order: 'train[i]' is missing"),
    ],
)
def test_siblings_make_one_kind_of_mistake(message, name, kind):
    assert Problem("", message, names=(SignalName.parse(name),)).kind == kind


def test_without_names_the_text_is_the_kind():
    assert Problem("x", "train[2].x is wrong", "mend it").kind == "x: train[2].x is wrong; mend it"


def test_suggestion():
    assert suggestion("spede", ["speed", "force"]) == "did you mean 'speed'?"
    assert suggestion("zzz", ["speed"]) == ""


def test_an_error_takes_a_sentence_a_problem_or_many():
    one = Problem("a", "wrong")
    assert ScenarioError("wrong").problems == [Problem("", "wrong")]
    assert ScenarioError(one).problems == [one]
    error = ExpressionError(problem for problem in (one, Problem("", "bad", "mend it")))
    assert str(error) == "a: wrong\nbad; mend it"
    assert [str(problem) for problem in error.at("x.toml:3")] == ["x.toml:3: a: wrong", "x.toml:3: bad; mend it"]


def test_an_error_survives_the_way_to_another_process():
    error = pickle.loads(pickle.dumps(ScenarioError(Problem("a", "wrong", "mend it", (SignalName("train[1]"),)))))
    assert error.problems == [Problem("a", "wrong", "mend it")]
    assert error.problems[0].names == (SignalName("train[1]"),)
