"""The syntax of expressions: what is refused, with every message read, and arbitrary text harmless."""

import contextlib

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from railcosim.orchestrator.errors import ExpressionError
from railcosim.orchestrator.evaluation.expressions import parse
from railcosim.orchestrator.evaluation.syntax import MAX_DEPTH


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "an expression is empty; write a signal or a formula"),
        ("1 +", "invalid syntax; a name with other characters or a reserved word goes into signal"),
        ("plant.lambda", "column 7: invalid syntax"),
        ("(1", "'(' was never closed"),
        ("'text'", 'text is only understood in signal("...")'),
        ("[1, 2]", "a list is only understood as an argument, as in outside = [210, 240]"),
        ("1 & 2", "this operator is not understood; write 'and'"),
        ("1 | 2", "write 'or'"),
        ("2 ^ 3", "a power is '**'"),
        ("5 // 2", "write floor(a / b)"),
        ("5 % 2", "write a - b * floor(a / b)"),
        ("~1", "write 'not'"),
        ("1 is 1", "there are + - * / ** < <= > >= == != and or not"),
        ("1j", "write numbers, signals"),
        ("lambda: 1", "write numbers, signals"),
        ("{1: 2}", "write numbers, signals"),
        ("[x for x in y]", "write numbers, signals"),
        ("(x := 1)", "write numbers, signals"),
        ("f'{1}'", "write numbers, signals"),
        ("None", "write numbers, signals"),
        ("__import__('os').system('x')", "a function is called by its plain name"),
        ("().__class__", "a signal is written like train[i].speed"),
        ("abs(*train)", "* and ** arguments are not understood"),
        ("abs(**train)", "* and ** arguments are not understood"),
        ("signal(plant.x)", "signal takes one name in quotes, exactly as recorded"),
        ("train[1.5].speed", "an index is a whole number, i, count or a sum of these"),
        ("train[k].speed", "an index is a whole number, i, count or a sum of these"),
        ("train[sin(1)].speed", "an index is a whole number, i, count or a sum of these"),
        ("train[i / 2].speed", "an index is a whole number, i, count or a sum of these"),
        ("train[::2].speed", "a slice has no step; write train[2:] or train[1:3], both ends included"),
        ("train[1][2].speed", "a signal is written like train[i].speed"),
        ("maximum(1, 2, b = 3, b = 4)", "an argument stands twice; keep one"),
        ("0 < (0 < 1 < 2) < 3", "a chain of comparisons stands inside another; part them with 'and'"),
        ("x" * 1001, "longer than 1000 characters; split the expression"),
        ("-" * 900 + "1", "nested"),
        ("+1" * (MAX_DEPTH + 5), f"nested more than {MAX_DEPTH} levels deep; split the expression"),
        ("(" * 300 + "1" + ")" * 300, "too many nested parentheses"),
        ("1" * 900, "write plain names and numbers"),
        ("a\0b", "null bytes"),
        ("\ud800", "write plain names and numbers"),
    ],
)
def test_refused_with_the_place_and_the_remedy(text, message):
    with pytest.raises(ExpressionError) as caught:
        parse(text)
    assert message in str(caught.value)


@settings(max_examples=400, deadline=None)
@given(st.text(max_size=60))
def test_any_text_parses_or_is_refused(text):
    with contextlib.suppress(ExpressionError):
        parse(text)
