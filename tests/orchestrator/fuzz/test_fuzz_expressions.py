"""Expressions of strangers: whatever they say, they have a value or are refused, and nothing of theirs is run."""

import contextlib
import time
import tracemalloc
import warnings

import numpy as np
import pytest
from hypothesis import strategies as st
from railcosim.orchestrator.comparison.preference import better
from railcosim.orchestrator.errors import RailcosimError
from railcosim.orchestrator.evaluation import Judge
from railcosim.orchestrator.evaluation.expressions import evaluate_constant, parse
from railcosim.orchestrator.evaluation.metrics import (
    FUNCTIONS,
    unit_of,
)
from railcosim.orchestrator.figures import check_figures, draw
from railcosim.orchestrator.run.recording import Results

SIGNALS = (
    *(f"train[{i}].{name}" for i in (1, 2, 3) for name in ("speed", "position")),
    *(f"consist[{i}].force[{k}]" for i in (1, 2) for k in (1, 2)),
    *("target.value", "plant.der(x)", "plant.on", "plant.a[1,2]", "plant.a[2,1]", "plant.word"),
)
PARAMETERS = {"train[1].mass": 5.0, "train[2].mass": 6, "plant.open": True, "plant.label": "hi", "plant.none": None}
NAMES = [*SIGNALS, *PARAMETERS]


def words(text):
    return st.sampled_from(text.split())


NUMBERS = st.one_of(
    words("0 0 1 1 2 3 -1"),
    st.integers(-5, 1000).map(str) | st.floats().map(repr),
    words("0 1 2.5 1e400 1e-400 -0.0 nan inf true false pi i count time 9**9**9**9 0x10 1_0"),
)
INDICES = words("1 2 i i-1 i+1 : 2: 1:2 :i count count-1 0 -1 99 1,2 :,: i,i 1.0 True 1e400 1e308*10 i*i -i 10**9")
REFERENCES = st.one_of(
    st.sampled_from([*NAMES, 'signal("plant.der(x)")', 'signal("x")', 'signal("train[1].speed")']),
    st.builds("{}[{}].{}".format, st.sampled_from(["train", "consist"]), INDICES, st.sampled_from(["speed", "mass"])),
    st.builds("consist[{}].force[{}]".format, INDICES, INDICES),
    st.builds("plant.a[{}]".format, INDICES),
)
WINDOWS = words("[0,1] [[0,1],[2,3]] [1,0] [] [[]] [0,[1]] [nan,1] [-inf,inf] [i,count] 3")
TIMES = words("0 1 0.5 99 nan -1 inf time")
OPERATORS = words("+ - * / ** < <= > >= == != and or")


@st.composite
def calls(draw, inner):
    """A call with about as many arguments as the function takes, now and then of a wrong kind."""
    name = draw(st.sampled_from(sorted(FUNCTIONS)))
    words = []
    for parameter in FUNCTIONS[name].arguments.parameters.values():
        kind = {"outside": WINDOWS, "after": TIMES, "until": TIMES}.get(parameter.name, inner)
        value = draw(kind if draw(st.integers(0, 6)) else inner | WINDOWS)
        if parameter.kind is parameter.KEYWORD_ONLY or parameter.default is not parameter.empty:
            if draw(st.booleans()):
                words.append(f"{parameter.name} = {value}")
        else:
            words.append(value)
    return f"{name}({', '.join(words)})"


def deeper(inner):
    return st.one_of(
        calls(inner),
        calls(NUMBERS | REFERENCES),
        st.builds("({} {} {})".format, inner, OPERATORS, inner),
        st.builds("({} {})".format, st.sampled_from(["-", "+", "not"]), inner),
        st.builds("({} if {} else {})".format, inner, inner, inner),
        st.builds("({} < {} <= {})".format, inner, inner, inner),
    )


EXPRESSIONS = st.recursive(NUMBERS | REFERENCES, deeper, max_leaves=8)
CLAUSES = st.sampled_from(["", "from 1", "until 2", "outside [0, 1]", "from nan", "until inf", "from 9", "outside []"])
VALUES = st.sampled_from([0.0, -0.0, 1.0, -1.0, np.inf, -np.inf, np.nan, 1e308, -1e308, 5e-324]) | st.floats()
TORN = st.sampled_from(
    [*"()[]{}.,:;'\"\\=<>!+-*/%&|^~@#$?`0e_ij \n\0é²١\u2028\ud800", "**", "//", ":=", "lambda ", "if "]
)


@st.composite
def runs(draw):
    """What a run may leave behind: nothing, a point, some points; NaN and infinities."""
    points = draw(st.sampled_from([0, 1, 2, 3, 7]))
    columns = {name: np.array(draw(st.lists(VALUES, min_size=points, max_size=points)), float) for name in SIGNALS}
    columns["plant.word"] = np.array(["x"] * points, object)
    return Results(
        columns,
        np.arange(points) * 0.5,
        units={"train[1].speed": "m/s"},
        parameters=PARAMETERS,
        step=0.5,
        stop_time=3.0,
        completed=draw(st.booleans()),
    )


@st.composite
def torn(draw):
    """An expression with some of its characters taken out, put in and doubled."""
    text = draw(EXPRESSIONS)
    for _ in range(draw(st.integers(1, 4))):
        at, length = draw(st.integers(0, len(text))), draw(st.integers(0, 3))
        text = text[:at] + draw(TORN) + text[at + length :]
    return text


@contextlib.contextmanager
def refusals():
    """An error of ours that says something is as good as a value."""
    said = "a value"
    try:
        yield
    except RailcosimError as error:
        said = str(error)
    assert said.strip()


def told(problems):
    """Whether each of them says what is wrong and where."""
    return all(problem.place and problem.message for problem in problems)


def use_everywhere(text, run, quantifier, clause):
    """All that a scenario does with an expression, before a run and after it."""
    with refusals():
        expression = parse(text, FUNCTIONS)
        assert all(expression.check(NAMES))
        for index in expression.instances(NAMES)[:5]:
            with refusals():
                expression.evaluate(run, index)
                unit_of(expression, run, index)
    for constants in ({}, {"i": 2, "count": 3}):
        with refusals():
            evaluate_constant(text, **constants)
    judge = Judge({"m": text}, {"r": f"{quantifier} {text} {clause}"}, NAMES, set(PARAMETERS))
    if not judge.metric_problems:
        assert judge.value_names
    better(text)
    for metric in judge.metrics(run):
        assert all(map(metric.text, metric.values))
    with refusals():
        assert told(judge.requirement_problems)
        judge.verdicts(run)
    assert told(check_figures([{"title": "F", "y": [text], "x": text, "bands": [[text]]}], NAMES))


@pytest.fixture
def use(watched, tmp_path):
    """`use_everywhere` while nothing may be run."""
    use_everywhere("max(train[i].speed)", Results({}, np.empty(0), **_EMPTY), "always", "")  # imports what it needs

    def carefully(text, run, quantifier="always", clause=""):
        with watched(tmp_path), warnings.catch_warnings():
            warnings.simplefilter("error")
            use_everywhere(text, run, quantifier, clause)

    return carefully


_EMPTY = {"units": {}, "parameters": {}, "step": 0.5, "stop_time": 3.0, "completed": True}
QUANTIFIERS = st.sampled_from(["always", "eventually", "finally"])


def test_any_expression_has_a_value_or_is_refused(explore, use):
    explore(use, EXPRESSIONS, runs(), QUANTIFIERS, CLAUSES, quick=120, deep=3000)


def test_a_torn_expression_has_a_value_or_is_refused(explore, use):
    explore(use, torn() | st.text(max_size=30), runs(), QUANTIFIERS, CLAUSES, quick=80, deep=1200)


TEXTS = st.one_of(
    st.sampled_from(["", "a", "$x$", r"$\frac$", "$", "{i}", "%s", "\n", "é", "[1]", "x" * 500]), st.text(max_size=5)
)
PLOTTED = EXPRESSIONS | st.sampled_from(
    [*NAMES[:8], "d * d", "1 / d", "train[i].speed - train[i-1].speed", "time", "plant.a[:,:]", "consist[1].force[:]"]
)
ENDS = st.sampled_from([0, 1, -1, 0.5, 10, 1e308, -1e308, 1e-308, 5e-324, 2**63 - 1])
PANELS = st.fixed_dictionaries(
    {"y": PLOTTED | st.lists(PLOTTED, min_size=1, max_size=3)},
    optional={
        "title": TEXTS,
        "x": PLOTTED | st.fixed_dictionaries({"name": st.just("d"), "from": ENDS, "to": ENDS}),
        "label": st.lists(TEXTS, min_size=1, max_size=3),
        "y_label": TEXTS,
        "x_range": st.tuples(ENDS, ENDS).map(sorted),
        "y_range": st.tuples(ENDS, ENDS).map(sorted),
        "bands": st.lists(ENDS | PLOTTED | st.lists(ENDS | PLOTTED, min_size=1, max_size=2), max_size=2),
        "scale": ENDS,
    },
)
FIGURES = st.one_of(
    st.builds(lambda panel, title: {**panel, "title": title}, PANELS, TEXTS),
    st.builds(lambda panels, title: {"panels": panels, "title": title}, st.lists(PANELS, max_size=2), TEXTS),
)


def test_a_figure_that_passed_its_check_is_drawn_or_refused(explore, tmp_path):
    def rule(figure, run):
        problems = check_figures([figure], NAMES)
        assert told(problems)
        if not problems:
            with refusals(), warnings.catch_warnings():
                warnings.simplefilter("ignore")  # matplotlib misses letters in its font
                draw([figure], run, tmp_path)

    explore(rule, FIGURES, runs(), quick=40, deep=400)


BOMBS = {
    "a power tower": "9**9**9**9**9",
    "a long text": "'a' * 10**10",
    "a long shift": "1 << 10**10",
    "brackets": "(" * 100_000 + "1" + ")" * 100_000,
    "fewer brackets": "(" * 190 + "1" + ")" * 190,
    "lists": "[" * 450 + "]" * 450,
    "signs": "-" * 990 + "1",
    "words": "not " * 240 + "1",
    "digits": "1" * 999,
    "hexadecimal digits": "0x" + "f" * 990,
    "an exponent": "1e" + "9" * 900,
    "dots": "x" + ".a" * 490,
    "indices": "x" + "[1]" * 320,
    "indices of indices": "x" + "[x" * 300 + "]" * 300,
    "an index": f"train[{'9*' * 400}9].speed",
    "calls": "max(" * 90 + "1" + ")" * 90,
    "chains in chains": "0<(" * 90 + "1" + ")<1" * 90,
    "a chain": "<".join("1" * 400),
    "colons": f'signal("train{":" * 500}")',
    "blanks": "always" + " " * 50_000 + "1",
    "clauses": "1 " + "from 1 " * 5_000,
}


@pytest.mark.sample(6)
@pytest.mark.unmeasured
@pytest.mark.usefixtures("in_time")
@pytest.mark.parametrize("name", BOMBS)
def test_a_bomb_takes_neither_time_nor_memory(use, name):
    run = Results({name: np.ones(3) for name in SIGNALS}, np.arange(3.0), **_EMPTY)
    tracemalloc.start()
    begin = time.process_time()
    try:
        use(BOMBS[name], run)
        assert time.process_time() - begin < 10.0
        assert tracemalloc.get_traced_memory()[1] < 50 << 20
    finally:
        tracemalloc.stop()


CANARIES = (
    "__import__('os').system('touch {}')",
    "open('{}', 'w')",
    "exec(\"open('{}', 'w')\")",
    "eval(\"open('{}', 'w')\")",
    "[open('{}', 'w') for x in (1,)]",
    "(lambda: open('{}', 'w'))()",
    "(x := open('{}', 'w'))",
    'f\'{{open("{}", "w")}}\'',
    "'{{0.__class__}}'.format(open('{}', 'w'))",
    "'%s' % open('{}', 'w')",
    "max(*[open('{}', 'w')])",
    "max(**dict(x=open('{}', 'w')))",
    "train[open('{}', 'w')].speed",
    "signal(open('{}', 'w'))",
    "().__class__.__base__.__subclasses__()[0]('{}')",
    "max.__globals__['__builtins__']['open']('{}', 'w')",
    "abs.__self__.open('{}', 'w')",
    "getattr(open('{}', 'w'), 'name')",
    "max(open('{}', 'w') if 1 else 0)",
    "1; open('{}', 'w')",
    "1\nopen('{}', 'w')",
    "# -*- coding: rot13 -*-\nbcra('{}')",
)


@pytest.mark.parametrize("text", CANARIES)
def test_nothing_is_executed(use, tmp_path, text):
    run = Results({name: np.ones(3) for name in SIGNALS}, np.arange(3.0), **_EMPTY)
    canary = tmp_path / "canary"
    for harmful in (text.format(canary), f"max({text.format(canary)})", f"train[{text.format(canary)}].speed"):
        use(harmful, run)
        with pytest.raises(RailcosimError):
            parse(harmful, FUNCTIONS).evaluate(run)
    assert not list(tmp_path.iterdir())
