"""Roots of systems of equations: against SciPy, and the C of the compiled loop to the bit."""

import ctypes
import os
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np
import pytest
from railcosim.orchestrator.master.algebraic.roots import SOLVED, find_root, relative
from scipy import optimize

NATIVE = Path(__file__).parents[4] / "orchestrator" / "master" / "native" / "algebraic"
GCC = shutil.which("gcc")
SHAPES = {
    "cosines": lambda a, b, z: a @ np.cos(z) + b,
    "saturations": lambda a, b, z: a @ np.clip(z, -2.0, 2.0) + b,
    "soft saturations": lambda a, b, z: a @ np.tanh(z) + b,
    "switches": lambda a, b, z: a @ np.arctan(30.0 * z) + b,
    "cubes": lambda a, b, z: a @ z + b - 0.3 * z**3,
    "flow": lambda a, b, z: a @ (z * np.abs(z)) + b,
    "exponentials": lambda a, b, z: a @ np.exp(-z * z / 10.0) + b - z * np.exp(np.clip(np.abs(z), 0.0, 50.0) / 5.0),
}


class Drawn:
    """A loop x = g(x) of two to six unknowns of unlike sizes, gains up to a thousand, and a start that may be poor."""

    def __init__(self, shape, seed):
        rng = np.random.default_rng(seed)
        n = int(rng.integers(2, 7))
        a = rng.normal(size=(n, n)) * rng.choice([0.3, 1.0, 3.0, 10.0, 1e3])
        b, self.size = rng.normal(size=n) * rng.choice([1.0, 10.0, 1e3]), 10.0 ** rng.uniform(-3, 4, size=n)
        self.begin = rng.normal(size=n) * rng.choice([0.0, 1.0, 10.0, 1e3]) * self.size
        self._g = lambda x: self.size * SHAPES[shape](a, b, x / self.size)

    def mismatch(self, x):
        return self._g(x) - x

    def slopes(self, x):
        """By central differences."""
        steps = 1e-6 * np.maximum(np.abs(x), self.size)
        columns = [(self.mismatch(x + s) - self.mismatch(x - s)) / (2.0 * s.max()) for s in np.diag(steps)]
        return np.array(columns).T

    def left(self, x):
        """What is left of the mismatch and of Newton's correction, found by LAPACK."""
        if not np.isfinite(x).all():
            return np.inf
        correction = np.linalg.lstsq(self.slopes(x), self.mismatch(x), rcond=None)[0]
        return max(relative(self.mismatch(x), x), relative(correction, x))

    def solve(self, find=find_root):
        """As `LoopSolver` does: once more from where it leads, where that was nowhere."""
        x = self.begin
        for _ in range(4):
            x, left, _ = find(self.mismatch, self.slopes, x, self.mismatch(x))
            if left <= SOLVED:
                return x
            x = x + self.mismatch(x)
            if not np.isfinite(x).all():
                break
        return None

    def solve_by_minpack(self):
        x = optimize.root(self.mismatch, self.begin, jac=self.slopes, method="hybr", options={"xtol": 1e-14}).x
        return x if self.left(x) <= SOLVED else None


@pytest.mark.parametrize("count", [4, pytest.param(60, marks=pytest.mark.long)])
@np.errstate(all="ignore")
def test_as_robust_as_minpack(count):
    """What is called a root is one, and there are more of them than MINPACK's hybrid method finds."""
    drawn = [Drawn(shape, seed) for shape in SHAPES for seed in range(count)]
    own, others = [one.solve() for one in drawn], [one.solve_by_minpack() for one in drawn]
    assert all(one.left(x) <= 100.0 * SOLVED for one, x in zip(drawn, own, strict=True) if x is not None)
    assert sum(x is not None for x in own) > sum(x is not None for x in others) > 10


@np.errstate(all="ignore")
def test_roots_that_are_known():
    """By hand: x = cos y, y = x^3 / 2 + 1; the cosine's fixed point; an affine system; a stiff gain."""
    two = lambda x: np.array([np.cos(x[1]), x[0] ** 3 / 2.0 + 1.0]) - x  # noqa: E731
    slopes = lambda x: np.array([[-1.0, -np.sin(x[1])], [1.5 * x[0] ** 2, -1.0]])  # noqa: E731
    found, left, _ = find_root(two, slopes, np.zeros(2), two(np.zeros(2)))
    near = optimize.brentq(lambda x: np.cos(x**3 / 2.0 + 1.0) - x, 0.0, 1.0, xtol=1e-15)
    assert (found[0], left) == (pytest.approx(near, abs=1e-12), pytest.approx(0.0, abs=1e-12))
    matrix, right = np.array([[-1.0, 1e8], [1e-8, -3.0]]), np.array([1.0, 2.0])
    found, *_ = find_root(lambda x: matrix @ x - right, lambda x: matrix, np.zeros(2), -right)
    assert found == pytest.approx(np.linalg.solve(matrix, right), rel=1e-12)


@np.errstate(all="ignore")
def test_where_there_is_none():
    """x = x + 1, of which the mismatch is small at a large x; a mismatch, slopes that are no numbers."""
    one = np.ones(1)
    assert find_root(lambda x: one, lambda x: np.zeros((1, 1)), 1e15 * one, one)[1] == np.inf
    assert find_root(lambda x: one, lambda x: np.full((1, 1), np.nan), one, one)[1] == np.inf
    assert find_root(lambda x: one, lambda x: -np.eye(1), one, np.nan * one)[1] == np.inf
    parabola = lambda x: x * x + 1.0  # noqa: E731
    assert find_root(parabola, lambda x: 2.0 * x[:, np.newaxis], 0.3 * one, parabola(0.3 * one))[1] > 0.1


EVALUATE = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, *[ctypes.POINTER(ctypes.c_double)] * 2)


class Equations(ctypes.Structure):
    """As roots.h has it."""

    _fields_ = (
        ("context", ctypes.c_void_p),
        ("count", ctypes.c_size_t),
        ("evaluate", EVALUATE),
        ("derive", EVALUATE),
        ("room", ctypes.c_void_p),
    )


_OPENED = """
#include "{}"
#pragma GCC visibility push(default)
size_t open_room(size_t count) {{ return room_of_root(count); }}
int open_find(const Equations *of, double *here, double *mismatch, double *left, int *is_shown)
{{
    return find_root(of, here, mismatch, left, is_shown);
}}
"""
"""The kernel shows nothing of its own to others."""


@pytest.fixture(scope="session")
def compiled_roots(tmp_path_factory):
    if GCC is None:
        pytest.skip("needs gcc")
    folder = tmp_path_factory.mktemp("roots")
    (folder / "open.c").write_text(_OPENED.format(NATIVE / "roots.c"), encoding="utf-8")
    flags = ["-O2", "-ffp-contract=off", "-shared", "-fPIC"]
    if "COVERAGE_NOTES" in os.environ:  # measure_coverage.py counts what is reached
        notes = tempfile.mkdtemp(dir=os.environ["COVERAGE_NOTES"])
        flags += ["-O0", "--coverage", "-fprofile-update=atomic", "-dumpdir", f"{notes}/"]
    subprocess.run([GCC, *flags, folder / "open.c", "-o", folder / "roots.so", "-lm"], check=True)
    library = ctypes.CDLL(str(folder / "roots.so"))
    library.open_room.restype = ctypes.c_size_t

    def find(evaluate, derive, begin, mismatch):
        n, shown, left = len(begin), ctypes.c_int(), ctypes.c_double()

        def put(function):
            def call(_, values, into):
                found = function(np.ctypeslib.as_array(values, (n,)).copy())
                np.ctypeslib.as_array(into, (found.size,))[:] = found.ravel()
                return 1

            return EVALUATE(call)

        room = np.zeros(library.open_room(ctypes.c_size_t(n)))
        here, off = begin.copy(), mismatch.copy()
        of = Equations(None, n, put(evaluate), put(derive), room.ctypes.data)
        places = ctypes.c_void_p(here.ctypes.data), ctypes.c_void_p(off.ctypes.data)
        assert library.open_find(ctypes.byref(of), *places, ctypes.byref(left), ctypes.byref(shown))
        return here, left.value, bool(shown.value)

    return find


@pytest.mark.parametrize("shape", SHAPES)
@np.errstate(all="ignore")
def test_the_same_bits_in_c(compiled_roots, shape):
    for seed in range(12):
        one = Drawn(shape, seed)
        given = one.mismatch, one.slopes, one.begin, one.mismatch(one.begin)
        (here, *rest), (found, *others) = find_root(*given), compiled_roots(*given)
        assert here.tobytes() == found.tobytes(), seed
        assert rest == others, seed


def _constant(value):
    return lambda x: value


ONE, TWO = np.ones(1), np.ones(2)
EDGES = {
    "slopes that are no numbers": (_constant(ONE), _constant(np.full((1, 1), np.nan)), ONE, ONE),
    "a mismatch that is none": (_constant(ONE), _constant(-np.eye(1)), ONE, np.nan * ONE),
    "nothing to be done": (_constant(0.0 * ONE), _constant(-np.eye(1)), ONE, 0.0 * ONE),
    "no slope": (_constant(ONE), _constant(np.zeros((1, 1))), 1e15 * ONE, ONE),
    "a slope of which the square is none": (
        _constant(1e-20 * ONE),
        _constant(np.full((1, 1), 1e-310)),
        ONE,
        1e-20 * ONE,
    ),
    "a slope in one direction": (_constant(TWO), _constant(np.diag([1.0, 0.0])), TWO, TWO),
    "less than was hoped for": (lambda x: ONE - 1e-6 * (x != 0.0), _constant(-np.eye(1)), 0.0 * ONE, ONE),
}


@pytest.mark.parametrize("edge", EDGES)
@np.errstate(all="ignore")
def test_the_same_bits_in_c_at_the_edges(compiled_roots, edge):
    (here, *rest), (found, *others) = find_root(*EDGES[edge]), compiled_roots(*EDGES[edge])
    assert here.tobytes() == found.tobytes()
    assert rest == others


@np.errstate(all="ignore")
def test_the_same_bits_in_c_of_matrices_that_overflow(compiled_roots):
    rng = np.random.default_rng(1)
    for _ in range(300):
        matrix = rng.choice([0.0, 1.0, -1.0, 1e308, -1e308, 1e-308], size=(4, 4))
        given = _constant(np.ones(4)), _constant(matrix), np.ones(4), rng.choice([0.0, 1.0, -1.0], size=4)
        (here, *rest), (found, *others) = find_root(*given), compiled_roots(*given)
        assert here.tobytes() == found.tobytes()
        assert rest == others
