"""What `--vary` takes, and what is said about what it does not."""

import numpy as np
import pytest
from railcosim.orchestrator.errors import ScenarioError
from railcosim.orchestrator.study.design import Dimension, Law


def values(text):
    return list(Dimension.parse(f"a.x={text}").values)


def test_a_grid_holds_the_numbers_that_one_would_write():
    assert values("0.005:0.05:10") == [0.005, 0.01, 0.015, 0.02, 0.025, 0.03, 0.035, 0.04, 0.045, 0.05]
    assert values("1:0:3") == [1.0, 0.5, 0.0]
    assert values("-1e3 : 1_000 : 3") == [-1000.0, 0.0, 1000.0]
    assert values(".5:1.:2") == [0.5, 1.0]


def test_a_grid_of_whole_numbers_is_one_where_all_its_points_are():
    assert [*map(type, values("2:6:5"))] == [int] * 5
    assert [*map(type, values("2:6:4"))] == [float] * 4
    assert [*map(type, values("2:6.0:5"))] == [float] * 5


def test_a_range_is_uniform_and_whole_where_the_key_takes_whole_numbers_alone():
    assert Dimension.parse("a.x=1:5").law == Law("uniform", (1.0, 5.0))
    for key in ("simulation.seed", "train.count", "simulation.max_iterations"):
        assert Dimension.parse(f"{key}=1:5").law == Law("integers", (1.0, 5.0))
    for key in ("simulation.step", "train.count.size", "train.counts"):
        assert Dimension.parse(f"{key}=1:5").law == Law("uniform", (1.0, 5.0))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("1,2,5", [1, 2, 5]),
        ("1, 2.5, .5", [1.0, 2.5, 0.5]),
        ("true,false", [True, False]),
        ("ComfortCruise,TunablePotentialCruise", ["ComfortCruise", "TunablePotentialCruise"]),
        ("my.py:A, C:/x.fmu", ["my.py:A", "C:/x.fmu"]),
        ("[1, 2],[3, 4]", [[1, 2], [3, 4]]),
        ('"a,b", c', ["a,b", "c"]),
        ("'min(i, 2)',i > 1", ["min(i, 2)", "i > 1"]),
        ("max(i, min(1, 2)), i", ["max(i, min(1, 2))", "i"]),
        ("2020-01-01", ["2020-01-01"]),
        ("4e5", [4e5]),
        ('""', [""]),
    ],
)
def test_lists(text, expected):
    found = values(text)
    assert found == expected
    assert [*map(type, found)] == [*map(type, expected)]


def test_a_key_may_hold_the_sign():
    assert Dimension.parse("a.'x = y'=1:2").name == "a.'x = y'"


def test_values_of_toml():
    assert Dimension.read("a.x", [1, 2.5]).values == (1.0, 2.5)
    assert Dimension.read("a.x", "1:3:3").values == (1, 2, 3)
    assert Dimension.read("a.x", ["1:3:3"]).values == ("1:3:3",)
    assert Dimension.read("a.x", True).values == (True,)


def test_all_values_of_a_list_are_as_likely():
    shares = (np.arange(999) + 0.5) / 999
    drawn = Dimension.parse("a.x=p,q,r").at(shares)
    assert [drawn.count(value) for value in "pqr"] == [333] * 3
    assert Dimension.parse("a.x=p,q,r").at(np.array([0.0, 1.0])) == ["p", "r"]


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("1:9:9", "9 values from 1 to 9"),
        ("1,2", "1, 2"),
        ("normal(1,2)", "normal(1, 2)"),
        ("a,b,c,d,e", "a, b, c, d, e"),
    ],
)
def test_how_it_is_shown(text, shown):
    assert str(Dimension.parse(f"a.x={text}")) == shown


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a.x", "--vary a.x: is not of the form name=values, as in --vary cruise.alpha=0.005:0.05:10"),
        ("a.x=", "--vary a.x=: is not of the form name=values"),
        ("=1:2", "--vary =1:2: is not of the form name=values"),
        ("a.x=1:y", "--vary a.x=1:y: 'y' is no number; write low:high:count, low:high, values with commas, or "),
        ("a.x=1:2:3:4", "--vary a.x=1:2:3:4: has 4 numbers; write low:high:count"),
        ("a.x=1:1e999", "--vary a.x=1:1e999: takes finite numbers"),
        ("a.x=2:1", "--vary a.x=2:1: uniform(low, high) needs low < high"),
        ("a.x=1:2:1", "--vary a.x=1:2:1: the count of a grid is a whole number from 2 to 1000000, not 1"),
        ("a.x=1:2:2.5", "--vary a.x=1:2:2.5: the count of a grid is a whole number from 2 to 1000000, not 2.5"),
        ("a.x=2:2:3", "--vary a.x=2:2:3: a grid from a number to itself; give the number alone"),
        ("a.x=1,,2", "--vary a.x=1,,2: a value is empty; is there a comma too many?"),
        ("a.x=1,2,1.0", "--vary a.x=1,2,1.0: 1.0 stands there twice; each value once"),
        (
            "a.x=signal(1, 2, 3, linear)",
            "--vary a.x=signal(1, 2, 3, linear): a signal over time is for falsify and opti",
        ),
        ("a.x=norml(1,2)", "--vary a.x=norml(1,2): there is no distribution 'norml'; did you mean 'normal'?"),
    ],
)
def test_what_is_said_about_a_mistake(text, message):
    with pytest.raises(ScenarioError) as caught:
        Dimension.parse(text)
    assert str(caught.value).startswith(message)


@pytest.mark.parametrize(
    ("what", "message"),
    [
        ([], "takes no empty list"),
        ([1, {}], "takes numbers, texts, true or false, or lists, not {}"),
        ([[1, float("nan")]], "takes numbers, texts, true or false, or lists, not [1, nan]"),
        ([2**63], "takes numbers, texts, true or false, or lists, not 9223372036854775808"),
    ],
)
def test_what_is_said_about_values_of_toml(what, message):
    with pytest.raises(ScenarioError) as caught:
        Dimension.read("a.x", what)
    assert str(caught.value).startswith(message)
