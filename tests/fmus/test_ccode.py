"""CasADi functions as C: every operation, compiled, gives what Python's own mathematics gives."""

import ctypes
import math
import struct
import subprocess

import numpy as np
import pytest

ca = pytest.importorskip("casadi")
ccode = pytest.importorskip("railcosim.fmus.native.ccode")
HEAD = "#include <math.h>\n#include <stdbool.h>\n#define ALWAYS_INLINE static inline\n"
PAIRS = [(0.7, 1.9), (-1.3, 2.0), (2.0, 2.0), (0.0, -0.5), (1e-300, 1e300), (-0.0, 0.0)]


@pytest.fixture
def compiled(tmp_path):
    """The C function of some expressions in x and y, as a function of Python's."""

    def build(results, symbols):
        text = HEAD + "\n".join(ccode.function("x_f", [("u", ca.vertcat(*symbols))], results))
        text += "void call(const double *u, double *result) { x_f(u, result); }\n"
        (tmp_path / "f.c").write_text(text)
        command = ["gcc", "-std=c11", "-Wall", "-Wextra", "-Werror", "-O1", "-ffp-contract=off", "-shared", "-fPIC"]
        subprocess.run([*command, tmp_path / "f.c", "-o", tmp_path / "f.so", "-lm"], check=True)
        library = ctypes.CDLL(str(tmp_path / "f.so"))

        def call(*values):
            found = (ctypes.c_double * len(results))()
            library.call((ctypes.c_double * len(values))(*values), found)
            return list(found)

        return call

    return build


def same(a, b):
    """To the bit; any NaN is as good as another."""
    return struct.pack("d", a) == struct.pack("d", b) or (math.isnan(a) and math.isnan(b))


ARITHMETIC = {
    "sum": (lambda x, y: x + y, lambda x, y: x + y),
    "difference": (lambda x, y: x - y, lambda x, y: x - y),
    "product": (lambda x, y: x * y, lambda x, y: x * y),
    "negative": (lambda x, y: -x, lambda x, y: -x),
    "square": (lambda x, y: x * x, lambda x, y: x * x),
    "twice": (lambda x, y: x + x, lambda x, y: 2.0 * x),
    "absolute": (lambda x, y: ca.fabs(x), lambda x, y: abs(x)),
    "floor": (lambda x, y: ca.floor(x), lambda x, y: float(np.floor(x))),
    "sine": (lambda x, y: ca.sin(x), lambda x, y: math.sin(x)),
    "cosine": (lambda x, y: ca.cos(x), lambda x, y: math.cos(x)),
    "tangent": (lambda x, y: ca.tan(x), lambda x, y: math.tan(x)),
    "hyperbolic": (lambda x, y: ca.tanh(x), lambda x, y: math.tanh(x)),
    "exponential": (lambda x, y: ca.exp(-ca.fabs(x)), lambda x, y: math.exp(-abs(x))),
    "logarithm": (lambda x, y: ca.log(1.0 + ca.fabs(x)), lambda x, y: math.log(1.0 + abs(x))),
    "root": (lambda x, y: ca.sqrt(ca.fabs(x)), lambda x, y: math.sqrt(abs(x))),
    "power": (lambda x, y: ca.power(2.0, x), lambda x, y: math.pow(2.0, x)),
    "cube": (lambda x, y: ca.power(x, 3.5 - 0.5), lambda x, y: math.pow(x, 3.0)),
    "less": (lambda x, y: x < y, lambda x, y: float(x < y)),
    "at most": (lambda x, y: x <= y, lambda x, y: float(x <= y)),
    "equal": (lambda x, y: x == y, lambda x, y: float(x == y)),
    "not equal": (lambda x, y: x != y, lambda x, y: float(x != y)),
    "not": (lambda x, y: ca.logic_not(x), lambda x, y: float(not x)),
    "and": (ca.logic_and, lambda x, y: float(bool(x) and bool(y))),
    "or": (ca.logic_or, lambda x, y: float(bool(x) or bool(y))),
    "sign": (lambda x, y: ca.sign(x), lambda x, y: math.copysign(1.0, x) if x else 0.0),
    "choice": (lambda x, y: ca.if_else(x < y, x, y), min),
}


@pytest.mark.parametrize("name", ARITHMETIC)
def test_an_operation_gives_what_python_gives(compiled, name):
    symbolic, plain = ARITHMETIC[name]
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    call = compiled([symbolic(x, y)], [x, y])
    for pair in PAIRS:
        (found,) = call(*pair)
        expected = plain(*pair)
        exact = name not in ("cube", "choice")  # written as products; a sum of two terms, one of them 0
        assert same(found, expected) if exact else found == pytest.approx(expected, rel=1e-15), pair


def test_division_has_no_exceptions(compiled):
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    call = compiled([x / y, 1.0 / y], [x, y])
    assert call(1.0, 3.0) == [1.0 / 3.0, 1.0 / 3.0]
    assert call(-1.0, 0.0) == [-math.inf, math.inf]
    assert math.isnan(call(0.0, 0.0)[0])


def test_results_keep_their_places_and_shared_terms(compiled):
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    shared = ca.sin(x * y)
    call = compiled([y, shared, 2.5, shared + x, 0.0], [x, y])
    assert call(0.3, 4.0) == [4.0, math.sin(0.3 * 4.0), 2.5, math.sin(0.3 * 4.0) + 0.3, 0.0]


def test_what_is_not_chosen_is_not_computed():
    """Work that one choice alone asks for stands inside its branch; what others read too stands before it."""
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    shared, rare = ca.sin(x), ca.exp(y)
    chosen = ca.if_else(x > 0, shared, ca.if_else(y > 0, rare * shared, ca.cos(y)))
    (code,) = ccode.function("f", [("u", ca.vertcat(x, y))], [chosen, shared])
    depth = {name: code.split(f"{name}(")[0].splitlines()[-1].count("    ") for name in ("sin", "exp", "cos")}
    assert depth == {"sin": 1, "exp": 3, "cos": 3}


def test_choices_inside_choices_and_truths_as_numbers(compiled):
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    steps = ca.SX(0.0)
    for k in range(200):  # deeper than compilers need to take blocks
        steps = ca.if_else(x >= k, float(k), steps)
    call = compiled([steps, (x < y) + (x < y) + (y < x), (x < y) / (x <= y)], [x, y])
    assert [call(v, 300.0)[0] for v in (-1.0, 0.0, 57.5, 198.9, 500.0)] == [0.0, 0.0, 57.0, 198.0, 199.0]
    assert call(1.0, 2.0)[1:] == [2.0, 1.0]
    assert math.isnan(call(2.0, 1.0)[2])


def test_arguments_that_nothing_reads_are_no_warnings(compiled):
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    assert compiled([ca.SX(7.0)], [x, y])(1.0, 2.0) == [7.0]


def test_functions_that_are_called_stand_there_once_each(compiled):
    """Nested, with derivatives, with arguments that are conditions, and with results that nobody reads."""
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    kept = {"never_inline": True}
    inner = ca.Function("inner", [x], [ca.vertcat(ca.sin(x), x * x)], kept)
    both = ca.SX.sym("both", 2)
    outer = ca.Function("outer", [both, y], [ca.vertcat(inner(both[0])[0] * y, both[1] + both[0], y)], kept)
    first = outer(ca.vertcat(x, x < y), y)
    second = outer(first[:2], 2.0)
    column = ca.vertcat(second[:2], ca.jtimes(second[:2], x, ca.SX(1.0)))
    seen = compiled([column[k] for k in range(4)], [x, y])(0.3, 0.7)
    a, b = math.sin(0.3) * 0.7, 1.0 + 0.3
    assert seen[:2] == [math.sin(a) * 2.0, b + a]
    slope = math.cos(0.3) * 0.7
    assert seen[2:] == pytest.approx([math.cos(a) * slope * 2.0, 1.0 + slope], abs=1e-15)
    texts = ccode.function("x_f", [("u", ca.vertcat(x, y))], [second[0], second[1]])
    assert [text.count("x_step_") - text.count("static void x_step_") for text in texts] == [0, 1, 2]


@pytest.mark.parametrize("value", [0.1, 1 / 3, -5e-324, 1.7976931348623157e308, -0.0, 12345678901234567.0, 1.0])
def test_a_number_has_the_same_bits_in_c(tmp_path, value):
    (tmp_path / "n.c").write_text(f"double n(void) {{ return {ccode.number(value)}; }}\n")
    subprocess.run(["gcc", "-shared", "-fPIC", tmp_path / "n.c", "-o", tmp_path / "n.so"], check=True)
    function = ctypes.CDLL(str(tmp_path / "n.so")).n
    function.restype = ctypes.c_double
    assert same(function(), value)


def test_numbers_that_are_none_have_their_names():
    assert [ccode.number(v) for v in (math.nan, math.inf, -math.inf)] == ["NAN", "INFINITY", "-INFINITY"]


def test_an_operation_without_c_is_named():
    x = ca.SX.sym("x")
    with pytest.raises(NotImplementedError, match=r"CasADi's operation OP_ERF has no C here"):
        ccode.function("f", [("u", x)], [ca.erf(x)])
