"""Formulas: how far words reach, and what is refused with its place and its remedy."""

import pytest
from railcosim.orchestrator.errors import ExpressionError
from railcosim.orchestrator.evaluation import Judge, parse_requirement
from railcosim.orchestrator.evaluation.formulas import read

NAMES = ["a.x", "a.ok", "b.until", "once[1].x", "p.late"]


def tree(text):
    return repr(read(text)[1]).replace("column=", "").translate({ord(c): None for c in "0123456789"})


@pytest.mark.parametrize(
    ("text", "same"),
    [
        ("always a.ok and b.ok", "always (a.ok and b.ok)"),
        ("a.ok implies always b.ok", "not a.ok or (always b.ok)"),
        ("a.ok implies b.ok implies c.ok", "a.ok implies (b.ok implies c.ok)"),
        ("a.ok and eventually b.ok or c.ok", "a.ok and (eventually (b.ok or c.ok))"),
        ("always (a.x + b.x) > 3 and c.ok", "always ((a.x + b.x) > 3 and c.ok)"),
        ("(a.ok until[0, 5] not b.ok) and c.ok", "((a.ok) until[0, 5] (not b.ok)) and c.ok"),
        ("a.ok since b.ok", "(a.ok) since (b.ok)"),
        ("not (once a.ok)", "not (once (a.ok))"),
        ("always[0, 5]eventually[0, inf](a.ok)", "always[0, 5] eventually[0, inf] a.ok"),
    ],
)
def test_a_word_takes_everything_to_its_right(text, same):
    assert tree(text) == tree(same)


def test_names_and_arguments_are_no_words():
    for text in ('signal("always")', "b.until < 3", "once[1].x < 3", "max(a.x, until = 3) < 3"):
        assert "Temporal" not in tree(text)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a.ok -> b.ok", "column 6: '->' is not understood; write 'implies'"),
        (
            "always (a.ok) and b.ok",
            "column 1: how far 'always' reaches can be read in two ways; write (always (...)) and",
        ),
        ("always[0, 5] (a.ok) implies b.ok", "write (always[0, 5] (...)) implies ..., or always[0, 5] ((...) implies"),
        ("a.ok and b.ok until[0, 5] c.ok", "column 15: what 'until' stands between can be read in two ways; put it in"),
        ("a.ok until[0, 5] b.ok until[0, 5] c.ok", "can be read in two ways; put it in brackets"),
        ("(a.ok until b.ok)", "column 7: 'until' needs its interval; write until[0, inf] (...)"),
        ("always[0, 5, 7] a.ok", "column 1: 'always[0, 5, 7]' has no interval; write its first and its last time in s"),
        ("always[5] a.ok", "'always[5]' has no interval"),
        ("always[[1], 5] a.ok", "has no interval"),
        ("always[0, 5]", "column 13: a condition is missing; write one, as in always[0, 70] (train[1].speed > 20)"),
        ("a.ok implies", "a condition is missing"),
        ("always[0, 5 a.ok", "'[' was never closed"),
        ("always (a.ok implies b.ok + )", "column 22: invalid syntax"),
        ("rise(a.ok, b.ok)", "column 1: rise takes one condition; as in rise(train[1].speed > 20)"),
        ("always " * 120 + "a.ok", "nested more than 100 levels deep"),
        ("always\0", "null bytes"),
    ],
)
def test_refused_with_its_place_and_the_remedy(text, message):
    with pytest.raises(ExpressionError) as caught:
        read(text)
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "always[0, 5] a.ok from 3",
            "'from' stands behind a formula that says itself when; write always (always[0, 5]",
        ),
        (
            "always eventually[0, a.x] a.ok",
            "column 15: a bound of an interval is a number or a parameter, not a signal",
        ),
        ("always eventually[0, p.lat] a.ok", "there is no signal or parameter 'p.lat'; did you mean 'p.late'?"),
        ("always eventually[3, 2] a.ok", "'eventually[3, 2]' is no interval"),
        ("always once a.x + 3", "is a number, not a condition"),
        (
            "always minimum(once a.ok, 3) < 3",
            "'once' stands where a number is wanted; it makes conditions of requirements",
        ),
        ("once a.y > 3", "there is no signal or parameter 'a.y'"),
    ],
)
def test_a_check_finds_it_before_the_run(text, message):
    (problem,) = Judge({}, {"r": text}, NAMES, {"p.late"}).requirement_problems
    assert message in str(problem)


def test_a_metric_is_no_formula():
    (problem,) = Judge({"m": "duration(once a.ok)"}, {}, NAMES, {"p.late"}).metric_problems
    assert "'once' stands where a number is wanted" in str(problem)


@pytest.mark.parametrize("text", ["always eventually[0, p.late] a.ok", "a.ok until[p.late, p.late + 1] rise(a.ok)"])
def test_bounds_may_be_parameters(text):
    judge = Judge({}, {"r": text}, NAMES, {"p.late"})
    assert judge.requirement_problems == []
    assert "p.late" in judge.needed_signals


def test_a_requirement_may_begin_with_a_bracket():
    assert parse_requirement("r", "(always[0, 3] a.ok) and (once a.ok)").quantifier == ""
    assert parse_requirement("r", "always(a.ok)").quantifier == "always"
