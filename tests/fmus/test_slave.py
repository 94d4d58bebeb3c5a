"""A Python FMU refuses what must not be, and tells what failed, where and when."""

import math
import re

import pytest
from railcosim.components import CATALOGUE

# ---------------------------------------------------------------- refusals


@pytest.fixture
def named(instantiate, sample):
    return lambda name: instantiate(name if name in CATALOGUE else sample(name))


@pytest.fixture
def types(instantiate, sample):
    return lambda: instantiate(sample("Types"))


@pytest.mark.parametrize(
    ("component", "phase", "assignment", "complaint"),
    [
        ("PointMassTrain", "enter", {"acceleration": 1.0}, "PointMassTrain.acceleration is computed and cannot be set"),
        (
            "PointMassTrain",
            "initialize",
            {"acceleration": 1.0},
            "PointMassTrain.acceleration is computed and cannot be set",
        ),
        (
            "PointMassTrain",
            "initialize",
            {"mass": 3e5},
            "mass is a fixed parameter; it can only be set before the run begins",
        ),
        (
            "PointMassTrain",
            "initialize",
            {"position_start": 3.0},
            "position is a start value; it can only be set before the run",
        ),
        ("PointMassTrain", "initialize", {"force": math.nan}, "PointMassTrain.force takes a finite number, not nan"),
        ("PointMassTrain", "enter", {"force": math.inf}, "PointMassTrain.force takes a finite number, not inf"),
        ("PointMassTrain", "enter", {"position": 3.0}, "PointMassTrain.position is computed and cannot be set"),
        ("Protection", "initialize", {"by_place": True}, "by_place is a fixed parameter"),
        ("Estimator", "enter", {"estimate": 1.0}, "Estimator.estimate is computed and cannot be set"),
        ("Chain", "enter", {"tension[1]": 1.0}, "Chain.tension is computed and cannot be set"),
        ("Chain", "initialize", {"position_start[2]": 1.0}, "Chain.position is a start value"),
        ("Types", "initialize", {"label": "other"}, "Types.label is a fixed parameter"),
        ("Types", "initialize", {"gain": -1.0}, "Types.gain = -1.0 is outside"),
    ],
)
def test_a_set_that_must_not_be_is_refused(named, component, phase, assignment, complaint):
    instance = named(component)
    getattr(instance, phase)()
    assert complaint in instance.refused("set", assignment)
    assert instance.dead


def test_what_may_be_set_while_running(instantiate, sample):
    instance = instantiate(sample("Types")).initialize()
    instance.set({"gain": 2.0, "offset": 3.0, "teeth": 5, "doors[1]": True, "remark": "x"})
    assert (instance.get("shift"), instance.get("turned"), instance.get("closed[1]")) == (6.0, 10, False)


@pytest.mark.parametrize(
    ("kind", "name", "value", "complaint"),
    [
        ("Integer", "offset", 1, "TypeError: offset is not a int"),
        ("Real", "teeth", 1.0, "TypeError: teeth is not a float"),
        ("Boolean", "teeth", 1, "TypeError: teeth is not a bool"),
        ("String", "teeth", "1", "TypeError: teeth is not a str"),
        ("Real", "doors[2]", 1.0, "TypeError: doors is not a float"),
    ],
)
def test_a_wrong_type_is_refused(types, kind, name, value, complaint):
    instance = types().enter()
    assert complaint in instance.refused("set_as", kind, name, value)
    instance = types().enter()
    message = instance.refused("call", f"get{kind}", [instance.variables[name].valueReference])
    assert complaint in message


def test_an_unknown_value_reference_is_refused(instantiate):
    instance = instantiate("Gust").enter()
    assert "no variable has value reference 99" in instance.refused("call", "getReal", [99])
    instance = instantiate("Gust").enter()
    assert "no variable has value reference 99" in instance.refused("call", "setReal", [99], [1.0])


def test_an_integer_that_fmi_cannot_carry_is_refused(instantiate, sample):
    instance = instantiate(sample("Types")).enter(gear_ratio=9, teeth=2**30)
    assert "turned = 9663676416 does not fit FMI's 32-bit integers" in instance.refused("get", "turned")


def test_calls_out_of_order_and_gaps_in_time_are_refused(instantiate):
    assert "its phase is 'instantiated'" in instantiate("Gust").refused("call", "doStep", 0.0, 0.1)
    instance = instantiate("Gust").initialize()
    instance.step(0.1)
    message = instance.refused("call", "doStep", 0.3, 0.1)
    assert "the communication point 0.3 s does not continue the last one" in message
    for length in (0.0, -0.1):
        assert "must be positive" in instantiate("Gust").initialize().refused("call", "doStep", 0.0, length)


# ---------------------------------------------------------------- what a failure tells

FAILING = '''"""A component of a user's own."""

from railcosim.components import (
    Component,
    Input,
    Output,
    maths,
)
import helper


class C(Component):
    """Fails where u is negative."""

    u = Input("m", 1.0)
    y = Output("m")

    def outputs(self):
        inside = maths.sqrt(self.u)
        return {"y": helper.twice(inside)}
'''
HELPER = """
def twice(x):
    if not hasattr(x, "names") and x > 2.0:
        raise RuntimeError("too much")
    return 2.0 * x
"""


@pytest.mark.parametrize(
    ("value", "cause", "place"),
    [
        (-1.0, "ValueError: math domain error", "my_controller.py:19, in outputs"),
        (16.0, "RuntimeError: too much", "helper.py:4, in twice"),
    ],
)
def test_an_exception_in_an_equation_is_told_with_instance_time_cause_file_and_line(
    write_component, instantiate, value, cause, place
):
    instance = instantiate(write_component(FAILING, helper=HELPER), name="train[2]").initialize()
    instance.step(0.5)
    instance.set({"u": value})
    message = instance.refused("get", "y")
    assert f"train[2] (C) at t = 0.5 s: {cause} [{place}]" in message


def test_an_exception_inside_a_step_names_the_line(write_component, instantiate):
    reference = write_component(
        "from railcosim.components import Component, Input, State, maths\n\n\nclass C(Component):\n"
        "    u = Input('m', 1.0)\n    x = State('m')\n\n    def derivatives(self):\n"
        "        # what follows fails for u < 0\n        return {'x': maths.sqrt(self.u)}\n"
    )
    instance = instantiate(reference).initialize()
    instance.set({"u": -4.0})
    message = instance.refused("call", "doStep", 0.0, 0.1)
    assert "ValueError: math domain error [my_controller.py:10, in derivatives]" in message


@pytest.mark.parametrize("cause", ["KeyboardInterrupt", "SystemExit"])
def test_not_even_an_interrupt_reaches_the_wrapper(write_component, instantiate, cause):
    # Beyond what building an FMU drives the component with for its reference signals.
    helper = HELPER.replace("RuntimeError", cause).replace("2.0:", "50.0:")
    reference = write_component(FAILING, helper=helper)
    instance = instantiate(reference).initialize()
    instance.set({"u": 1e4})
    assert f"{cause}: too much [helper.py:4, in twice]" in instance.refused("get", "y")
    assert instantiate(reference).initialize().get("y") == 2.0


def test_a_shipped_component_names_its_own_line_too(instantiate):
    instance = instantiate("PointMassTrain").initialize()
    instance.set({"force": 1.7e308, "disturbance": 1.7e308})
    message = instance.refused("call", "doStep", 0.0, 1.0)
    assert re.search(r"it \(PointMassTrain\) at t = \S+ s: .* \[\w+\.py:\d+, in \w+\]", message)
