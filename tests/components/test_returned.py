"""What a method returns is held against what its component declares; an error points at a line of its author's."""

import numpy as np
import pytest
from railcosim.components import Component, ComponentError, Memory, Output, State, maths
from railcosim.components.returned import check_returned, due, line_of, place_of


class Case(Component):
    """A state, a memory and an output; its rates are forgotten altogether."""

    x = State("m")
    m = Memory("1")
    y = Output("1")

    def outputs(self):
        return {"y": self.x}

    def update(self):
        return {"m": self.m}


def said(method, returned):
    case = Case()
    with pytest.raises(ComponentError) as told:
        check_returned(case, method, returned, due(case)[method])
    return str(told.value)


def test_what_is_due():
    owed = due(Case())
    assert {method: set(one.must) for method, one in owed.items()} == {
        "outputs": {"y"},
        "initial": set(),
        "update": {"m"},
        "derivatives": {"x"},
    }
    assert {*owed["update"].may} == {*owed["initial"].may} == {"m", "x"}


def test_what_is_wrong_is_told_with_the_methods_place():
    place = f"(test_returned.py:{Case.outputs.__code__.co_firstlineno})"
    assert said("outputs", {}) == f"Case.outputs returns no value of ['y'] {place}"
    assert said("outputs", {"y": 0.0, "z": 0.0}) == f"Case.outputs returns ['z']; it may return ['y'] {place}"
    assert said("outputs", 1.0) == f"Case.outputs returns 1.0; it must return a dict {place}"


def test_a_method_that_is_not_there_is_told():
    assert said("derivatives", {}) == "Case has no method 'derivatives', which must return ['x']"


@pytest.mark.parametrize("value", [None, "no"])
def test_a_value_that_is_none_is_told(value):
    text = said("outputs", {"y": value})
    assert f"Case.outputs returns {value!r} for 'y', which is declared float (" in text
    assert "test_returned.py:" in text


# ---------------------------------------------------------------- where it is written


def caught(function):
    try:
        function()
    except Exception as error:
        return error
    raise AssertionError("nothing was raised")


def test_lines_inside_our_own_files_and_numpy_are_passed_over():
    def in_ours():
        return maths.sqrt(-1.0)

    def in_numpy():
        return np.linalg.inv(np.zeros((2, 2)))

    for function in (in_ours, in_numpy):
        line = function.__code__.co_firstlineno + 1
        assert line_of(caught(function)).startswith(f"test_returned.py:{line}, 'return ")


def test_nothing_is_said_where_no_line_is_an_authors(tmp_path):
    assert line_of(ValueError()) == ""
    code = compile("1 / 0", str(tmp_path / "theirs.py"), "exec")
    error = caught(lambda: exec(code))
    assert line_of(error).startswith("theirs.py:1")
    assert line_of(error, tmp_path).startswith("test_returned.py:")


def test_the_place_of_a_method():
    assert place_of(caught) == f"test_returned.py:{caught.__code__.co_firstlineno}"
    assert place_of(None) == place_of(len) == ""
