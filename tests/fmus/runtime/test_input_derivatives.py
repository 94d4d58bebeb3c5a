"""inputs.c: which derivatives are refused, who declares that it takes them, and FMPy that gives them."""

import ctypes
import math
from ctypes import c_double, c_int, c_size_t, c_uint

import fmpy
import numpy as np
import pytest
from lxml import etree
from railcosim.components import PointMassTrain
from railcosim.fmus.build import build
from railcosim.fmus.description import write
from railcosim.fmus.references import resolve

OK, ERROR = 0, 3
NINE = """
from railcosim.components import Component, Input, State
class C(Component):
    "Nine integrators."
    u = Input("1", shape=(9,))
    x = State("1", 0.0, shape=(9,), output=True)
    def derivatives(self):
        return {"x": self.u}
"""
TEXTS_ONLY = """
from railcosim.components import Component, Input, Output
class C(Component):
    "Has inputs, but none that is a real number."
    count = Input("1", 0, type=int)
    y = Output("1")
    def outputs(self):
        return {"y": 2.0 * self.count}
"""


# ---------------------------------------------------------------- what is refused


def give(fmu, references, orders, values):
    count = len(references)
    return fmu.SetRealInputDerivatives(
        (c_uint * count)(*references), c_size_t(count), (c_int * count)(*orders), (c_double * count)(*values)
    )


@pytest.mark.parametrize(
    ("name", "order", "value", "said"),
    [
        ("u", 0, 1.0, "u takes derivatives of the orders 1 to 3, not 0"),
        ("u", -1, 1.0, "not -1"),
        ("u", 4, 1.0, "not 4"),
        ("u", 2**31 - 1, 1.0, "not 2147483647"),
        ("u", 1, math.nan, "u takes a finite derivative, not"),
        ("w[2]", 2, math.inf, "w[2] takes a finite derivative, not inf"),
        ("u", 3, -math.inf, "finite"),
        ("x", 1, 1.0, "x is no input"),
        ("y", 1, 1.0, "y is no input"),
        ("gain", 1, 1.0, "gain is no input"),
        ("slack", 1, 1.0, "slack is no input"),
        ("der(x)", 1, 1.0, "a rate is no input"),
        ("count", 1, 1.0, "count is of another type"),
        ("door", 1, 1.0, "door is of another type"),
        ("label", 1, 1.0, "label is of another type"),
        (999, 1, 1.0, "no variable with value reference 999"),
        (2**32 - 1, 1, 1.0, "no variable with value reference 4294967295"),
    ],
)
def test_what_is_no_derivative_of_an_input_is_refused_and_nothing_is_taken(
    integrators, near, *, name, order, value, said
):
    fmu = integrators().initialize(u=1.0)
    reference = fmu.references.get(name, name)
    assert give(fmu, [fmu.references["u"], reference], [1, order], [5.0, value]) == ERROR
    assert "fmi2SetRealInputDerivatives: " in fmu.said
    assert said in fmu.said
    assert fmu.step(1.0) == OK
    assert (fmu.get("u"), fmu.get("x")) == (1.0, near(1.0))


def test_no_derivatives_need_no_arrays_and_some_do(integrators):
    fmu = integrators().initialize()
    some, orders, values = (c_uint * 1)(fmu.references["u"]), (c_int * 1)(1), (c_double * 1)(1.0)
    assert fmu.SetRealInputDerivatives(None, c_size_t(0), None, None) == OK
    for arrays in ((None, orders, values), (some, None, values), (some, orders, None)):
        assert fmu.SetRealInputDerivatives(arrays[0], c_size_t(1), *arrays[1:]) == ERROR
        assert "fmi2SetRealInputDerivatives: NULL" in fmu.said
    assert fmu.SetRealInputDerivatives(some, c_size_t(1), orders, values) == OK


@pytest.mark.parametrize("phase", ["terminated", "error"])
def test_there_is_no_step_to_come_after_the_end(integrators, phase):
    fmu = integrators().initialize()
    if phase == "terminated":
        assert fmu.Terminate() == OK
    else:
        fmu.set_derivatives("u", 1e308, 1e308)
        assert fmu.step(1e3) == ERROR
    assert fmu.set_derivatives("u", 1.0) == ERROR
    assert "fmi2SetRealInputDerivatives is not allowed while the instance is" in fmu.said


@pytest.mark.parametrize("rates", [(1e308,), (0.0, -1e308), (1e306, -2e303)])
def test_an_input_that_would_leave_all_numbers_is_an_error_that_names_it(integrators, rates):
    fmu = integrators().initialize()
    state = fmu.save()
    assert fmu.set_derivatives("w[2]", *rates) == OK
    assert fmu.step(1e3) == ERROR
    assert "the derivatives given for w[2] take it beyond all numbers" in fmu.said
    assert fmu.SetFMUstate(state) == OK
    assert fmu.step(1e3) == OK
    assert fmu.get("w[2]") == 0.0
    fmu.FreeFMUstate(ctypes.byref(state))


# ---------------------------------------------------------------- what is declared, and another tool


def declared(component, kind):
    return etree.fromstring(write(component, kind, "0" * 64)).find("CoSimulation").get("canInterpolateInputs")


def test_native_fmus_with_real_inputs_declare_it(write_component):
    without = resolve(write_component(TEXTS_ONLY))()
    assert declared(PointMassTrain(), "native") == "true"
    assert declared(PointMassTrain(), "python") is None
    assert declared(without, "native") is None


def test_a_component_without_real_inputs_has_none_to_move(load, write_component):
    fmu = load(write_component(TEXTS_ONLY)).initialize()
    assert fmu.SetRealInputDerivatives(None, c_size_t(0), None, None) == OK
    assert fmu.set_derivatives("count", 1.0) == ERROR
    assert fmu.step() == OK


def test_fmpy_gives_derivatives(write_component):
    """Straight lines between rows far apart: their integral.

    FMPy 0.3.32 can do it for nine inputs, no more and no less, and not at the first row.
    """
    names = [f"u[{k}]" for k in range(1, 10)]
    rows = [(t, *(k * t for k in range(1, 10))) for t in (-4.0, 4.0)]
    signals = np.array(rows, dtype=[("time", float), *((name, float) for name in names)])
    result = fmpy.simulate_fmu(
        str(build(write_component(NINE), kind="native")),
        stop_time=4.0,
        output_interval=1.0,
        input=signals,
        output=[*names, *(f"x[{k}]" for k in range(1, 10))],
        set_input_derivatives=True,
    )
    for k in range(1, 10):
        assert result[f"x[{k}]"] == pytest.approx(k * result["time"] ** 2 / 2.0, rel=1e-14)
        assert result[f"u[{k}]"].tolist() == (k * result["time"]).tolist()  # read after the step
