"""fmi3.c and absent.c: the functions of FMI 3.0 over the same runtime, arrays at once, and the same bits as FMI 2.0."""

import ctypes
import re
from ctypes import byref, c_bool, c_char_p, c_double, c_size_t, c_uint32, c_void_p
from pathlib import Path

import fmpy
import pytest
from railcosim.fmus.build import build

from .bare3 import CELLS, ERROR, NULL, OK, STEP, Fmu

SAMPLES = Path(__file__).parents[1] / "native_samples.py"
MIXED = f"{SAMPLES}:Mixed"
HEADER = Path(fmpy.__file__).parent / "c-code" / "fmi3FunctionTypes.h"
TYPES = ("Float32", *(f"{sign}Int{bits}" for sign in ("", "U") for bits in (8, 16, 32, 64)), "Binary", "Clock")
PRESENT = {
    *("GetVersion", "InstantiateCoSimulation", "FreeInstance", "SetDebugLogging", "EnterInitializationMode"),
    *("ExitInitializationMode", "Terminate", "Reset", "DoStep", "GetDirectionalDerivative"),
    *("GetFMUState", "SetFMUState", "FreeFMUState", "SerializedFMUStateSize", "SerializeFMUState"),
    *("DeserializeFMUState", *(f"{verb}{kind}" for verb in ("Get", "Set") for kind in CELLS)),
}


@pytest.fixture
def mixed(unpack):
    """Makes instances of a component with a variable of each kind, as FMI 3.0 has it."""
    made = []

    def make():
        made.append(Fmu(unpack(build(MIXED, kind="native", fmi="3"))))
        return made[-1]

    yield make
    for fmu in made:
        fmu.FreeInstance()


def names():
    return re.findall(r"fmi3(\w+)TYPE\s*\(", HEADER.read_text())


def test_every_function_of_the_standard_is_there(mixed):
    library = mixed().library
    assert len(names()) == 75
    assert set(names()) >= PRESENT
    for name in names():
        assert getattr(library, f"fmi3{name}")
    library.fmi3GetVersion.restype = c_char_p
    assert library.fmi3GetVersion() == b"3.0"


@pytest.mark.parametrize("name", sorted(set(names()) - PRESENT))
def test_what_the_standard_has_and_these_fmus_have_not_is_refused_with_the_reason(mixed, name):
    fmu = mixed().initialize()
    function, other = getattr(fmu.library, f"fmi3{name}"), [NULL] * 8
    if name.startswith("Instantiate"):
        function.restype = c_void_p
        assert (
            function(b"it", NULL, NULL, c_bool(False), c_bool(False), c_void_p(7), fmu._logger, NULL, NULL, NULL)
            is None
        )
        assert "co-simulation" in fmu.said
        return
    assert function(NULL, *other) == ERROR
    assert function(c_void_p(fmu.instance), NULL, c_size_t(1), *other) == ERROR
    assert f"fmi3{name}: this FMU has no " in fmu.said
    of_type = name[3:] in TYPES
    assert function(c_void_p(fmu.instance), NULL, c_size_t(0), *other) == (OK if of_type else ERROR)


@pytest.mark.parametrize("name", sorted(PRESENT - {"GetVersion", "InstantiateCoSimulation", "FreeInstance"}))
def test_a_call_without_an_instance_is_an_error_and_no_crash(mixed, name):
    function = getattr(mixed().library, f"fmi3{name}")
    assert function(NULL, *[NULL] * 8) == ERROR


def test_a_step_of_no_instance_reaches_nothing(mixed):
    reached = c_double(7.0)
    step = c_double(0.0), c_double(STEP), c_bool(True)
    assert mixed().library.fmi3DoStep(NULL, *step, NULL, NULL, NULL, byref(reached)) == ERROR
    assert reached.value == 7.0


def test_instances_are_refused_by_name_token_and_event_mode(mixed):
    fmu = mixed()
    for wrong, word in (
        ({"name": b""}, "name"),
        ({"token": b"{0}"}, "instantiation token"),
        ({"events": True}, "event mode"),
    ):
        assert fmu.create(**wrong) is None
        assert word in fmu.said
        assert fmu.messages[-1][:3] == (7, ERROR, b"logStatusError")
    assert fmu.create(token=b"{0}", logger=False) is None


def test_messages_are_as_they_are_for_no_one_formats_them(mixed):
    fmu = mixed()
    category = (c_char_p * 1)(b"100%")
    assert fmu.SetDebugLogging(c_bool(True), c_size_t(1), category) == ERROR
    assert fmu.said == "Mixed: there is no log category 100%"
    assert fmu.SetDebugLogging(c_bool(True), c_size_t(0), NULL) == OK
    fmu.initialize()
    assert fmu.messages[-1][1:] == (OK, b"logEvents", b"initialized")


def test_who_may_call_what_when(mixed):
    fmu = mixed()
    assert fmu.enter(start=float("nan")) == ERROR
    assert fmu.DoStep(c_double(0), c_double(STEP), c_bool(True), NULL, NULL, NULL, NULL) == ERROR
    fmu.initialize()
    assert fmu.enter() == ERROR
    assert fmu.step() == OK
    assert fmu.step(-1.0) == ERROR
    assert fmu.Terminate() == OK
    assert fmu.step() == ERROR
    assert "terminated" in fmu.said
    assert fmu.Reset() == OK
    fmu.time = 0.0
    assert fmu.initialize().step() == OK


def test_arrays_come_whole_and_in_the_right_number(mixed):
    fmu = mixed()
    assert fmu.set("u", 1.0, 2.0) == OK
    assert fmu.set("u", 1.0) == ERROR
    assert fmu.set("u", 1.0, 2.0, 3.0) == ERROR
    assert fmu.said == "Mixed: fmi3SetFloat64: 3 values are not those of the variables"
    assert fmu.set("u", float("nan"), 2.0) == ERROR
    assert "u[1] takes a finite number" in fmu.said
    assert fmu.set("label", b"a", b"b") == ERROR
    assert fmu.set("label") == ERROR
    assert fmu.set("label", b"new") == OK
    fmu.initialize()
    assert fmu.get("u") == [1.0, 2.0]
    assert fmu.get("u", again=2) == [1.0, 2.0, 1.0, 2.0]
    assert fmu.get("label") == [b"new"]
    for name, count in (("u", 1), ("u", 3), ("label", 0), ("label", 2)):
        fmu.get(name, count=count, status=ERROR)
        assert f"{count} values are not those" in fmu.said


def test_an_element_of_an_array_is_no_variable_of_its_own(mixed):
    fmu = mixed().initialize()
    inside = (c_uint32 * 1)(fmu.variables["u"].valueReference + 1), c_size_t(1)
    assert fmu.GetFloat64(*inside, (c_double * 1)(), c_size_t(1)) == ERROR
    assert "no variable with value reference" in fmu.said
    of_a_rate = (c_uint32 * 1)(fmu.variables["der(x)"].valueReference + 1), c_size_t(1)
    assert fmu.GetFloat64(*of_a_rate, (c_double * 1)(), c_size_t(1)) == ERROR
    for name in ("y", "x", "der(x)"):
        reference = (c_uint32 * 1)(fmu.variables[name].valueReference + 1)
        found = (c_double * 1)()
        assert (
            fmu.GetDirectionalDerivative(
                reference, c_size_t(1), NULL, c_size_t(0), NULL, c_size_t(0), found, c_size_t(1)
            )
            == ERROR
        )
        assert "neither a real output nor a rate" in fmu.said


def test_the_time_is_the_last_communication_point_and_not_to_be_set(mixed):
    fmu = mixed().initialize()
    assert fmu.get("time") == [0.0]
    assert fmu.step() == OK
    assert fmu.get("time") == [STEP]
    assert fmu.set("time", 1.0) == ERROR


DRIVEN = {"u": [0.25, -0.5], "door": [True], "count": [3]}


def in_version_2(load):
    """The same component behind FMI 2.0, driven alike; scalars by name after each step."""
    fmu = load(MIXED).initialize()
    for name, values in DRIVEN.items():
        for k, value in enumerate(values):
            assert fmu.set(name if len(values) == 1 else f"{name}[{k + 1}]", value) == OK
    for _ in range(8):
        assert fmu.step(0.1) == OK
        yield fmu.everything()


def test_the_bits_are_those_of_fmi_2(load, mixed):
    fmu = mixed().initialize()
    for name, values in DRIVEN.items():
        assert fmu.set(name, *values) == OK
    for expected in in_version_2(load):
        assert fmu.step(0.1) == OK
        for name in fmu.variables.keys() - {"time"}:
            found = fmu.get(name)
            pattern = re.sub(r"x", "x[{}]", name) if name == "der(x)" else f"{name}[{{}}]"
            scalars = [name] if name in expected else [pattern.format(k + 1) for k in range(len(found))]
            assert found == [expected[scalar] for scalar in scalars], name


def test_directional_derivatives_are_those_of_fmi_2(load, mixed):
    two, three = load(MIXED).initialize(), mixed().initialize()
    seed = [0.5, -2.0]
    expected = two.directional(["y[1]", "y[2]", "der(x[1])", "der(x[2])", "z", "x[1]", "x[2]"], ["x[1]", "x[2]"], seed)
    assert three.derivative(["y", "der(x)", "z", "x"], ["x"], seed, 7) == expected
    for unknowns, given, count in ((["y"], seed[:1], 2), (["y"], [*seed, 0.0], 2), (["y"], seed, 1), (["y"], seed, 3)):
        assert three.derivative(unknowns, ["x"], given, count) == ERROR


def test_a_saved_state_goes_on_in_another_instance(mixed):
    fmu, other = mixed().initialize(), mixed()
    assert fmu.step() == OK
    state, copy, size = c_void_p(), c_void_p(), c_size_t()
    assert fmu.GetFMUState(byref(state)) == OK
    assert fmu.SerializedFMUStateSize(state, byref(size)) == OK
    content = (ctypes.c_uint8 * size.value)()
    assert fmu.SerializeFMUState(state, content, size) == OK
    assert other.DeserializeFMUState(content, size, byref(copy)) == OK
    assert other.SetFMUState(copy) == OK
    other.time = fmu.time
    assert fmu.step() == other.step() == OK
    assert all(fmu.get(name) == other.get(name) for name in fmu.variables)
    assert fmu.FreeFMUState(byref(state)) == other.FreeFMUState(byref(copy)) == OK
