"""exchange3.c: model exchange in FMI 3.0, over the same runtime as in FMI 2.0, and to the bit the same."""

import ctypes
import itertools
import math
import os
import re
import shutil
import subprocess
from ctypes import byref, c_bool, c_double, c_size_t, c_uint32, c_void_p
from pathlib import Path

import fmpy
import pytest
from railcosim.fmus.build import build

from .bare3 import DISCARD, ERROR, NULL, OK, Fmu

HERE = Path(__file__).parent
EXCHANGE = f"{HERE / 'exchange_samples.py'}:"
MIXED = f"{HERE.parent / 'native_samples.py'}:Mixed"


@pytest.fixture
def exchanged(unpack):
    """Makes instances for model exchange, or of the same FMU for co-simulation."""
    made = []

    def make(reference="Choices", exchanges=True):
        reference = reference if ":" in reference else EXCHANGE + reference
        path = build(reference, kind="native", profile="model-exchange", fmi="3")
        made.append(Fmu(unpack(path), exchanges=exchanges))
        return made[-1]

    yield make
    for fmu in made:
        fmu.FreeInstance()


# ---------------------------------------------------------------- as in FMI 2.0

NAMES = {"ContinuousStateDerivatives": "Derivatives", "EventIndicators": "EventIndicators"}
STATES = ("ContinuousStates", "NominalsOfContinuousStates")


def scalars(fmu):
    """All that is read by name, scalar by scalar; but for the time and the indicators, which FMI 2.0 has not."""
    for name in fmu.variables.keys() - {"time", "event.indicators"}:
        found = fmu.get(name)
        element = re.sub(r"x", "x[{}]", name) if name == "der(x)" else f"{name}[{{}}]"
        whole = not fmu.variables[name].dimensions
        yield from [(name, found[0])] if whole else ((element.format(k + 1), x) for k, x in enumerate(found))


def assert_same(three, two):
    assert {**dict(scalars(three))} == two.everything()
    for name in (*NAMES, *STATES):
        assert three.numbers(name) == two.numbers(NAMES.get(name, name)), name


@pytest.mark.parametrize(
    "model", [f"{EXCHANGE}Choices", f"{EXCHANGE}Sampler", MIXED], ids=["Choices", "Sampler", "Mixed"]
)
def test_the_bits_are_those_of_fmi_2(load, exchanged, model):
    both = [load(model, profile="model-exchange", kind=0).initialize(), exchanged(model).initialize()]
    two, three = both
    assert_same(three, two)
    told = [fmu.event() for fmu in both]
    for k in range(12):
        assert told[0] == told[1]
        assert_same(three, two)
        time = 0.25 * (k + 1)
        for fmu in both:
            assert fmu.SetTime(c_double(time - 0.125)) == OK
            states, rates = two.numbers("ContinuousStates"), two.numbers("Derivatives")
        for fmu in both:
            assert fmu.put(*(x + 0.25 * rate for x, rate in zip(states, rates, strict=True))) == OK
        assert_same(three, two)
        told = [fmu.event(time) for fmu in both]


# ---------------------------------------------------------------- what FMI 3.0 has beside it


def number(fmu, what):
    told = c_size_t(77)
    assert getattr(fmu, f"GetNumberOf{what}")(byref(told)) == OK
    return told.value


def test_the_numbers_of_states_and_indicators_are_told_and_described(exchanged):
    fmu = exchanged(MIXED)
    assert number(fmu, "ContinuousStates") == fmu.description.numberOfContinuousStates == 3
    assert number(fmu, "EventIndicators") == fmu.description.numberOfEventIndicators == 0
    assert number(exchanged(), "EventIndicators") == 7


def test_the_event_indicators_are_a_variable_to_be_read(exchanged):
    fmu = exchanged().initialize()
    fmu.event()
    assert fmu.get("event.indicators") == fmu.numbers("EventIndicators")
    assert len(set(fmu.get("event.indicators"))) == 7
    fmu.put(1.5)
    assert fmu.get("event.indicators") == fmu.numbers("EventIndicators")
    for count in (6, 8):
        fmu.get("event.indicators", count=count, status=ERROR)
    assert fmu.set("event.indicators", *[1.0] * 7) == ERROR
    assert "no variable with value reference" in fmu.said


def test_an_event_indicator_without_a_value_is_none(exchanged):
    fmu = exchanged("Inverse").initialize()
    fmu.event()
    assert fmu.set("w", -1.0) == OK
    assert fmu.numbers("EventIndicators") == 2  # discarded
    fmu.get("event.indicators", count=2, status=ERROR)
    assert "event indicator 2 is" in fmu.said


def test_in_co_simulation_they_are_read_as_well(exchanged):
    fmu = exchanged(exchanges=False).initialize()
    for _ in range(2):
        (x,) = fmu.get("x")
        assert fmu.get("event.indicators")[0] == pytest.approx((2.0 - x) / (3.0 + x))
        assert fmu.step() == OK


def test_without_indicators_there_is_no_such_variable(exchanged):
    fmu = exchanged("Nothing").initialize()
    assert fmu.event() == (False, NULL)
    assert fmu.numbers("EventIndicators") == []
    assert "event.indicators" not in fmu.variables
    after = (c_uint32 * 1)(fmu.variables["time"].valueReference + 1), c_size_t(1)
    assert fmu.GetFloat64(*after, (c_double * 1)(), c_size_t(1)) == ERROR


def test_the_time_is_the_one_that_was_set(exchanged):
    fmu = exchanged().initialize()
    assert fmu.get("time") == [0.0]
    assert fmu.SetTime(c_double(0.5)) == OK
    assert fmu.get("time") == [0.5]


def test_a_saved_state_goes_on_in_another_instance(exchanged):
    fmu, other = exchanged("Sampler").initialize(), exchanged("Sampler")
    fmu.event()
    state, copy, size = c_void_p(), c_void_p(), c_size_t()
    assert fmu.GetFMUState(byref(state)) == OK
    assert fmu.SerializedFMUStateSize(state, byref(size)) == OK
    content = (ctypes.c_uint8 * size.value)()
    assert fmu.SerializeFMUState(state, content, size) == OK
    assert other.DeserializeFMUState(content, size, byref(copy)) == OK
    assert other.SetFMUState(copy) == OK
    for each in (fmu, other):
        assert each.put(-0.5) == OK
    assert fmu.event(0.1, u=-1.0) == other.event(0.1, u=-1.0)
    assert dict(scalars(fmu)) == dict(scalars(other))
    assert fmu.FreeFMUState(byref(state)) == other.FreeFMUState(byref(copy)) == OK


# ---------------------------------------------------------------- who may call what

PHASES = ("instantiated", "entered", "event", "integrating", "terminated")
READABLE = PHASES[1:]


def step_told(fmu, *answers):
    return fmu.CompletedIntegratorStep(c_bool(True), *answers)


CALLS = {
    "EnterEventMode": (lambda f: f.EnterEventMode(), ("integrating",)),
    "EnterContinuousTimeMode": (lambda f: f.EnterContinuousTimeMode(), ("event",)),
    "UpdateDiscreteStates": (lambda f: f.update()[0], ("event",)),
    **{f"UpdateDiscreteStates of {k}": (lambda f, k=k: f.update(without={k})[0], ()) for k in range(6)},
    "CompletedIntegratorStep": (lambda f: step_told(f, byref(c_bool()), byref(c_bool())), ("integrating",)),
    "CompletedIntegratorStep of nothing": (lambda f: step_told(f, NULL, NULL), ()),
    "SetTime": (lambda f: f.SetTime(c_double(0.25)), ("event", "integrating")),
    "SetTime of none": (lambda f: f.SetTime(c_double(math.nan)), ()),
    "SetContinuousStates": (lambda f: f.put(0.5), ("integrating",)),
    "SetContinuousStates of too few": (lambda f: f.put(), ()),
    **{
        f"Get{name}": (lambda f, name=name: ERROR if f.numbers(name) == ERROR else OK, READABLE)
        for name in (*NAMES, *STATES)
    },
    "GetContinuousStateDerivatives of too many": (lambda f: f.numbers("ContinuousStateDerivatives", 2), ()),
    **{
        f"GetNumberOf{name}": (lambda f, name=name: getattr(f, f"GetNumberOf{name}")(byref(c_size_t())), PHASES)
        for name in ("EventIndicators", "ContinuousStates")
    },
    "GetNumberOfContinuousStates of nothing": (lambda f: f.GetNumberOfContinuousStates(NULL), ()),
    "DoStep": (
        lambda f: f.DoStep(c_double(0.0), c_double(0.25), c_bool(True), *(byref(c_bool()) for _ in range(3)), NULL),
        (),
    ),
}


def bring(fmu, phase):
    steps = {
        "entered": fmu.enter,
        "event": fmu.ExitInitializationMode,
        "integrating": fmu.event,
        "terminated": fmu.Terminate,
    }
    for name in PHASES[1 : PHASES.index(phase) + 1]:
        steps[name]()
    fmu.messages.clear()
    return fmu


@pytest.mark.parametrize(("call", "phase"), list(itertools.product(CALLS, PHASES)))
def test_a_call_is_answered_where_the_standard_has_it_and_refused_elsewhere(exchanged, call, phase):
    function, allowed = CALLS[call]
    fmu = bring(exchanged(), phase)
    status = function(fmu)
    assert status == (OK if phase in allowed else ERROR)
    assert bool(fmu.messages) == (status == ERROR)
    if status == ERROR:
        assert f"fmi3{call.split()[0]}" in fmu.said


OWN = [name for name in CALLS if " of " not in name and name != "DoStep"]


@pytest.mark.parametrize("call", OWN)
def test_an_instance_for_co_simulation_refuses_them_all(exchanged, call):
    fmu = exchanged(exchanges=False).initialize()
    assert CALLS[call][0](fmu) == ERROR
    assert fmu.said == f"Choices: fmi3{call}: this instance is for co-simulation"
    assert fmu.step() == OK


@pytest.mark.parametrize("call", OWN)
def test_without_an_instance_they_are_errors(exchanged, call):
    fmu = exchanged().initialize()
    instance, fmu.instance = fmu.instance, NULL
    try:
        assert CALLS[call][0](fmu) == ERROR
    finally:
        fmu.instance = instance


def test_no_token_no_instance(exchanged):
    fmu = exchanged()
    assert fmu.create_for_exchange(token=b"{0}") is None
    assert "instantiation token" in fmu.said


def test_no_step_needs_an_event(exchanged):
    fmu, answers = bring(exchanged(), "integrating"), (c_bool(True), c_bool(True))
    assert step_told(fmu, *map(byref, answers)) == OK
    assert [answer.value for answer in answers] == [False, False]


def test_what_has_no_value_is_an_error(exchanged):
    fmu = exchanged(f"{HERE / 'samples.py'}:Breaks").initialize()
    fmu.event()
    assert fmu.set("u", 0.0) == OK
    assert fmu.SetTime(c_double(1.0)) == OK
    assert fmu.EnterEventMode() == OK
    assert fmu.update()[0] == ERROR
    assert "'y' is inf" in fmu.said


def test_what_is_still_missing_says_so_in_words_that_fit(exchanged):
    fmu = exchanged().initialize()
    assert fmu.EvaluateDiscreteStates() == ERROR
    assert "has no evaluation of discrete states apart from their update" in fmu.said
    assert fmu.EnterStepMode() == ERROR
    assert "has no event mode in co-simulation" in fmu.said
    make = fmu.library.fmi3InstantiateScheduledExecution
    make.restype = c_void_p
    assert make(b"it", NULL, NULL, c_bool(False), c_bool(False), c_void_p(7), fmu._logger, NULL, NULL, NULL) is None
    assert "an FMU for co-simulation and model exchange" in fmu.said


def test_a_derivative_without_a_value_is_discarded_as_a_rate_is(exchanged):
    """Of der(x) = -log(x) and der(z) = -sqrt(z): of FMI 2.0 it is an error, which lets nobody discard it."""
    fmu = exchanged("Draining").initialize()
    fmu.event()
    for z, expected in ((-1.0, DISCARD), (0.0, DISCARD), (0.25, [-1.0])):
        assert fmu.put(1.0, z) == OK
        assert fmu.derivative(["der(z)"], ["z"], [1.0], 1) == expected


# ---------------------------------------------------------------- everything at once

SANITIZERS = ("-g", "-O1", "-fsanitize=address,undefined,float-cast-overflow", "-fno-sanitize-recover=all")


@pytest.mark.skipif(shutil.which("gcc") is None, reason="needs gcc")
@pytest.mark.parametrize(
    "model", [f"{EXCHANGE}Choices", *(pytest.param(name, marks=pytest.mark.long) for name in (MIXED, "PointMassTrain"))]
)
def test_it_runs_clean_under_the_sanitizers(tmp_path, unpack, model):
    """AddressSanitizer (leaks included) and UndefinedBehaviorSanitizer, on a driver that calls everything."""
    folder = unpack(build(model, kind="native", profile="model-exchange", fmi="3"))
    headers = ("-DFMI3_OVERRIDE_FUNCTION_PREFIX", "-I", folder / "sources", "-I", Path(fmpy.__file__).parent / "c-code")
    warnings = ("-std=c11", "-Wall", "-Wextra", "-Werror")
    driver = HERE.parent / "c" / "exchange3.c"
    command = ["gcc", *warnings, *SANITIZERS, *headers, driver, "-o", tmp_path / "driver", "-lm"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    environment = {**os.environ, "ASAN_OPTIONS": "detect_leaks=1:strict_string_checks=1"}
    done = subprocess.run([tmp_path / "driver"], env=environment, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr, done.stdout) == (0, "", "clean\n")
