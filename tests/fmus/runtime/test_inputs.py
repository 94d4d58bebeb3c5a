"""inputs.c: inputs that move within a step by given derivatives, what is seen after it, and what is saved."""

import ctypes
import itertools
import json
import math
from ctypes import c_double, c_int, c_size_t, c_uint
from fractions import Fraction

import numpy as np
import pytest
from scipy.integrate import solve_ivp

OK, ERROR = 0, 3
MAX_ORDER = 3
TIMES = (0.0, 0.7, 0.95, 2.0, 3.5)
COURSE = (0.375, -1.25, 0.5, 2.0)
"""Value and time derivatives of an input at time zero."""

SPRING = """
from railcosim.components import Component, Input, State
class C(Component):
    "A damped oscillator, moved at its foot."
    u = Input("m", 0.0)
    x = State("m", 0.25, output=True)
    v = State("m/s", 0.0, output=True)
    def derivatives(self):
        return {"x": self.v, "v": 9.0 * (self.u - self.x) - 0.8 * self.v}
"""
SAMPLER = """
from railcosim.components import Component, Input, Memory, Output, Parameter, State
class C(Component):
    "Sums its samples, and integrates in between."
    sample_time = Parameter("s", 0.25)
    u = Input("1", 0.0)
    total = Memory("1", 0.0, output=True)
    x = State("1", 0.0, output=True)
    through = Output("1", description="of the input: held")
    def derivatives(self):
        return {"x": self.u}
    def outputs(self):
        return {"through": 2.0 * self.u}
    def update(self):
        return {"total": self.total + self.u}
"""


def derivatives(course, t):
    """Value and derivatives at a time of the polynomial that has these at zero."""
    t = Fraction(t)
    return [
        float(sum(Fraction(c) * t ** (k - n) / math.factorial(k - n) for k, c in enumerate(course) if k >= n))
        for n in range(len(course))
    ]


def integral(course, t):
    """From zero, exactly."""
    return float(sum(Fraction(c) * Fraction(t) ** (k + 1) / math.factorial(k + 1) for k, c in enumerate(course)))


def follow(fmu, name, course, times, given):
    """Steps between the times with the value set at each, and the derivatives too where ``given`` says so."""
    for begin, end in itertools.pairwise(times):
        value, *rates = derivatives(course, begin)
        assert fmu.set(name, value) == OK
        if given:
            assert fmu.set_derivatives(name, *rates) == OK, fmu.said
        assert fmu.step(end - begin) == OK, fmu.said


@pytest.fixture
def sampler(load, write_component):
    path = write_component(SAMPLER, name="sampler.py")
    return lambda: load(path)


# ---------------------------------------------------------------- what the inputs do within a step


@pytest.mark.parametrize("max_step", [0.0, 0.2])
@pytest.mark.parametrize("degree", range(MAX_ORDER + 1))
def test_the_integral_of_a_polynomial_is_exact(integrators, degree, max_step, near):
    """Runge-Kutta of fourth order is Simpson's rule here: exact to the third degree, over steps of any length."""
    course = COURSE[: degree + 1]
    expected = integral(course, TIMES[-1])
    fmu, held = (integrators().initialize(max_step=max_step) for _ in range(2))
    follow(fmu, "u", course, TIMES, given=True)
    follow(held, "u", course, TIMES, given=False)
    assert fmu.get("x") == near(expected)
    sums = sum(derivatives(course, a)[0] * (b - a) for a, b in itertools.pairwise(TIMES))
    assert held.get("x") == near(sums)
    assert (abs(sums - expected) > 0.1) == (degree > 0)


def test_inputs_may_differ_in_order_and_need_not_have_any(integrators, near):
    fmu = integrators().initialize()
    for name, value in (("u", 1.0), ("w[1]", 2.0), ("w[2]", 3.0)):
        fmu.set(name, value)
    references = (c_uint * 3)(*(fmu.references[n] for n in ("w[2]", "u", "w[2]")))
    given = (c_int * 3)(1, 1, 2), (c_double * 3)(4.0, -2.0, 6.0)
    assert fmu.SetRealInputDerivatives(references, c_size_t(3), *given) == OK
    assert fmu.step(2.0) == OK
    assert [fmu.get(name) for name in ("x", "z[1]", "z[2]")] == near([2.0 - 4.0, 4.0, 6.0 + 8.0 + 8.0])
    assert [fmu.get(name) for name in ("u", "w[1]", "w[2]")] == [-3.0, 2.0, 3.0 + 8.0 + 12.0]


def test_the_course_does_not_depend_on_how_late_it_is(integrators, near):
    """The time within the step is counted from its beginning: nothing cancels a year after the start."""
    year, h = 3.2e7, 1.0 / 3.0
    fmu = integrators().initialize(start=year)
    assert fmu.set_derivatives("u", 0.0, 2.0) == OK
    assert fmu.step(h) == OK
    assert fmu.get("x") == near(h**3 / 3.0)
    assert fmu.get("u") == h * h


def test_an_oscillator_follows_the_course_of_its_foot(load, write_component):
    """Against SciPy's solver on the same continuous input: a sine, by its derivatives at each communication point."""
    fmu, held = (load(write_component(SPRING)).initialize(max_step=0.002) for _ in range(2))
    h, count, pulse = 0.25, 40, 1.7

    def course(k):
        a = pulse * h * k
        return math.sin(a), pulse * math.cos(a), -(pulse**2) * math.sin(a), -(pulse**3) * math.cos(a)

    def foot(t, k):
        return sum(c * (t - h * k) ** n / math.factorial(n) for n, c in enumerate(course(k)))

    state = [0.25, 0.0]
    for k in range(count):
        value, *rates = course(k)
        for one in (fmu, held):
            assert one.set("u", value) == OK
        assert fmu.set_derivatives("u", *rates) == OK
        assert fmu.step(h) == held.step(h) == OK
        solved = solve_ivp(
            lambda t, s, k=k: (s[1], 9.0 * (foot(t, k) - s[0]) - 0.8 * s[1]),
            (h * k, h * (k + 1)),
            state,
            rtol=1e-12,
            atol=1e-13,
            method="DOP853",
        )
        state = solved.y[:, -1]
        assert [fmu.get("x"), fmu.get("v")] == pytest.approx(state, abs=1e-9)
    assert abs(held.get("x") - state[0]) > 0.05


# ---------------------------------------------------------------- what is seen after the step


def test_after_a_step_everything_belongs_to_the_value_that_the_input_reached(integrators, near):
    fmu = integrators().initialize(gain=3.0)
    fmu.set("u", 1.0)
    fmu.set("w[1]", 10.0)
    assert fmu.set_derivatives("u", 4.0) == OK
    assert (fmu.get("u"), fmu.get("y"), fmu.get("der(x)")) == (1.0, 12.0, 3.0)  # still at the beginning
    assert fmu.step(0.5) == OK
    assert (fmu.get("u"), fmu.get("y"), fmu.get("der(x)")) == (3.0, 16.0, 9.0)
    assert fmu.get("x") == near(3.0)
    assert fmu.get("late") == 3.0 * fmu.get("x")


def test_derivatives_serve_one_step(integrators, near):
    fmu = integrators().initialize()
    fmu.set("u", 1.0)
    fmu.set_derivatives("u", 4.0, 2.0)
    assert fmu.step(1.0) == OK
    x = fmu.get("x")
    assert (fmu.get("u"), x) == (6.0, near(1.0 + 2.0 + 1.0 / 3.0))
    assert fmu.step(1.0) == OK  # nothing said: held where it is
    assert (fmu.get("u"), fmu.get("x")) == (6.0, near(x + 6.0))
    fmu.set_derivatives("u", 4.0)
    assert fmu.step(1.0) == OK
    assert fmu.get("u") == 10.0
    fmu.set("u", 0.5)  # a value alone: held
    x = fmu.get("x")
    assert fmu.step(1.0) == OK
    assert (fmu.get("u"), fmu.get("x")) == (0.5, near(x + 0.5))


def test_value_and_derivatives_may_be_set_in_either_order_and_the_last_word_counts(integrators, near):
    first, second = (integrators().initialize() for _ in range(2))
    first.set("u", 2.0)
    first.set_derivatives("u", 1.0, 6.0)
    second.set_derivatives("u", 9.0, 9.0, 9.0)
    second.set_derivatives("u", 1.0, 6.0, 0.0)
    second.set("u", 2.0)
    for fmu in (first, second):
        assert fmu.step(1.0) == OK
        assert (fmu.get("u"), fmu.get("x")) == (6.0, near(2.0 + 0.5 + 1.0))


def test_derivatives_that_are_zero_hold_the_input(integrators):
    rows = []
    for given in (False, True):
        fmu = integrators().initialize()
        for k in range(5):
            fmu.set("u", math.sin(k))
            if given:
                fmu.set_derivatives("u", 0.0, 0.0, 0.0)
            assert fmu.step(0.1 + 0.01 * k) == OK
            rows.append(json.dumps(fmu.everything(), default=bytes.decode))
    assert rows[:5] == rows[5:]


def test_derivatives_given_before_the_run_serve_the_first_step(integrators, near):
    for phase in ("instantiated", "initialization"):
        fmu = integrators()
        if phase == "instantiated":
            assert fmu.set_derivatives("u", 2.0) == OK
        fmu.enter()
        if phase == "initialization":
            assert fmu.set_derivatives("u", 2.0) == OK
        assert fmu.set("u", 1.0) == OK
        assert fmu.get("y") == 2.0
        assert fmu.ExitInitializationMode() == OK
        assert fmu.step(1.0) == OK
        assert fmu.get("x") == near(2.0)


def test_a_step_that_is_refused_leaves_the_derivatives_to_the_next(integrators, near):
    fmu = integrators().initialize()
    fmu.set_derivatives("u", 2.0)
    assert fmu.step(-1.0) == fmu.step(1.0, at=5.0) == ERROR
    assert fmu.step(1.0) == OK
    assert fmu.get("x") == near(1.0)


# ---------------------------------------------------------------- sampled components


def test_a_sampled_component_samples_the_course(sampler, near):
    """Four samples in a step of 1 s; a feed-through output is that of the last one, the rest is of the step's end."""
    fmu = sampler().initialize()
    fmu.set("u", 1.0)
    assert fmu.set_derivatives("u", 2.0, 4.0) == OK

    def u(t):
        return 1.0 + 2.0 * t + 2.0 * t * t

    assert fmu.step(1.0) == OK
    assert fmu.get("total") == sum(u(0.25 * k) for k in range(4))
    assert fmu.get("through") == 2.0 * u(0.75)
    assert fmu.get("u") == u(1.0)
    assert fmu.get("x") == near(1.0 + 1.0 + 2.0 / 3.0)
    fmu.set("u", 7.0)
    assert fmu.step(1.0) == OK
    assert fmu.get("total") == sum(u(0.25 * k) for k in range(4)) + 4 * 7.0


def test_a_component_sampled_once_a_step_samples_the_beginning(sampler, near):
    fmu = sampler().initialize(sample_time=0.0)
    fmu.set("u", 1.0)
    fmu.set_derivatives("u", 2.0)
    assert fmu.step(3.0) == OK
    assert (fmu.get("total"), fmu.get("through"), fmu.get("x"), fmu.get("u")) == (1.0, 2.0, near(3.0 + 9.0), 7.0)


@pytest.mark.parametrize("samples", [1, 2, 4, 8])
@pytest.mark.parametrize("given", [True, False])
def test_a_tape_takes_the_time_along_the_trip_as_it_is_given(load, sample, tmp_path, samples, given):
    """Whether it is given to move or runs on by itself: the rows are those of the samples. With derivatives a step may
    even contain the departure."""
    h, error = 0.125, 3.0
    fmu = load(sample("Learner")).initialize(sample_time=h, tape_duration=2.0, tape_file=str(tmp_path / "tape"))
    wait = 1 if given else samples
    for k in range(16 // samples):
        at = h * (samples * k - wait)
        fmu.set("trip_time", at)
        fmu.set("error", error)
        if given:
            assert fmu.set_derivatives("trip_time", 1.0) == OK
        assert fmu.step(h * samples) == OK, fmu.said
    assert fmu.Terminate() == OK
    rows = np.loadtxt(tmp_path / "tape", skiprows=1, comments="end")
    assert rows[:, 0].tolist() == [0.5 * error] * (16 - wait) + [0.0] * (1 + wait)


# ---------------------------------------------------------------- saved states


def test_a_saved_state_holds_the_derivatives(integrators, near):
    fmu, other = integrators().initialize(), integrators().initialize()
    fmu.set("u", 1.0)
    plain = fmu.save()
    fmu.set_derivatives("u", 2.0, 4.0)
    state = fmu.save()
    content = fmu.to_bytes(state)
    expected = 1.0 + 1.0 + 2.0 / 3.0
    assert content != fmu.to_bytes(plain)
    for _ in range(2):
        assert fmu.step(1.0) == OK
        assert fmu.get("x") == near(expected)
        assert fmu.SetFMUstate(state) == OK
        fmu.time = 0.0
    copy = other.from_bytes(content)
    assert other.SetFMUstate(copy) == OK
    assert other.step(1.0) == OK
    assert other.get("x") == near(expected)
    assert fmu.SetFMUstate(plain) == OK
    assert fmu.step(1.0) == OK
    assert fmu.get("x") == near(1.0)
    for one in (plain, state, copy):
        fmu.FreeFMUstate(ctypes.byref(one))


def test_a_step_is_repeated_with_other_derivatives(integrators, near):
    """What an iterating master does."""
    fmu = integrators().initialize()
    follow(fmu, "u", COURSE, TIMES[:3], given=True)
    state, time, x = fmu.save(), fmu.time, fmu.get("x")
    for rate in (5.0, -1.0, 0.25):
        assert fmu.SetFMUstate(state) == OK
        fmu.time = time
        fmu.set("u", 2.0)
        fmu.set_derivatives("u", rate)
        assert fmu.step(1.0) == OK
        assert fmu.get("x") == near(x + 2.0 + rate / 2.0)
    fmu.FreeFMUstate(ctypes.byref(state))


def test_the_state_after_a_step_does_not_remember_the_derivatives(integrators):
    """Equal states are equal bytes, however they came about: here by a triangle with nothing under it."""
    contents = []
    for given in (True, False):
        fmu = integrators().initialize(max_step=0.0)
        if given:
            fmu.set("u", -1.0)
            fmu.set_derivatives("u", 2.0)
        assert fmu.step(1.0) == OK
        fmu.set("u", 0.5)
        assert fmu.get("x") == 0.0
        state = fmu.save()
        contents.append(fmu.to_bytes(state))
        fmu.FreeFMUstate(ctypes.byref(state))
    assert contents[0] == contents[1]


@pytest.mark.parametrize("after", ["giving them", "a step"])
def test_reset_clears_the_derivatives(integrators, after, near):
    fmu = integrators().initialize()
    fmu.set_derivatives("u", 2.0, 3.0, 4.0)
    if after == "a step":
        assert fmu.step(1.0) == OK
    assert fmu.Reset() == OK
    fmu.initialize(u=1.0)
    assert fmu.step(1.0) == OK
    assert (fmu.get("u"), fmu.get("x")) == (1.0, near(1.0))
