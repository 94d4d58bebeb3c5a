"""Tracing equations into C: the same operations in the same order, and a readable refusal of what cannot be traced."""

import itertools
import math

import casadi as ca
import numpy as np
import pytest
from railcosim.components import Component, ComponentError, Input, Memory, Output, Parameter, Size, State, maths
from railcosim.components.tracing import TracingError
from railcosim.fmus.native.ccode import function, number
from railcosim.fmus.native.symbol import Symbol
from railcosim.fmus.native.trace import layout, trace
from railcosim.fmus.variables import scalar_variables


class Law(Component):
    """A controller as a user would write it; the tests replace its equations."""

    n = Size(2)
    gain = Parameter("1", 2.0)
    mode = Parameter("1", "slow")
    u = Input("1", 1.0)
    w = Input("1", 1.0, shape=(n,))
    x = State("1", 0.0)
    m = Memory("1", 0.0)
    y = Output("1")

    def derivatives(self):
        return {"x": self.u - self.x}

    def outputs(self):
        return {"y": self.gain * self.x}

    def update(self):
        return {"m": self.u}


def law(**methods):
    """A law with some of its methods replaced."""
    return type("Changed", (Law,), {"__doc__": "Changed.", **methods})()


def refusal(component):
    with pytest.raises(ComponentError) as caught:
        trace(component, "Changed")
    return str(caught.value)


# ---------------------------------------------------------------- what is generated


def test_operations_keep_their_order_and_are_not_rearranged():
    """x + 0, 1 * x and (x + u) - u are not the same as x in floating point, or not for certain."""
    code = trace(law(outputs=lambda s: {"y": ((s.x + s.u) - s.u) * 1.0 + 0.0}), "Law").code
    body = code[code.index("Law_outputs") : code.index("Law_derivatives")]
    operations = [
        line.split("= ")[1].split()[1] for line in body.splitlines() if " = a" in line and " a" in line.split("= ")[1]
    ]
    assert operations == ["+", "-", "*", "+"]


def test_constants_keep_their_bits():
    for value in (0.1, 1.0 / 3.0, 5e-324, 1.7976931348623157e308, 2.0**53 + 2.0, -0.0):
        text = number(value)
        assert math.copysign(1.0, float(text)) == math.copysign(1.0, value)
        assert float(text) == value
    assert [number(x) for x in (math.inf, -math.inf, math.nan, 3)] == ["INFINITY", "-INFINITY", "NAN", "3.0"]
    code = trace(law(outputs=lambda s: {"y": maths.minimum(s.x, math.inf) + 0.1}), "Law").code
    assert "INFINITY" in code
    assert "0.1;" in code


def test_functions_that_would_compute_nothing_are_left_out():
    class Source(Component):
        """Of time alone."""

        y = Output("1")

        def outputs(self):
            return {"y": self.time}

    code = trace(Source(), "Source").code
    assert "Source_outputs" in code
    for absent in ("derivatives", "update", "initial(", "keep"):
        assert f"Source_{absent}" not in code
    assert code.count("void Source_") == 2


def test_the_option_that_is_global_in_casadi_is_left_as_it_was():
    for wanted in (True, False):
        ca.GlobalOptions.setSimplificationOnTheFly(wanted)
        try:
            trace(law(), "Law")
            refusal(law(outputs=lambda s: {"y": float(s.u)}))
            assert ca.GlobalOptions.getSimplificationOnTheFly() == wanted
        finally:
            ca.GlobalOptions.setSimplificationOnTheFly(True)


def test_an_operation_without_c_is_an_error_not_a_guess():
    x = ca.SX.sym("x")
    with pytest.raises(NotImplementedError, match="OP_ATAN"):
        function("f", [("values", x)], [ca.atan(x)])


def test_every_operator_of_a_symbol_is_the_one_of_numbers():
    a, b = ca.SX.sym("a"), ca.SX.sym("b")
    for (x, y), operator in itertools.product(
        [(1.5, -2.0), (-0.25, 3.0), (2.0, 2.0)], ["+", "-", "*", "/", "<", "<=", ">", ">=", "==", "!="]
    ):
        for left, right in ((Symbol(a), Symbol(b)), (Symbol(a), y), (x, Symbol(b))):
            result = eval(f"left {operator} right", {"left": left, "right": right}).sx
            assert float(ca.Function("f", [a, b], [result])(x, y)) == float(eval(f"{x} {operator} {y}"))
    assert float(ca.Function("f", [a, b], [(Symbol(a) ** Symbol(b)).sx])(2.0, 3.0)) == 8.0
    assert float(ca.Function("f", [a], [(2.0 ** Symbol(a)).sx])(3.0)) == 8.0
    assert [float(ca.Function("f", [a], [s.sx])(-2.0)) for s in (-Symbol(a), +Symbol(a), abs(Symbol(a)))] == [2, -2, 2]


def test_values_stand_in_the_order_of_their_references():
    component = law()
    places = layout(component)
    names = [v.name for v in scalar_variables(component)]
    assert [names[places.outputs[0]], names[places.states[0]], names[places.memory[0]]] == ["y", "x", "m"]
    assert places.values == places.variables == len(names)
    assert f"values[{names.index('gain')}]" in trace(component, "Law").code


def test_names_of_what_initial_and_update_compute():
    changed = law(initial=lambda s: {"m": s.u}, update=lambda s: {"m": s.u, "x": 0.0})
    traced = trace(changed, "Changed")
    assert traced.initial == ("m",)
    assert traced.reinitialised == ("x",)


# ---------------------------------------------------------------- what is refused


@pytest.mark.parametrize(
    ("equation", "said"),
    [
        (lambda s: 1.0 if s.u > 0.0 else 2.0, "asked for its truth"),
        (lambda s: s.u > 0.0 and s.x > 0.0, "asked for its truth"),
        (lambda s: not s.u > 0.0, "asked for its truth"),
        (lambda s: max(s.u, 0.0), "asked for its truth"),
        (lambda s: math.tanh(s.u), "turned into a plain number"),
        (lambda s: float(s.u), "turned into a plain number"),
        (lambda s: int(s.u), "turned into a plain number"),
        (lambda s: s.w[s.u], "cannot be traced"),
        (lambda s: sum(range(s.u)), "turned into a plain number"),
        (lambda s: {0.0: 1.0}[s.u], "unhashable"),
        (lambda s: round(s.u), "__round__"),
        (lambda s: s.u // 2.0, "maths.floor"),
        (lambda s: 2.0 % s.u, "maths.floor"),
        (lambda s: __import__("numpy").tanh(s.w)[0], "tanh"),
        (lambda s: s.mode == "slow", "a text is read"),
        (lambda s: maths.where(s.mode != "slow", 1.0, 2.0), "a text is read"),
        (lambda s: len(s.mode), "a text is read"),
        (lambda s: {"slow": 1.0}[s.mode], "unhashable"),
        (lambda s: s.mode.startswith("s"), "a text is read"),
        (lambda s: s.mode, "a text is read"),
        (lambda s: f"{s.mode}", "a text is read"),
        (lambda s: s.step, "only inside update"),
        (lambda s: s.missing, "missing"),
        (lambda s: 1.0 / 0.0, "division by zero"),
        (lambda s: s.w, "has shape (2,), declared ()"),
        (lambda s: None, "returns None for 'y', which is declared float"),
        (lambda s: object(), "is neither a number nor an expression"),
    ],
)
def test_a_refusal_names_component_method_and_construct(equation, said):
    message = refusal(law(outputs=lambda s: {"y": equation(s)}))
    assert said in message
    assert message.startswith("Changed.outputs")


def test_a_refusal_shows_the_line_of_the_author_not_of_the_library():
    def helper(x):
        return maths.where(x.u > 0.0, x.u, 0.0) if bool(x.u) else 0.0  # the culprit

    message = refusal(law(derivatives=lambda s: {"x": helper(s)}))
    assert message.startswith("Changed.derivatives cannot be traced at test_trace.py:")
    assert "the culprit" in message
    inside_maths = refusal(law(outputs=lambda s: {"y": maths.where(1.0, s.u, 0.0)}))  # raised inside maths.where
    assert "test_trace.py" in inside_maths
    assert "raised inside" in inside_maths


@pytest.mark.parametrize(
    ("methods", "said"),
    [
        ({"outputs": lambda s: {}}, "outputs returns no value of ['y']"),
        ({"outputs": lambda s: {"y": 1.0, "z": 1.0}}, r"outputs returns ['z']; it may return ['y']"),
        ({"outputs": lambda s: [1.0]}, "must return a dict"),
        ({"derivatives": lambda s: {}}, "derivatives returns no value of ['x']"),
        ({"derivatives": lambda s: {"x": 1.0, "m": 1.0}}, "derivatives returns ['m']"),
        ({"update": lambda s: {}}, "update returns no value of ['m']"),
        ({"update": lambda s: {"m": 1.0, "y": 1.0}}, "update returns ['y']"),
        ({"initial": lambda s: {"u": 1.0}}, "initial returns ['u']"),
    ],
)
def test_methods_return_what_they_declare(methods, said):
    assert said in refusal(law(**methods))


def test_a_computed_text_is_refused():
    class Speaker(Component):
        """Says something."""

        said = Output("1", str)

        def outputs(self):
            return {"said": "hello"}

    assert "computed text" in refusal(Speaker())


def test_a_refusal_is_an_error_of_the_family():
    assert issubclass(TracingError, ComponentError)


def test_the_same_table_is_written_once_however_often_it_is_traced():
    class Looking(Component):
        """Looks up and multiplies."""

        u = Input("1")
        y = Output("1", shape=(3,))

        def outputs(self):
            looked = maths.piecewise_constant(self.u, [0.0, 1.0], [2.0, 3.0])
            return {"y": [*maths.product(np.eye(2), [self.u, 1.0]), looked]}

    first, second = trace(Looking(), "Looking").code, trace(Looking(), "Looking").code
    assert first == second
    assert first.count("static const double") == 3  # starts and constants of the cells, and a matrix
