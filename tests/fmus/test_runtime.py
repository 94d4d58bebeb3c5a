"""The C runtime of native FMUs through the bare functions of the standard: who may call what, when, and with what.

Longer than a file should be because everything here shares one driver of raw calls, and the interface is what it is.
"""

import ctypes
import itertools
import json
import math
import os
import re
import shutil
import subprocess
import sys
from ctypes import byref, c_char_p, c_double, c_int, c_size_t, c_uint, c_void_p
from pathlib import Path

import fmpy
import numpy as np
import pytest
from railcosim.components import ComfortCruise, PointMassTrain
from railcosim.components.declarations import Parameter
from railcosim.components.tape import TapeDeck, smooth
from railcosim.fmus.build import build
from railcosim.fmus.references import resolve

SAMPLES = Path(__file__).parent / "native_samples.py"
MIXED, FUNCTIONS = f"{SAMPLES}:Mixed", f"{SAMPLES}:Functions"
OTHERS = Path(__file__).parents[1] / "components" / "samples.py"
LEARNER, COUNTER, CHAIN = f"{OTHERS}:Learner", f"{OTHERS}:Counter", f"{OTHERS}:Chain"
OK, WARNING, DISCARD, ERROR = 0, 1, 2, 3
STEP = 0.25
NULL = None
REALS, INTEGERS, BOOLEANS, STRINGS = c_double, c_int, c_int, c_char_p

FRAGILE = """
from railcosim.components import Component, Input, Memory, Output, Parameter, State
class C(Component):
    "Breaks when it is told to."
    u = Input("1", 1.0)
    rate = Parameter("1/s", 1.0, tunable=True)
    x = State("m", 1.0, output=True)
    y = Output("1", description="infinite at u = 0")
    whole = Output("1", int)
    m = Memory("1", 1.0)
    def derivatives(self):
        return {"x": self.rate * self.x * self.x}
    def outputs(self):
        return {"y": self.m / self.u, "whole": 2.0 * self.u}
    def update(self):
        return {"m": self.m}
"""


@pytest.fixture
def fragile(write_component):
    return write_component(FRAGILE)


# ---------------------------------------------------------------- the calling sequence

PHASES = ("instantiated", "initialization", "running", "terminated", "error")


def bring(fmu, phase):
    """An instance of the fragile component in one of the phases."""
    if phase == "instantiated":
        return fmu
    fmu.enter()
    if phase == "initialization":
        return fmu
    assert fmu.ExitInitializationMode() == OK
    if phase == "terminated":
        assert fmu.Terminate() == OK
    elif phase == "error":
        assert fmu.set("u", 0.0) == OK
        assert fmu.step() == ERROR
    return fmu


def one(cell, value=0):
    return (cell * 1)(value)


def reference(fmu, name):
    return one(c_uint, fmu.references[name]), c_size_t(1)


def saved_state_calls(fmu):
    state = c_void_p()
    results = [fmu.GetFMUstate(byref(state)), fmu.SetFMUstate(state)]
    size = c_size_t()
    results.append(fmu.SerializedFMUstateSize(state, byref(size)))
    content, copy = (ctypes.c_char * size.value)(), c_void_p()
    results.append(fmu.SerializeFMUstate(state, content, size))
    results.append(fmu.DeSerializeFMUstate(content, size, byref(copy)))
    results += [fmu.FreeFMUstate(byref(state)), fmu.FreeFMUstate(byref(copy))]
    assert not state.value
    assert not copy.value
    return max(results)


CALLS = {
    # name: (the call, the phases it is allowed in, what it then gives)
    "GetTypesPlatform": (lambda f: f.library.fmi2GetTypesPlatform() and OK, PHASES, None),
    "SetDebugLogging": (lambda f: f.SetDebugLogging(0, c_size_t(0), NULL), PHASES, OK),
    "SetupExperiment": (lambda f: f.SetupExperiment(0, c_double(0), c_double(1), 0, c_double(0)), PHASES[:1], OK),
    "EnterInitializationMode": (lambda f: f.EnterInitializationMode(), PHASES[:1], OK),
    "ExitInitializationMode": (lambda f: f.ExitInitializationMode(), PHASES[1:2], OK),
    "Terminate": (lambda f: f.Terminate(), PHASES[2:3], OK),
    "Reset": (lambda f: f.Reset(), PHASES, OK),
    "GetReal": (lambda f: f.GetReal(*reference(f, "u"), one(REALS)), PHASES[1:], OK),
    "GetInteger": (lambda f: f.GetInteger(*reference(f, "whole"), one(INTEGERS)), PHASES[1:], OK),
    "GetBoolean": (lambda f: f.GetBoolean(NULL, c_size_t(0), NULL), PHASES[1:], OK),
    "GetString": (lambda f: f.GetString(NULL, c_size_t(0), NULL), PHASES[1:], OK),
    "SetReal input": (lambda f: f.SetReal(*reference(f, "u"), one(REALS, 2)), PHASES[:3], OK),
    "SetReal tunable": (lambda f: f.SetReal(*reference(f, "rate"), one(REALS, 2)), PHASES[:3], OK),
    "SetReal start": (lambda f: f.SetReal(*reference(f, "x"), one(REALS, 2)), PHASES[:2], OK),
    "SetReal fixed": (lambda f: f.SetReal(*reference(f, "max_step"), one(REALS, 2)), PHASES[:2], OK),
    "SetReal output": (lambda f: f.SetReal(*reference(f, "y"), one(REALS, 2)), (), OK),
    "SetReal rate": (lambda f: f.SetReal(*reference(f, "der(x)"), one(REALS, 2)), (), OK),
    "SetInteger": (lambda f: f.SetInteger(NULL, c_size_t(0), NULL), PHASES[:3], OK),
    "SetBoolean": (lambda f: f.SetBoolean(NULL, c_size_t(0), NULL), PHASES[:3], OK),
    "SetString": (lambda f: f.SetString(NULL, c_size_t(0), NULL), PHASES[:3], OK),
    "DoStep": (lambda f: f.DoStep(c_double(0), c_double(0.01), 1), PHASES[2:3], OK),
    "CancelStep": (lambda f: f.CancelStep(), (), OK),
    "SetRealInputDerivatives": (lambda f: f.SetRealInputDerivatives(NULL, c_size_t(0), NULL, NULL), PHASES[:3], OK),
    "SetRealInputDerivatives of one": (
        lambda f: f.SetRealInputDerivatives(*reference(f, "u"), one(c_int, 1), one(REALS)),
        PHASES[:3],
        OK,
    ),
    "SetRealInputDerivatives of an output": (
        lambda f: f.SetRealInputDerivatives(*reference(f, "y"), one(c_int, 1), one(REALS)),
        (),
        OK,
    ),
    "GetRealOutputDerivatives": (lambda f: f.GetRealOutputDerivatives(NULL, c_size_t(0), NULL, NULL), PHASES[1:], OK),
    "GetRealOutputDerivatives of one": (
        lambda f: f.GetRealOutputDerivatives(*reference(f, "y"), one(c_int, 1), one(REALS)),
        (),
        OK,
    ),
    "GetStatus": (lambda f: f.GetStatus(0, byref(c_int())), PHASES, DISCARD),
    "GetRealStatus": (lambda f: f.GetRealStatus(2, byref(c_double())), PHASES, OK),
    "GetRealStatus of another kind": (lambda f: f.GetRealStatus(0, byref(c_double())), PHASES, DISCARD),
    "GetIntegerStatus": (lambda f: f.GetIntegerStatus(0, byref(c_int())), PHASES, DISCARD),
    "GetBooleanStatus": (lambda f: f.GetBooleanStatus(3, byref(c_int())), PHASES, OK),
    "GetStringStatus": (lambda f: f.GetStringStatus(1, byref(c_char_p())), PHASES, DISCARD),
    "saved states": (saved_state_calls, PHASES, OK),
    "GetDirectionalDerivative": (
        lambda f: f.GetDirectionalDerivative(*reference(f, "y"), *reference(f, "u"), one(REALS, 1), one(REALS)),
        PHASES[1:],
        OK,
    ),
}


@pytest.mark.parametrize(("call", "phase"), list(itertools.product(CALLS, PHASES)))
def test_a_call_is_answered_in_the_phases_of_the_standard_and_refused_in_all_others(load, fragile, call, phase):
    function, allowed, result = CALLS[call]
    fmu = bring(load(fragile), phase)
    fmu.messages.clear()
    status = function(fmu)
    if phase in allowed:
        assert result is None or status == result, fmu.said
        assert (status == OK or result is None) == (not fmu.messages)
        return
    assert status == ERROR
    assert f"fmi2{call.split()[0]}" in fmu.said
    # A refused call leaves the instance in its phase: what is allowed there still is.
    if phase == "running":
        assert fmu.step(0.01) == OK


def test_every_function_of_the_standard_was_called():
    header = (Path(fmpy.__file__).parent / "c-code" / "fmi2Functions.h").read_text()
    declared = header[header.rindex("Common Functions") :]
    exchange, slave = declared.index("for FMI2 for Model Exchange"), declared.index("for FMI2 for Co-Simulation")
    names = set(re.findall(r"FMI2_Export \w+ +fmi2(\w+);", declared[:exchange] + declared[slave:]))
    called = {name.split()[0] for name in CALLS} | {
        *("Instantiate", "FreeInstance", "GetVersion", "GetFMUstate", "SetFMUstate", "FreeFMUstate"),
        *("SerializedFMUstateSize", "SerializeFMUstate", "DeSerializeFMUstate"),
    }
    assert len(names) > 30
    assert names <= called


def test_versions(load):
    library = load("Gust").library
    for function, text in (("fmi2GetVersion", b"2.0"), ("fmi2GetTypesPlatform", b"default")):
        getattr(library, function).restype = c_char_p
        assert getattr(library, function)() == text


def test_instantiate_refuses_what_it_cannot_be(load):
    fmu = load("Gust")
    for arguments, word in (
        ({"name": ""}, "name"),
        ({"name": NULL}, "name"),
        ({"kind": 0}, "co-simulation"),
        ({"guid": "{00000000}"}, "GUID"),
    ):
        assert fmu.instantiate(**arguments) is None
        assert word in fmu.said
    assert fmu.messages[1][0] == "?"


def test_no_logger_and_no_callbacks_are_no_reason_to_crash(load):
    fmu = load("Gust", logger=False)
    assert fmu.step() == ERROR
    assert fmu.instantiate(callbacks=False, guid="{0}") is None
    silent = fmu.instantiate(callbacks=False)
    assert fmu.library.fmi2Terminate(c_void_p(silent)) == ERROR
    fmu.library.fmi2FreeInstance(c_void_p(silent))
    fmu.library.fmi2FreeInstance(c_void_p(None))
    assert fmu.library.fmi2Terminate(c_void_p(None)) == ERROR
    assert fmu.library.fmi2GetReal(c_void_p(None), NULL, c_size_t(0), NULL) == ERROR


def test_the_callbacks_are_not_read_after_instantiation(load):
    """The standard leaves the structure to the importer, which may hold it on its stack."""
    fmu = load("Gust")
    ctypes.memset(byref(fmu.callbacks), 0xFF, ctypes.sizeof(fmu.callbacks))
    assert fmu.step() == ERROR
    assert "fmi2DoStep" in fmu.said


# ---------------------------------------------------------------- messages


def test_events_are_told_only_while_logging_is_on(load):
    fmu = load("Gust")
    fmu.initialize()
    assert not fmu.messages
    loud = load("Gust", logging=True).initialize()
    assert [m[2] for m in loud.messages] == ["logEvents", "logEvents"]

    def categories(on, *names):
        return loud.SetDebugLogging(on, c_size_t(len(names)), (c_char_p * len(names))(*names) if names else NULL)

    for on, names, told in (
        (1, (), True),
        (0, (), False),
        (1, (b"logStatusError",), False),
        (1, (b"logStatusError", b"logEvents"), True),
        (0, (b"logEvents",), False),
    ):
        assert categories(on, *names) == OK
        loud.messages.clear()
        loud.Reset()
        loud.initialize()
        assert bool(loud.messages) == told
    assert categories(1, b"logAll") == ERROR
    assert "logAll" in loud.said
    assert loud.SetDebugLogging(1, c_size_t(1), NULL) == ERROR
    assert categories(1, NULL) == ERROR
    declared = {c.get("name") for c in model_xml(loud).iter("Category")}
    assert declared == {"logStatusError", "logStatusWarning", "logEvents"}


def model_xml(fmu):
    from lxml import etree

    (path,) = Path(fmu.library._name).parents[2].glob("modelDescription.xml")
    return etree.parse(path).getroot()


def test_percent_and_number_signs_reach_the_importer_doubled(load, tmp_path):
    """The message is a printf format, and #r12# in it would be replaced by a variable's name."""
    fmu = load(LEARNER, name="50%s#r1#")
    path = tmp_path / "100%d#n" / "tape"
    fmu.initialize(sample_time=0.1, tape_file=str(path))
    assert fmu.Terminate() == ERROR
    assert fmu.messages[-1][0] == "50%s#r1#"
    assert "100%%d##n" in fmu.said
    assert "100%d#n" in fmu.said.replace("%%", "%").replace("##", "#")


# ---------------------------------------------------------------- values


def test_value_references_out_of_range_and_of_another_type_are_refused(load):
    fmu = load(MIXED).initialize()
    count = len(fmu.references)
    for name, kind in fmu.types.items():
        for other in ("Real", "Integer", "Boolean", "String"):
            cell = (c_char_p if other == "String" else c_double if other == "Real" else c_int) * 1
            status = getattr(fmu, f"Get{other}")(*reference(fmu, name), cell())
            assert (status == OK) == (other == kind), (name, other)
            if other != kind:
                assert name in fmu.said or "reference" in fmu.said
                assert (
                    getattr(fmu, f"Set{other}")(*reference(fmu, name), cell(b"1" if other == "String" else 1)) == ERROR
                )
    for far in (count, count + 1, 2**31, 2**32 - 1):
        for other, cell in (("Real", c_double), ("Integer", c_int), ("Boolean", c_int), ("String", c_char_p)):
            assert getattr(fmu, f"Get{other}")(one(c_uint, far), c_size_t(1), (cell * 1)()) == ERROR
            assert str(far) in fmu.said
            assert getattr(fmu, f"Set{other}")(one(c_uint, far), c_size_t(1), (cell * 1)()) == ERROR
        assert (
            fmu.GetDirectionalDerivative(
                one(c_uint, far), c_size_t(1), *reference(fmu, "u[1]"), one(REALS, 1), one(REALS)
            )
            == ERROR
        )
        assert (
            fmu.GetDirectionalDerivative(*reference(fmu, "z"), one(c_uint, far), c_size_t(1), one(REALS, 1), one(REALS))
            == ERROR
        )


@pytest.mark.parametrize("kind", ["Real", "Integer", "Boolean", "String"])
def test_no_values_need_no_arrays_and_some_do(load, kind):
    fmu = load(MIXED).initialize()
    some = one(c_uint, 0)
    for way in ("Get", "Set"):
        call = getattr(fmu, f"{way}{kind}")
        assert call(NULL, c_size_t(0), NULL) == OK
        assert call(some, c_size_t(0), NULL) == OK
        assert call(NULL, c_size_t(1), (c_double * 1)()) == ERROR
        assert call(some, c_size_t(1), NULL) == ERROR
        assert "NULL" in fmu.said


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_numbers_that_are_not_finite_are_refused_and_nothing_is_taken(load, value):
    fmu = load("PointMassTrain").initialize()
    names = ("force", "disturbance")
    vr = (c_uint * 2)(*(fmu.references[n] for n in names))
    assert fmu.SetReal(vr, c_size_t(2), (c_double * 2)(5.0, value)) == ERROR
    assert "disturbance takes a finite number" in fmu.said
    assert [fmu.get(n) for n in names] == [0.0, 0.0]


def test_texts_come_back_and_have_a_limit(load):
    fmu = load(MIXED).enter()
    assert fmu.get("label") == b"a label"
    for text in ("", "Köln % # \\n", "x" * 1023):
        assert fmu.set("label", text) == OK
        assert fmu.get("label").decode() == text
    assert fmu.set("label", "x" * 1024) == ERROR
    assert "1023" in fmu.said
    assert fmu.SetString(*reference(fmu, "label"), one(c_char_p, NULL)) == ERROR
    assert fmu.get("label") == b"x" * 1023
    assert fmu.ExitInitializationMode() == OK
    assert fmu.set("label", "later") == ERROR
    assert fmu.set("remark", "an input") == OK


def test_parameters_keep_their_bounds(load):
    fmu = load(MIXED).initialize()
    assert fmu.set("gain", 2.5) == ERROR  # tunable: at once
    assert "gain = 2.5 is outside [0, 2]" in fmu.said
    assert fmu.get("gain") == 0.5
    assert fmu.set("gain", 2.0) == OK
    for name, value in (("gain", -0.1), ("teeth", 10), ("sample_time", -1.0)):
        fresh = load(MIXED).enter()
        assert fresh.set(name, value) == OK  # others may follow that it must be seen with
        assert fresh.ExitInitializationMode() == ERROR
        assert name in fresh.said
        assert fresh.step() == ERROR  # such an instance can only be reset


def test_computed_starts_follow_and_cannot_be_set(load):
    fmu = load(MIXED).enter()
    assert fmu.get("v") == 0.0625
    assert fmu.set("u[1]", 3.0) == OK
    assert fmu.get("v") == 9.0
    assert fmu.set("reverse", 1) == OK
    assert fmu.get("v") == -9.0
    assert fmu.set("v", 1.0) == ERROR
    assert "computed" in fmu.said
    assert fmu.set("x[1]", 7.0) == OK
    assert fmu.get("x[1]") == 7.0


def test_outputs_are_fresh_after_a_set_and_held_over_a_step(load):
    """A feed-through output of a sampled block belongs to the inputs it was computed from."""
    fmu = load(MIXED).initialize(**{"x[1]": 0.0, "u[1]": 1.0})
    assert fmu.get("y[1]") == 1.5
    assert fmu.step() == OK
    assert fmu.get("y[1]") == 1.5
    assert fmu.get("x[1]") != 0.0
    assert fmu.set("u[1]", 2.0) == OK
    assert fmu.get("y[1]") == fmu.get("x[1]") + 2.0 + 0.5


# ---------------------------------------------------------------- steps


@pytest.mark.parametrize("length", [0.0, -STEP, math.nan, math.inf, -math.inf])
def test_steps_that_go_nowhere_are_refused(load, length):
    fmu = load("PointMassTrain").initialize()
    assert fmu.step(length) == ERROR
    assert "must be positive" in fmu.said
    assert fmu.step() == OK


@pytest.mark.parametrize("at", [STEP / 2, -STEP, 2 * STEP, 0.0, math.nan, math.inf])
def test_a_step_must_continue_the_last_one(load, at):
    fmu = load("PointMassTrain").initialize()
    assert fmu.step() == OK
    assert fmu.step(at=at) == ERROR
    assert "does not continue" in fmu.said
    assert fmu.step() == OK


@pytest.mark.parametrize(("start", "step"), [(0.0, 0.1), (1e6, 1e-4), (0.0, 1.0 / 3.0), (-5.0, 0.01)])
def test_rounding_of_the_communication_point_is_forgiven(load, start, step):
    for summed in (True, False):
        fmu = load("PointMassTrain").initialize(start)
        at = start
        for k in range(200):
            assert fmu.step(step, at=at) == OK, fmu.said
            at = at + step if summed else start + (k + 1) * step
        assert fmu.last_successful_time() == pytest.approx(at, abs=1e-9)


def test_the_stop_time_ends_the_run(load):
    fmu = load("PointMassTrain").initialize(stop=1.0)
    for _ in range(4):
        assert fmu.step() == OK
    assert fmu.step() == ERROR
    assert "stop time" in fmu.said
    free = load("PointMassTrain").initialize()
    for _ in range(5):
        assert free.step() == OK
    assert load("PointMassTrain").initialize(stop=1.0).step(1.01) == ERROR


def test_a_million_summed_steps_reach_the_stop_time(load):
    """0.1 added up 10^6 times is 1e5 + 1.3e-6: five orders of magnitude more than a rounding of the last step."""
    end = sum(itertools.repeat(0.1, 1_000_000))
    assert end - 1e5 > 1e-6
    fmu = load("Gust").initialize(start=end - 0.1, stop=1e5)
    assert fmu.step(0.1) == OK


@pytest.mark.parametrize("stop", [-1.0, math.nan])
def test_an_experiment_that_ends_before_it_starts_is_refused(load, stop):
    fmu = load("Gust")
    assert fmu.SetupExperiment(0, c_double(0), c_double(0), 1, c_double(stop)) == ERROR
    assert fmu.SetupExperiment(0, c_double(0), c_double(math.inf), 0, c_double(0)) == ERROR
    assert fmu.SetupExperiment(0, c_double(0), c_double(1), 1, c_double(1)) == OK


def test_a_step_that_is_no_multiple_of_the_sample_time_is_refused(load):
    fmu = load(MIXED).initialize()
    assert fmu.step(0.3) == ERROR
    assert "multiple of sample_time" in fmu.said
    for tiny in (1e-300, 1e-12):
        fmu = load(COUNTER).initialize(sample_time=tiny)
        assert fmu.step(1.0) == ERROR


def test_hopeless_step_limits_are_errors_not_hours(load):
    fmu = load("PointMassTrain").initialize(max_step=1e-300)
    assert fmu.step() == ERROR
    assert "max_step" in fmu.said
    fmu = load(MIXED).initialize()
    fmu.Reset()
    fmu.enter()
    fmu.set("hold", 1e-3)
    assert fmu.ExitInitializationMode() == OK


# ---------------------------------------------------------------- errors


def test_a_result_that_is_not_finite_is_an_error_that_names_it(load, fragile):
    fmu = load(fragile).initialize()
    assert fmu.set("u", 0.0) == OK
    assert fmu.status_of_get("y") == ERROR
    assert "outputs: 'y' is inf at t = 0 s" in fmu.said
    assert fmu.step() == ERROR
    assert "'y'" in fmu.said
    assert fmu.last_successful_time() == 0.0
    assert fmu.get("u") == 0.0  # for whoever looks for the cause
    assert fmu.step() == ERROR
    assert "in error" in fmu.said


def test_a_state_that_runs_away_is_an_error_that_names_it(load, fragile):
    fmu = load(fragile).initialize(x=1e200, rate=1e200)
    assert fmu.status_of_get("der(x)") == ERROR
    assert "der(x)" in fmu.said
    assert fmu.step() == ERROR
    assert "derivatives: 'x' is" in fmu.said


@pytest.mark.parametrize("u", [0.75, 2e9])
def test_an_integer_that_is_none_is_an_error_that_names_it(load, fragile, u):
    fmu = load(fragile).initialize()
    assert fmu.set("u", u) == OK
    assert fmu.step() == ERROR
    assert "'whole'" in fmu.said
    assert "32-bit integer" in fmu.said


def test_after_an_error_a_saved_state_or_a_reset_goes_on(load, fragile):
    fmu = load(fragile).initialize(rate=0.1)
    good = fmu.save()
    assert fmu.step() == OK
    expected = fmu.get("x")
    assert fmu.set("u", 0.0) == OK
    assert fmu.step() == ERROR
    assert fmu.SetFMUstate(good) == OK
    fmu.time = 0.0  # and not "going backwards"
    assert fmu.step() == OK
    assert fmu.get("x") == expected
    assert fmu.set("u", 0.0) == OK
    assert fmu.step() == ERROR
    assert fmu.Reset() == OK
    fmu.initialize(rate=0.1)
    assert fmu.step() == OK
    assert fmu.get("x") == expected
    assert fmu.FreeFMUstate(byref(good)) == OK


# ---------------------------------------------------------------- reruns and saved states


def drive(fmu, first, count):
    """Steps of the mixed component, its inputs a function of the step: rides of three steps, waits of two."""
    rows = []
    for k in range(first, first + count):
        values = {"u[1]": math.sin(k), "u[2]": math.cos(3 * k), "count": k % 7, "door": int(k // 5 % 3 == 1)}
        values |= {"trip": 1 + k // 5, "trip_time": (k % 5 - 2) * STEP, "remark": f"step {k}"}
        for name, value in values.items():
            assert fmu.set(name, value) == OK, fmu.said
        assert fmu.step() == OK, fmu.said
        rows.append(json.dumps(fmu.everything(), default=bytes.decode))
    return rows


def mixed(load, **starts):
    return load(MIXED).initialize(seed=5, tape_duration=2.0, tape_cutoff=0.8, label="start", **starts)


def test_reset_makes_the_rerun_identical(load):
    fmu = mixed(load)
    first = drive(fmu, 0, 20)
    assert len(set(first)) == 20
    assert fmu.Reset() == OK
    fmu.initialize(seed=5, tape_duration=2.0, tape_cutoff=0.8, label="start")
    assert drive(fmu, 0, 20) == first
    assert fmu.Reset() == OK
    fmu.initialize()
    assert drive(fmu, 0, 20) != first  # reset took the parameters back as well


def test_a_restored_state_goes_on_identically_and_may_go_back_in_time(load):
    fmu = mixed(load)
    drive(fmu, 0, 7)
    state = fmu.save()
    expected = drive(fmu, 7, 9)
    for _ in range(2):
        assert fmu.SetFMUstate(state) == OK
        fmu.time = 7 * STEP
        assert drive(fmu, 7, 9) == expected
    before = fmu.to_bytes(state)
    address = state.value
    assert fmu.GetFMUstate(byref(state)) == OK  # overwritten in place
    assert state.value == address
    assert fmu.to_bytes(state) != before
    fmu.FreeFMUstate(byref(state))


def test_a_saved_state_holds_the_outputs_that_are_held(load):
    fmu = mixed(load)
    drive(fmu, 0, 3)
    expected = fmu.everything()
    state = fmu.save()
    drive(fmu, 3, 2)
    other = load(MIXED).initialize()
    for instance in (fmu, other):  # the other has a tape of another length
        assert instance.SetFMUstate(state) == OK
        assert instance.everything() == expected
    fmu.FreeFMUstate(byref(state))


def test_equal_states_are_equal_bytes(load):
    one, two = mixed(load), mixed(load)
    drive(one, 0, 6)
    two.set("label", "x" * 500)
    drive(two, 0, 2)
    two.Reset()
    two.initialize(seed=5, tape_duration=2.0, tape_cutoff=0.8, label="start")
    drive(two, 0, 6)
    states = [fmu.save() for fmu in (one, two)]
    assert one.to_bytes(states[0]) == two.to_bytes(states[1])
    for fmu, state in zip((one, two), states, strict=True):
        fmu.FreeFMUstate(byref(state))


def test_a_state_saved_before_initialization_can_be_restored(load):
    fmu = load(MIXED)
    state = fmu.save()
    mixed_rows = drive(fmu.initialize(tape_duration=2.0), 0, 6)
    assert fmu.SetFMUstate(state) == OK
    assert drive(fmu.initialize(tape_duration=2.0), 0, 6) == mixed_rows
    fmu.FreeFMUstate(byref(state))


def test_bytes_that_are_no_state_are_refused(load):
    fmu, train = mixed(load), load("PointMassTrain").initialize()
    drive(fmu, 0, 3)
    state = fmu.save()
    content = fmu.to_bytes(state)
    assert fmu.SerializeFMUstate(state, (ctypes.c_char * len(content))(), c_size_t(len(content) - 1)) == ERROR
    for bad in (b"", b"x", content[:-1], content[:50], b"x" * len(content), content[:64] + b"\xff" * 16 + content[80:]):
        assert fmu.from_bytes(bad) == ERROR
    assert train.from_bytes(content) == ERROR
    assert train.SetFMUstate(state) == ERROR
    assert "another model" in train.said
    assert fmu.SetFMUstate(NULL) == ERROR
    assert fmu.GetFMUstate(NULL) == ERROR
    assert fmu.SerializedFMUstateSize(NULL, byref(c_size_t())) == ERROR
    assert fmu.FreeFMUstate(NULL) == OK
    assert fmu.FreeFMUstate(byref(c_void_p())) == OK
    copy = fmu.from_bytes(content + b"more")  # an importer may round a buffer's length up
    assert fmu.SetFMUstate(copy) == OK
    for one_of in (state, copy):
        fmu.FreeFMUstate(byref(one_of))


IN_ANOTHER_PROCESS = """
import importlib.util, sys
from pathlib import Path
def module(name):
    spec = importlib.util.spec_from_file_location(name, Path(sys.argv[1]).with_name(f"{name}.py"))
    sys.modules[name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(sys.modules[name])
    return sys.modules[name]
bare, tests = module("bare"), module("test_runtime")
"""
CONTINUE = f"""{IN_ANOTHER_PROCESS}
fmu = bare.Fmu(Path(sys.argv[2]))
state = fmu.from_bytes(open(sys.argv[3], "rb").read())
assert fmu.SetFMUstate(state) == 0
fmu.time = 10 * tests.STEP
print("\\n".join(tests.drive(fmu, 10, 10)))
"""


def test_a_serialized_state_goes_on_identically_in_a_fresh_process(load, tmp_path, unpack):
    fmu = mixed(load)
    drive(fmu, 0, 10)  # to the end of a ride that is not yet committed
    state = fmu.save()
    (tmp_path / "state").write_bytes(fmu.to_bytes(state))
    fmu.FreeFMUstate(byref(state))
    folder = unpack(build(MIXED, kind="native"))
    command = [sys.executable, "-c", CONTINUE, __file__, str(folder), str(tmp_path / "state")]
    other = subprocess.run(command, capture_output=True, text=True, check=True)
    assert other.stdout.splitlines() == drive(fmu, 10, 10)


def test_two_instances_do_not_know_of_each_other(load):
    alone = [drive(mixed(load, gain=gain), 0, 15) for gain in (0.5, 1.5)]
    pair = [mixed(load, gain=gain) for gain in (0.5, 1.5)]
    interleaved = [[], []]
    for k in range(15):
        for rows, fmu in zip(interleaved, pair, strict=True):
            rows.extend(drive(fmu, k, 1))
    assert interleaved == alone


def resident():
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGESIZE")


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="reads the memory of this process from /proc")
def test_ten_thousand_instances_leave_no_memory_behind(load):
    fmu = load(MIXED)
    library, create = fmu.library, fmu.instantiate
    setup = (0, c_double(0), c_double(0), 0, c_double(0))

    def live(count):
        for _ in range(count):
            instance = c_void_p(create())
            state = c_void_p()
            assert library.fmi2SetupExperiment(instance, *setup) == OK
            assert library.fmi2EnterInitializationMode(instance) == OK
            assert library.fmi2ExitInitializationMode(instance) == OK
            assert library.fmi2DoStep(instance, c_double(0), c_double(STEP), 1) == OK
            assert library.fmi2GetFMUstate(instance, byref(state)) == OK
            assert library.fmi2SetFMUstate(instance, state) == OK
            assert library.fmi2FreeFMUstate(instance, byref(state)) == OK
            library.fmi2FreeInstance(instance)

    live(500)
    before = resident()
    live(10_000)
    # One instance is 12 kB and its tape 77 kB; a leak of 100 bytes per cycle would show.
    assert resident() - before < 1_000_000


# ---------------------------------------------------------------- derivatives


def differences(fmu, unknowns, knowns, direction, width=1e-6):
    """The same by central differences of sets and gets."""
    start = [fmu.get(name) for name in knowns]
    sides = []
    for sign in (1.0, -1.0):
        for name, value, d in zip(knowns, start, direction, strict=True):
            assert fmu.set(name, value + sign * width * d) == OK, fmu.said
        sides.append([fmu.get(name) for name in unknowns])
    for name, value in zip(knowns, start, strict=True):
        fmu.set(name, value)
    return [(a - b) / (2.0 * width) for a, b in zip(*sides, strict=True)]


def test_directional_derivatives_of_the_train_are_the_analytic_ones(load):
    """dv' = dF/m - (c1 + 2 c2 v) dv + da; dx' = dv."""
    fmu = load("PointMassTrain").initialize(speed=20.0, position=5.0)
    knowns = ("force", "disturbance", "speed", "position")
    names = ("acceleration", "der(speed)", "der(position)", "applied_force", "speed", "position")
    slope = 0.00077616 + 2 * 0.00016 * 20.0
    found = fmu.directional(names, knowns, (4e5, 0.5, 2.0, 3.0))
    expected = 1.0 + 0.5 - slope * 2.0
    assert found == pytest.approx([expected, expected, 2.0, 4e5, 2.0, 3.0], rel=1e-14)


def test_directional_derivatives_of_the_controller_are_the_analytic_ones(load):
    """Without neighbours demand = a tanh(alpha (v_r - v) / a), so d demand = (1 - tanh^2) alpha (dv_r - dv)."""
    fmu = load("ComfortCruise").initialize()
    fmu.set("speed", 50.0)
    fmu.set("target_speed", 80.0)
    alpha = ComfortCruise().alpha
    bottom = alpha * 30.0
    found = fmu.directional(("demand", "bottom_demand"), ("target_speed", "speed"), (1.0, -0.5))
    assert found == pytest.approx([(1.0 - math.tanh(bottom) ** 2) * alpha * 1.5, alpha * 1.5], rel=1e-13)


@pytest.mark.parametrize("u", [-1.7, 0.3, 2.4])
def test_directional_derivatives_agree_with_differences_for_every_function(load, u):
    fmu = load(FUNCTIONS).initialize()
    fmu.set("u", u)
    unknowns = [n for n in fmu.references if n.startswith(("scalars", "arrays")) or n == "der(s)"]
    knowns, direction = ("u", "w[1]", "w[2]", "w[3]", "a"), (1.0, 0.5, -0.25, 2.0, 0.1)
    found = fmu.directional(unknowns, knowns, direction)
    assert found == pytest.approx(differences(fmu, unknowns, knowns, direction), rel=1e-6, abs=1e-8)


def test_the_derivative_of_a_square_is_defined_everywhere(load):
    """The rule of powers has a logarithm of the base in it: nothing that may show where the exponent is constant."""
    fmu = load(FUNCTIONS).initialize()
    for u in (-2.0, 0.0):
        fmu.set("u", u)
        assert fmu.directional(("scalars[10]", "scalars[11]"), ("u",), (1.0,)) == [2.0 * u, 3.0 * u * u]


def test_in_initialization_a_computed_start_moves_with_what_it_follows_from(load):
    """v = u[1]^2 at the start, z = tanh(x[1] + v), der(v) = x[1] - v; afterwards v stands on its own."""
    fmu = load(MIXED).enter()
    fmu.set("u[1]", 0.5)
    unknowns, knowns, direction = ("v", "z", "der(v)", "m[1]", "m[2]"), ("u[1]", "x[1]", "u[2]"), (2.0, 0.5, 1.0)
    slope = 1.0 - math.tanh(1.25) ** 2
    expected = [2.0, slope * 2.5, 0.5 - 2.0, 4.0, 2.0]
    found = fmu.directional(unknowns, knowns, direction)
    assert found == pytest.approx(expected, rel=1e-14)
    assert found == pytest.approx(differences(fmu, unknowns, knowns, direction), rel=1e-6)
    assert fmu.get("v") == 0.25
    assert fmu.directional(("z",), ("v",), (1.0,)) == ERROR
    assert fmu.ExitInitializationMode() == OK
    assert fmu.directional(("v", "z"), ("u[1]",), (1.0,)) == [0.0, 0.0]
    assert fmu.directional(("v", "z"), ("v",), (1.0,)) == pytest.approx([1.0, slope], rel=1e-14)


def test_directional_derivatives_know_their_unknowns(load):
    fmu = load(COUNTER).initialize()
    assert fmu.directional(("total",), ("total",), (3.0,)) == [3.0]  # memory shown as an output, without any state
    assert fmu.directional(("through", "total"), ("u",), (2.0,)) == [2.0, 0.0]
    assert fmu.directional((), (), ()) == []
    assert fmu.directional(("through",), (), ()) == [0.0]
    assert fmu.directional(("u",), ("u",), (1.0,)) == ERROR
    assert fmu.directional(("count",), ("u",), (1.0,)) == ERROR
    assert fmu.directional(("through",), ("through",), (1.0,)) == ERROR
    assert fmu.GetDirectionalDerivative(NULL, c_size_t(1), NULL, c_size_t(0), NULL, NULL) == ERROR


def test_rates_are_those_of_the_equations(load):
    fmu = load("PointMassTrain").initialize(speed=30.0)
    for force in (0.0, 2e5):
        fmu.set("force", force)
        train = PointMassTrain(speed=30.0, force=force)
        assert fmu.get("der(speed)") == train.derivatives()["speed"] == fmu.get("acceleration")
        assert fmu.get("der(position)") == 30.0


# ---------------------------------------------------------------- the tape


def learner(load, path, **starts):
    fmu = load(LEARNER)
    return fmu.initialize(sample_time=0.1, tape_duration=1.0, tape_file=str(path), **starts)


def ride(fmu, trip, errors):
    length = 0.1
    for k, error in enumerate([0.0, *errors]):
        fmu.set("trip", trip)
        fmu.set("trip_time", (k - 1) * length)
        fmu.set("error", error)
        assert fmu.step(length) == OK, fmu.said


def python_deck(gain_errors, cutoff=0.0):
    """A deck that recorded the same: column 1 the learned value, columns 2 and 3 the pair."""
    learner_class = resolve(LEARNER)
    component = learner_class()
    slots = tuple(component.slots[n] for n in ("learned", "pair"))
    deck = TapeDeck("Learner", slots, component.present_values, sample_time=0.1, duration=1.0, cutoff=cutoff)
    for n, error in enumerate(gain_errors):
        half = 0.5 * abs(error)
        deck.record(n * 0.1, {"learned": 0.5 * error, "pair": np.array([7.0 + half, 7.0 + half])})
    deck.commit(lambda: True)
    return deck


ERRORS = (1.0, -2.0, 1 / 3, 1e-300, 1e22, 123456789.0, 0.1, 1e16, 12345.678e-10)


@pytest.mark.parametrize("cutoff", [0.0, 0.05, 0.9, 40.0])
def test_the_tape_file_is_the_one_that_python_writes_byte_for_byte(load, tmp_path, cutoff):
    """Filtered between trips also where the pad is longer than the trip."""
    fmu = learner(load, tmp_path / "native", tape_cutoff=cutoff)
    ride(fmu, 1, ERRORS)
    assert fmu.Terminate() == OK
    deck = python_deck(ERRORS, cutoff)
    deck.save(tmp_path / "python")
    assert (tmp_path / "native").read_bytes() == (tmp_path / "python").read_bytes()
    assert not (tmp_path / "native.part").exists()


def test_a_trip_of_one_sample_is_kept_as_it_is(load, tmp_path):
    fmu = learner(load, tmp_path / "native", tape_cutoff=1.0)
    ride(fmu, 1, [3.0])
    assert fmu.Terminate() == OK
    python_deck([3.0], 1.0).save(tmp_path / "python")
    assert (tmp_path / "native").read_bytes() == (tmp_path / "python").read_bytes()
    assert smooth(np.array([[1.5]]), 1.0, 0.1) == 1.5


@pytest.mark.parametrize("ends", [b"\n", b"\r\n"])
def test_the_file_is_read_back(load, tmp_path, ends):
    path = tmp_path / "tape"
    deck = python_deck(ERRORS)
    deck.save(path)
    path.write_bytes(path.read_bytes().replace(b"\n", ends))
    fmu = learner(load, path)
    fmu.set("trip_time", 0.2)
    assert fmu.get("command") == deck.committed[2, 0]
    fmu.set("trip_time", 0.4)
    assert fmu.get("pair_seen[2]") == deck.committed[4, 2]


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (lambda t: "nonsense\n", "not a tape file"),
        (lambda t: "", "not a tape file"),
        (lambda t: t.replace("sample_time=0.1", "sample_time=0.2"), "does not fit"),
        (lambda t: t.replace("Learner", "Teacher"), "does not fit"),
        (lambda t: t.removesuffix("end\n"), "corrupt"),
        (lambda t: t + "\n", "corrupt"),
        (lambda t: t.replace("\n0.5 ", "\nnan ", 1), "corrupt"),
        (lambda t: t.replace("\n0.5 ", "\n", 1), "corrupt"),
        (lambda t: t.replace("\n0.5 ", "\n0.5x ", 1), "corrupt"),
        (lambda t: t.replace("\n0.5 ", "\n0.5 1.0 ", 1), "corrupt"),
        (lambda t: t.replace("\n0.5 ", "\n" + "1" * 500 + " ", 1), "corrupt"),
    ],
)
def test_a_file_that_cannot_be_used_is_refused_with_the_reason(load, tmp_path, spoil, said):
    path = tmp_path / "tape"
    python_deck(ERRORS).save(path)
    text = path.read_text()
    path.write_text(spoil(text))
    assert path.read_text() != text
    fmu = load(LEARNER).enter()
    fmu.set("sample_time", 0.1)
    fmu.set("tape_duration", 1.0)
    fmu.set("tape_file", str(path))
    assert fmu.ExitInitializationMode() == ERROR
    assert said in fmu.said
    assert path.read_text() == spoil(text)


def test_a_tape_that_cannot_be_is_refused(load):
    for starts, said in (
        ({"sample_time": 0.0}, "sample_time must be set"),
        ({"sample_time": 1e-9, "tape_duration": 1e9}, "cannot be"),
        ({"sample_time": 0.1, "tape_duration": -5.0}, "cannot be"),
        ({"sample_time": 1e-6, "tape_cutoff": 1e-6}, "too low"),
    ):
        fmu = load(LEARNER).enter()
        for name, value in starts.items():
            fmu.set(name, value)
        assert fmu.status_of_get("command") == ERROR
        assert said in fmu.said


LOCALE = f"""{IN_ANOTHER_PROCESS}
import locale
locale.setlocale(locale.LC_ALL, sys.argv[4])
assert locale.localeconv()["decimal_point"] != "."
fmu = bare.Fmu(Path(sys.argv[2])).initialize(sample_time=0.1, tape_duration=1.0, tape_file=sys.argv[3])
tests.ride(fmu, 1, tests.ERRORS)
assert fmu.Terminate() == 0
again = bare.Fmu(Path(sys.argv[2])).initialize(sample_time=0.1, tape_duration=1.0, tape_file=sys.argv[3])
again.set("trip_time", 0.2)
assert again.get("command") == 0.5 * tests.ERRORS[2]
"""


def test_the_file_does_not_depend_on_the_locale_of_the_host(tmp_path, unpack):
    """A German host writes 0,5: the file must say 0.5."""
    archive = tmp_path / "locales"
    archive.mkdir()
    if shutil.which("localedef") is not None:
        command = ["localedef", "-i", "de_DE", "-f", "UTF-8", str(archive / "de_DE.utf8")]
        subprocess.run(command, capture_output=True, check=False)
    if not (archive / "de_DE.utf8").exists():
        pytest.skip("localedef cannot make a German locale here")
    folder = unpack(build(LEARNER, kind="native"))
    command = [sys.executable, "-c", LOCALE, __file__, str(folder), str(tmp_path / "native"), "de_DE.utf8"]
    subprocess.run(command, check=True, env={**os.environ, "LOCPATH": str(archive)})
    python_deck(ERRORS).save(tmp_path / "python")
    assert (tmp_path / "native").read_bytes() == (tmp_path / "python").read_bytes()


# ---------------------------------------------------------------- size


@pytest.mark.long
def test_a_model_of_thousands_of_values_runs(load, write_component):
    many = write_component(
        "from railcosim.components import Component, Input, Output, Size, State\n"
        "class C(Component):\n"
        '    "Many of everything."\n'
        "    n = Size(1000)\n"
        '    u = Input("1", shape=(n,))\n'
        '    x = State("1", 1.0, shape=(n,))\n'
        '    y = Output("1", shape=(n,))\n'
        "    def derivatives(self):\n"
        '        return {"x": self.u - self.x}\n'
        "    def outputs(self):\n"
        '        return {"y": 2.0 * self.x}\n'
    )
    fmu = load(many).initialize()
    assert fmu.step() == OK
    assert fmu.get("y[1000]") == pytest.approx(2.0 * math.exp(-STEP), rel=1e-5)
    state = fmu.save()
    copy = fmu.from_bytes(fmu.to_bytes(state))
    assert fmu.SetFMUstate(copy) == OK
    assert fmu.directional(("y[1000]", "der(x[1])"), ("x[1000]", "u[1]"), (1.0, 3.0)) == [2.0, 3.0]
    for one_of in (state, copy):
        fmu.FreeFMUstate(byref(one_of))


def test_empty_arrays_are_no_variables(load, write_component):
    chain = load(CHAIN, {"masses": 2}).initialize()
    assert "tension[1]" in chain.references
    single = write_component(
        "from railcosim.components import Component, Output, Size, State\n"
        "class C(Component):\n"
        '    "One carriage has no coupler."\n'
        "    n = Size(1)\n"
        '    x = State("m", 1.0, shape=(n,), output=True)\n'
        '    pull = Output("N", shape=(n - 1,))\n'
        "    def derivatives(self):\n"
        '        return {"x": -self.x}\n'
        "    def outputs(self):\n"
        '        return {"pull": self.x[:-1] - self.x[1:]}\n'
    )
    fmu = load(single).initialize()
    assert fmu.step() == OK
    assert set(fmu.references) == {"max_step", "x[1]", "der(x[1])"}


def test_bounds_and_starts_are_those_of_the_component(load):
    train = PointMassTrain(speed=12.5, mass=3e5, limit_force=True)
    fmu = load(train).initialize()
    for slot in train.of(Parameter):
        assert fmu.get(slot.name) == train.present_values[slot.name]
    assert fmu.get("speed") == 12.5
