"""fmi2.c: who may call what and when, what comes of it, and ten thousand instances."""

import ctypes
import itertools
import os
import re
from ctypes import byref, c_char_p, c_double, c_int, c_size_t, c_uint, c_void_p
from pathlib import Path

import fmpy
import pytest

SAMPLES = Path(__file__).parents[1] / "native_samples.py"
MIXED = f"{SAMPLES}:Mixed"
BREAKS = f"{Path(__file__).parent / 'samples.py'}:Breaks"
OK = 0
DISCARD = 2
ERROR = 3
STEP = 0.25
NULL = None
REALS = c_double
INTEGERS = c_int


# ---------------------------------------------------------------- the calling sequence

PHASES = ("instantiated", "initialization", "running", "terminated", "error")


def bring(fmu, phase):
    """An instance of what breaks when it is told to in one of the phases."""
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
    "SetReal start": (lambda f: f.SetReal(*reference(f, "x_start"), one(REALS, 2)), PHASES[:2], OK),
    "SetReal state": (lambda f: f.SetReal(*reference(f, "x"), one(REALS, 2)), (), OK),
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
def test_a_call_is_answered_in_the_phases_of_the_standard_and_refused_in_all_others(load, call, phase):
    function, allowed, result = CALLS[call]
    fmu = bring(load(BREAKS), phase)
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
        ({"kind": 0, "name": NULL}, "co-simulation"),
        ({"guid": "{00000000}"}, "GUID"),
    ):
        assert fmu.instantiate(**arguments) is None
        assert word in fmu.said
    assert fmu.messages[1][0] == "?"


def test_no_logger_and_no_callbacks_are_no_reason_to_crash(load):
    fmu = load("Gust", logger=False)
    assert fmu.step() == ERROR
    assert fmu.instantiate(guid="{0}") is None
    assert fmu.instantiate(callbacks=False, guid="{0}") is None
    silent = fmu.instantiate(callbacks=False)
    assert fmu.library.fmi2Terminate(c_void_p(silent)) == ERROR
    fmu.library.fmi2FreeInstance(c_void_p(silent))
    fmu.library.fmi2FreeInstance(c_void_p(None))
    assert fmu.library.fmi2Terminate(c_void_p(None)) == ERROR
    assert fmu.library.fmi2GetReal(c_void_p(None), NULL, c_size_t(0), NULL) == ERROR


WITHOUT_INSTANCE = [name for name in CALLS if name not in ("GetTypesPlatform", "saved states")]


@pytest.mark.parametrize("call", WITHOUT_INSTANCE)
def test_a_call_without_an_instance_is_an_error_and_no_crash(load, call):
    fmu = load(BREAKS).initialize()
    instance, fmu.instance = fmu.instance, NULL
    try:
        assert CALLS[call][0](fmu) == ERROR
    finally:
        fmu.instance = instance


@pytest.mark.parametrize("function", ["GetFMUstate", "SetFMUstate", "FreeFMUstate"])
def test_no_instance_has_a_state(load, function):
    library, place = load("Gust").library, byref(c_void_p())
    assert getattr(library, f"fmi2{function}")(NULL, place) == ERROR


@pytest.mark.parametrize("function", ["SerializedFMUstateSize", "SerializeFMUstate", "DeSerializeFMUstate"])
def test_no_instance_has_bytes_of_a_state(load, function):
    library, place = load("Gust").library, byref(c_void_p())
    arguments = (
        [NULL, place, place, c_size_t(8)] if function != "DeSerializeFMUstate" else [NULL, b"x" * 8, c_size_t(8)]
    )
    assert getattr(library, f"fmi2{function}")(*arguments, place) == ERROR


def test_an_fmu_without_a_guid_is_another(load):
    create = load("Gust").library.fmi2Instantiate
    create.restype = c_void_p
    assert create(b"it", 1, NULL, b"", NULL, 0, 0) is None


def test_a_status_has_no_place_to_go(load):
    fmu = load("Gust").initialize()
    assert fmu.GetRealStatus(2, NULL) == DISCARD
    assert fmu.GetBooleanStatus(3, NULL) == DISCARD
    assert fmu.GetBooleanStatus(0, byref(c_int())) == DISCARD


def test_the_callbacks_are_not_read_after_instantiation(load):
    """The standard leaves the structure to the importer, which may hold it on its stack."""
    fmu = load("Gust")
    ctypes.memset(byref(fmu.callbacks), 0xFF, ctypes.sizeof(fmu.callbacks))
    assert fmu.step() == ERROR
    assert "fmi2DoStep" in fmu.said


# ---------------------------------------------------------------- reruns and saved states


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
