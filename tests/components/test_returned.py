"""What a method returns is held against what its component declares."""

import pytest
from railcosim.components import Component, ComponentError, Memory, Output, State
from railcosim.components.returned import check_returned, due


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
