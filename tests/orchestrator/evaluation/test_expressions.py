"""Expressions: values against hand computation, every message read, arbitrary text harmless."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from railcosim.orchestrator.errors import ExpressionError, RailcosimError, ScenarioError
from railcosim.orchestrator.evaluation.expressions import evaluate_constant, parse
from railcosim.orchestrator.evaluation.syntax import Reference
from railcosim.orchestrator.problems import Problem


class Run:
    """Four trains, two consists of three carriages, a target and an FMU with nested names, over five points."""

    step, completed, stop_time = 1.0, True, 4.0
    time = np.arange(5.0)
    units: dict[str, str] = {}  # noqa: RUF012
    parameters = {f"cruise[{i}].gap_min": 15e3 + i for i in range(1, 5)} | {"cruise[1].mode": "comfort"}

    def __init__(self):
        self.columns = {f"train[{i}].position": 100.0 * i + self.time for i in range(1, 5)}
        self.columns |= {f"train[{i}].speed": i * self.time for i in range(1, 5)}
        self.columns |= {f"consist[{i}].force[{k}]": np.full(5, 10.0 * i + k) for i in (1, 2) for k in (1, 2, 3)}
        self.columns |= {"target.value": np.full(5, 3.0), "plant.body.x": self.time**2, "plant.der(x)": 2 * self.time}
        self.columns |= {"plant.a[1,2]": np.full(5, 12.0), "plant.note": np.array(["x"] * 5)}
        self.columns |= {"sensor.value": np.array([0.0, np.nan, 2.0, 3.0, 4.0])}

    def names(self):
        return self.columns.keys()

    @property
    def points(self):
        return len(self.time)

    def part(self, first, last):
        return {name: values[first:last] for name, values in {"time": self.time, **self.columns}.items()}

    def __getitem__(self, name):
        return self.columns[name]


FOREIGN = frozenset(
    [
        *(f"a.x[{k}]" for k in range(3)),
        "a.g[-1]",
        "a.g[2]",
        "a.g[5]",
        "a.m[1, 1]",
        "a.m[1, 2]",
        "a.n[1][2]",
        "a.n[2][2]",
        "a.cell[0].t",
        "a.cell[1].t",
        "b[1].x[0]",
        "b[2].x[0]",
        "a.'my, var'",
    ]
)
RUN = Run()
NAMES = [*RUN.names(), *RUN.parameters]


def value(text, index=None, **constants):
    return parse(text).evaluate(RUN, index, **constants)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("1 + 2 * 3 - 4 / 8", 6.5),
        ("-2 ** 2", -4.0),
        ("2 ** -1", 0.5),
        ("+3", 3.0),
        ("abs(-2) + sqrt(9) + exp(0) + log(1)", 6.0),
        ("sin(0) + cos(0) + tan(0) + tanh(0)", 1.0),
        ("minimum(3, 2) + maximum(3, 2)", 5.0),
        ("clip(5, 0, 2) + clip(x = -1, low = 0, high = 2)", 2.0),
        ("sign(-3) + floor(2.7)", 1.0),
        ("where(2 > 1, 5, 6)", 5.0),
        ("5 if 1 > 2 else 6", 6.0),
        ("pi", np.pi),
        ("inf", np.inf),
        ("(1 < 2) + (2 < 3)", 2.0),  # truth counts as 1, not as NumPy's logical or
        ("9 ** 9 ** 9 ** 9", np.inf),  # never a gigantic integer
        ("True and not false", True),
        ("1 < 2 < 2", False),
        ("1 == 1 and 1 != 2 and 2 >= 2 and 3 > 2 and 2 <= 2", True),
        ("1 > 2 or 2 > 1", True),
    ],
)
def test_numbers(text, expected):
    assert value(text) == expected


@pytest.mark.parametrize(
    ("text", "index", "expected"),
    [
        ("train[2].speed", None, [0, 2, 4, 6, 8]),
        ("train[i].speed", 3, [0, 3, 6, 9, 12]),
        ("train[i-1].position - train[i].position", 2, [-100] * 5),
        ("train[count].speed", None, [0, 4, 8, 12, 16]),
        ("train[count - i + 1].speed", 4, [0, 1, 2, 3, 4]),
        ("target.value * 2", None, [6] * 5),
        ("plant.body.x", None, [0, 1, 4, 9, 16]),
        ('signal("plant.der(x)") / 2', None, [0, 1, 2, 3, 4]),
        ("plant.a[1, 2]", None, [12] * 5),
        ("consist[2].force[3]", None, [23] * 5),
        ("consist[i].force[2]", 1, [12] * 5),
        ("time * 2", None, [0, 2, 4, 6, 8]),
        ("cruise[i].gap_min + 0 * time", 2, [15002] * 5),
        ("train[2].speed > target.value", None, [0, 0, 1, 1, 1]),
        ("10 if train[1].speed > 2 else train[1].speed", None, [0, 1, 2, 10, 10]),
        ("i + count + 0 * train[i].speed", 2, [6] * 5),
    ],
)
def test_signals(text, index, expected):
    np.testing.assert_array_equal(value(text, index), expected)


@pytest.mark.parametrize(
    ("text", "rows"),
    [
        ("train[:].speed", [1, 2, 3, 4]),
        ("train[2:].speed", [2, 3, 4]),
        ("train[:3].speed", [1, 2, 3]),  # 1-based, both ends included
        ("train[2:3].speed", [2, 3]),
        ("train[count-1:].speed", [3, 4]),
        ("consist[1].force[:]", [11, 12, 13]),
        ("consist[:].force[2]", [12, 22]),
        ("consist[:].force[2:]", [12, 13, 22, 23]),
    ],
)
def test_slices_are_stacked_one_row_a_signal(text, rows):
    stacked = value(text)
    assert stacked.shape == (len(rows), 5)
    np.testing.assert_array_equal(stacked[:, 1], rows)


def test_slices_sort_by_number_not_by_text():
    class Ten(Run):
        def __init__(self):
            self.columns = {f"car[{k}].x": np.full(5, k) for k in (10, 2, 1, 9)}

    np.testing.assert_array_equal(parse("car[:].x").evaluate(Ten())[:, 0], [1, 2, 9, 10])


def test_a_slice_goes_with_a_single_signal_and_with_parameters():
    assert value("train[:].speed - target.value").shape == (4, 5)
    assert value("cruise[:].gap_min").shape == (4, 1)
    assert value("train[:].position - cruise[:].gap_min").shape == (4, 5)


def test_nan_survives_comparison_and_logic():
    """NaN < 1 is False in IEEE arithmetic; `not` would turn that into a pass."""
    for text in ("sensor.value < 9", "not sensor.value < 9", "sensor.value < 9 and 1 < 2", "sensor.value > 9 or 1 < 2"):
        assert np.isnan(value(text)[1]), text
        assert not np.isnan(value(text)[[0, 2, 3, 4]]).any()
    assert np.isnan(value("1 if sensor.value < 9 else 2")[1])
    assert np.isnan(value("where(sensor.value > 1, 1, 2)")[1])
    for function in ("minimum(sensor.value, 1)", "maximum(sensor.value, 1)", "clip(sensor.value, 0, 1)"):
        assert np.isnan(value(function)[1])


def test_the_free_index_takes_every_value_for_which_all_references_exist():
    assert parse("train[i].speed").indices(NAMES) == (1, 2, 3, 4)
    assert parse("train[i-1].position - train[i].position").indices(NAMES) == (2, 3, 4)
    assert parse("train[i+1].speed - train[i].speed").indices(NAMES) == (1, 2, 3)
    assert parse("train[i].speed - consist[i].force[1]").indices(NAMES) == (1, 2)
    assert parse("train[i].speed - cruise[i].gap_min").indices(NAMES) == (1, 2, 3, 4)
    assert parse("train[i].speed - target.value").instances(NAMES) == (1, 2, 3, 4)
    assert parse("train[:].speed").indices(NAMES) == ()
    assert parse("train[:].speed").instances(NAMES) == (None,)


def test_an_expression_tells_its_references():
    expression = parse("abs(train[i-1].speed - consist[2].force[:]) <= target.value")
    assert [reference.text for reference in expression.references] == [
        "train[i-1].speed",
        "consist[2].force[:]",
        "target.value",
    ]
    assert [reference.stacked for reference in expression.references] == [False, True, False]
    assert expression.uses_index
    assert not parse("train[1].speed").uses_index
    assert expression.calls("abs")
    assert not expression.calls("max")
    assert isinstance(parse("plant.x").tree, Reference)
    assert parse("train[1].speed") == parse(" train[1].speed ")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "trian[i].speed",
            "column 1: there is no signal or parameter 'trian[i].speed'; did you mean 'train[i].speed'?",
        ),
        (
            "1 + train[i-1].sped",
            "column 5: there is no signal or parameter 'train[i-1].sped'; did you mean 'train[i-1].s",
        ),
        ("train[9].speed", "there is no 'train[9].speed'; there are 'train[1].speed' to 'train[4].speed'"),
        ("train[0:0].speed", "there is no 'train[0:0].speed'; there are 'train[1].speed' to 'train[4].speed'"),
        ("train.speed", "there is no signal or parameter 'train.speed'; did you mean 'train[i].speed'?"),
        ("consist[i].force", "no signal or parameter 'consist[i].force'; did you mean 'consist[i].force[i]'?"),
        ("zzz.qqq", "there is no signal or parameter 'zzz.qqq'; 'describe' lists an instance"),
        ("target + 1", "unknown name 'target'; 'target' is an instance: name a variable, as in 'target.value'"),
        ("tme * 2", "unknown name 'tme'; did you mean 'time'?"),
        ("i * 2", "unknown name 'i'; an index stands in brackets, as in train[i].speed"),
        ("target.value * i", "there is no i for which all of its signals exist; mend the indices"),
        ("consist[i].force[i+2] - train[i-1].speed", "there is no i for which all"),
        ("sqr(4)", "unknown function 'sqr'; did you mean 'sqrt'?"),
        ("qqqq(4)", "unknown function 'qqqq'; there are abs, clip, cos"),
        ("sqrt()", "sqrt(x): missing a required argument: 'x'"),
        ("sqrt(1, 2)", "sqrt(x): too many positional arguments"),
        ("clip(1, 2, higgh = 3)", "clip has no argument 'higgh'; did you mean 'high'?"),
        ("clip(1, 2, low = 3)", "clip(x, low, high): multiple values for argument 'low'"),
        ("train[:].speed - consist[:].force[1]", "its parts differ in their number of rows"),
    ],
)
def test_check_finds_it_before_the_run(text, message):
    problems = parse(text).check(NAMES)
    assert any(message in str(problem) for problem in problems), problems
    assert all(problem.place.startswith(f"'{text}'") for problem in problems)


def test_check_tells_all_problems_at_once():
    problems = parse("max(train[1].sped) + tagret.value + foo").check(NAMES)
    assert len(problems) == 4


def test_check_is_silent_on_what_is_right():
    for text in ("train[i].speed <= 90", "minimum(train[:].speed, 3)", 'signal("plant.der(x)")', "count * time"):
        assert parse(text).check(NAMES) == []
    assert parse("1 / d ** 2").check(NAMES, ["d"]) == []


def test_columns_count_characters():
    assert parse("1 + é + foo").check(["é.x"])[-1].place == "'1 + é + foo', column 9"
    assert parse("é + foo").check(["é.x"])[-1].place == "'é + foo', column 5"


def test_evaluation_errors_say_which_expression():
    with pytest.raises(ExpressionError, match=r"'1 \+ cruise\[1\]\.mode': 'cruise\[1\]\.mode' is a text \('comfort'\)"):
        value("1 + cruise[1].mode")
    with pytest.raises(ExpressionError, match=r"'plant\.note' is a text; expressions work on numbers"):
        value("plant.note")
    with pytest.raises(ExpressionError, match=r"'train\[7\]\.speed': there is no 'train\[7\]\.speed'"):
        value("train[7].speed")
    with pytest.raises(ExpressionError, match="unknown function 'foo'; did you mean 'floor'"):
        value("foo(1)")
    with pytest.raises(ExpressionError, match="'i' is not known here"):
        value("train[i].speed")
    with pytest.raises(ExpressionError, match="differ in their number of rows"):
        value("train[:].speed - consist[1].force[:]")


@pytest.mark.parametrize("text", ["abs([1, [2, 3]])", "abs([1, 2])", "minimum(1, [])", "clip(1, high = [2], low = 0)"])
def test_lists_are_not_calculated_with(text):
    with pytest.raises(ExpressionError, match="takes a signal or a number, not a list"):
        value(text)


def test_a_lone_huge_index_is_not_counted_to():
    names = ["foreign.x[999999999]", "foreign.y[1]", "foreign.y[2]"]
    assert parse("foreign.x[i] + foreign.y[i]").instances(names) == ()
    assert parse("foreign.y[i]").instances(names) == (1, 2)
    assert len(parse("foreign.y[:i]").instances(names)) < 10**5


def test_an_index_of_thousands_of_digits_is_no_index():
    names = [f"foreign.x[{'1' * 5000}]", "foreign.x[2]"]
    assert parse("foreign.x[i]").instances(names) == (2,)
    assert parse("foreign.x[:]").resolve(names) == [["foreign.x[2]"]]
    assert parse("count").evaluate(RUN) == 0
    assert parse("foreign.x[count]").resolve(names) == [["foreign.x[2]"]]
    assert "there are 'foreign.x[2]' to" in parse("foreign.x[3]").check(names)[0].remedy


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("a.x[:]", ["a.x[0]", "a.x[1]", "a.x[2]"]),
        ("a.x[1:]", ["a.x[1]", "a.x[2]"]),
        ("a.x[:1]", ["a.x[0]", "a.x[1]"]),
        ("a.g[:]", ["a.g[-1]", "a.g[2]", "a.g[5]"]),
        ("a.g[-1]", ["a.g[-1]"]),
        ("a.m[1,:]", ["a.m[1, 1]", "a.m[1, 2]"]),
        ("a.m[1,2]", ["a.m[1, 2]"]),
        ("a.n[1][2]", ["a.n[1][2]"]),
        ("a.n[1,2]", ["a.n[1][2]"]),
        ("a.n[:][2]", ["a.n[1][2]", "a.n[2][2]"]),
        ("a.cell[:].t", ["a.cell[0].t", "a.cell[1].t"]),
        ("a.x[count]", ["a.x[2]"]),
        ("signal(\"a.'my, var'\")", ["a.'my, var'"]),
    ],
)
def test_the_arrays_of_other_makers_begin_anywhere(text, found):
    assert parse(text).resolve(FOREIGN) == [found]
    assert not parse(text).check(FOREIGN)


@pytest.mark.parametrize(
    ("text", "indices"),
    [
        ("a.x[i]", (0, 1, 2)),
        ("a.x[i+1] - a.x[i]", (0, 1)),
        ("a.g[i]", (-1, 2, 5)),
        ("a.cell[i].t", (0, 1)),
        ("b[i].x[0]", (1, 2)),
        ("b[i].x[i-1]", (1,)),
        ("b[i+1].x[0]", (1,)),  # instances are numbered from 1
    ],
)
def test_the_free_index_takes_what_is_there(text, indices):
    assert parse(text).instances(FOREIGN) == indices


def test_an_index_that_overflows_warns_nobody(recwarn):
    assert "an index must be a whole number, not inf" in parse("train[1e308 * 10].speed").check(NAMES)[0].message
    assert not recwarn.list


def test_constants():
    assert evaluate_constant("i > 1", i=2, count=4) is True
    assert evaluate_constant("i < count", i=4, count=4) is False
    assert evaluate_constant("1000 * i", i=3) == 3000.0
    assert evaluate_constant("16 if i == 2 else 17", i=2) == 16.0
    assert evaluate_constant("inf") == np.inf


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("train[1].x", "a signal such as 'train[1].x' has no value before the run"),
        ("i > 1", "column 1: unknown name 'i'"),
        ("1 + cuont", "column 5: unknown name 'cuont'; did you mean 'count'?"),
        ("time", "unknown name 'time'"),
        ("foo(1)", "unknown function 'foo'; did you mean 'floor'?"),
        ("0 / 0", "has no value here (0 / 0, or the root of a negative number)"),
        ("sqrt(-1)", "has no value here"),
    ],
)
def test_constants_refused(text, message):
    with pytest.raises(ExpressionError) as caught:
        evaluate_constant(text, **({"count": 4.0} if "cuont" in text else {}))
    assert message in str(caught.value)


def test_errors_are_a_family():
    error = ExpressionError([Problem("", "one"), Problem("", "two")])
    assert isinstance(error, RailcosimError)
    assert isinstance(error, ScenarioError)
    assert isinstance(error, ValueError)
    assert str(error) == "one\ntwo"
    assert ScenarioError("one").problems == [Problem("", "one")]


TOKENS = 'train[ i ] [:] .speed target.value ( ) + - * / ** < == and or not if else , 1 0.5 1e999 abs max signal( "a" '
TOKENS += "[ ] : count time lambda ' # \\ \n \t é 0x10 1_0 .. ... = := @ % // is in None True for await yield"


@settings(max_examples=800, deadline=None)
@given(st.lists(st.sampled_from(TOKENS.split(" ")), max_size=14).map(" ".join))
def test_any_tokens_parse_check_and_evaluate_or_are_refused(text):
    try:
        expression = parse(text)
        expression.check(NAMES)
        for index in (None, 1):
            expression.evaluate(RUN, index)
    except ExpressionError:
        pass


def test_errors_of_a_failed_fmu_say_which_when_and_why():
    from railcosim.orchestrator.errors import FmuError, FmuFileError

    error = FmuError("doStep failed", instance="train[2]", time=12.5, status="error", log=["mass is 0"])
    assert str(error) == "train[2], t = 12.5 s, status error: doStep failed\n    mass is 0"
    assert (error.instance, error.time, error.status, error.log) == ("train[2]", 12.5, "error", ["mass is 0"])
    assert isinstance(error, RuntimeError)
    assert str(FmuError("no library")) == "no library"
    assert issubclass(FmuFileError, ValueError)
