"""The real-time profile: no file, no memory after instantiation, no printf, and the same numbers to the bit."""

import ctypes
import math
import os
import shutil
import subprocess
import sys
import zipfile
from ctypes import byref, c_char, c_size_t, c_void_p
from pathlib import Path

import fmpy
import pytest
from railcosim.fmus import toolchain
from railcosim.fmus.build import build

SAMPLES = Path(__file__).parents[2] / "components" / "samples.py"
LEARNER = f"{SAMPLES}:Learner"
MIXED = f"{Path(__file__).parents[1] / 'native_samples.py'}:Mixed"
HEADERS = Path(fmpy.__file__).parent / "c-code"
OK, ERROR, STEP = 0, 3, 0.25
linux = pytest.mark.skipif(
    not sys.platform.startswith("linux") or toolchain.system_compiler() is None, reason="compiles a Linux library"
)


HOW = {"sample_time": 0.1, "tape_duration": 2.0, "tape_cutoff": 1.0}


@pytest.fixture
def learner(load, component_class):
    return load(component_class(LEARNER)(**HOW), profile="real-time")


def learn(fmu, trips=3, samples=20):
    """Errors of 1 on each trip; what comes out of every sample."""
    found = []
    for trip in range(1, trips + 1):
        for n in range(-2, samples):
            for name, value in (("trip", trip), ("trip_time", n * 0.1), ("error", math.sin(n))):
                assert fmu.set(name, value) == OK
            assert fmu.step(0.1) == OK
            found.append((fmu.get("command"), fmu.get("pair_seen[2]")))
    return found


def test_a_tape_learns_as_with_memory_of_its_own(load, learner):
    assert learn(load(LEARNER).initialize(**HOW)) == learn(learner.initialize())
    learner.Reset()
    learner.initialize()
    assert learner.get("command") == 0.0
    assert learner.Terminate() == OK


def test_everything_at_once_gives_the_same_bits(load):
    usual, bounded = load(MIXED).initialize(), load(MIXED, profile="real-time").initialize()
    for k in range(40):
        for fmu in (usual, bounded):
            assert fmu.set("trip_time", (k - 2) * STEP) == OK
            assert fmu.step() == OK
        assert usual.everything() == bounded.everything()


def test_no_more_samples_than_there_is_room_for(learner):
    learner.enter()
    assert learner.set("tape_duration", 2.1) == OK
    assert learner.ExitInitializationMode() == ERROR
    assert learner.said.endswith(
        "this real-time FMU has room for a tape of 21 samples and 22 of run-in, not 22 and 22; lower tape_duration, or "
        "compile its sources with larger TAPE_ROWS and TAPE_PAD"
    )


def test_no_longer_run_in_than_there_is_room_for(learner):
    learner.enter()
    assert learner.set("tape_cutoff", 0.5) == OK
    assert learner.ExitInitializationMode() == ERROR
    assert "room for a tape of 21 samples and 22 of run-in, not 21 and 38;" in learner.said


def test_no_file_is_read(learner, tmp_path):
    learner.enter()
    assert learner.set("tape_file", str(tmp_path / "tape")) == OK
    assert learner.ExitInitializationMode() == ERROR
    assert learner.said.endswith("tape_file: a real-time FMU reads and writes no files; leave it empty")


def test_no_state_is_saved(load):
    fmu = load("Gust", profile="real-time").initialize()
    assert fmu.description.coSimulation.canGetAndSetFMUstate is False
    state, size, content = c_void_p(), c_size_t(), (c_char * 8)()
    for name, arguments in (
        ("GetFMUstate", (byref(state),)),
        ("SetFMUstate", (state,)),
        ("FreeFMUstate", (byref(state),)),
        ("SerializedFMUstateSize", (state, byref(size))),
        ("SerializeFMUstate", (state, content, c_size_t(8))),
        ("DeSerializeFMUstate", (content, c_size_t(8), byref(state))),
    ):
        assert getattr(fmu, name)(*arguments) == ERROR
        assert fmu.said.endswith(f"fmi2{name}: a real-time FMU saves no states: they take memory")
    fmu.free()
    assert fmu.library.fmi2GetFMUstate(None, byref(state)) == ERROR


@pytest.mark.parametrize(
    ("step", "said"),
    [
        (-0.25, "-2.5e-1"),
        (0.0, "0"),
        (math.nan, "nan"),
        (math.inf, "inf"),
        (-math.inf, "-inf"),
        (-9.9999999e-5, "-1e-4"),
        (-123456.4, "-1.23456e5"),
        (-5e-324, "-4.94066e-324"),
        (-1.7e308, "-1.7e308"),
        (-1.00203, "-1.00203"),
    ],
)
def test_numbers_in_messages(load, step, said):
    fmu = load("Gust", profile="real-time").initialize()
    assert fmu.step(step, at=0.0) == ERROR
    assert fmu.said.endswith(f"a communication step must be positive, not {said} s")


def test_other_things_in_messages(load):
    fmu = load(MIXED, profile="real-time")
    fmu.enter()
    assert fmu.GetReal((ctypes.c_uint * 1)(4000), c_size_t(1), (ctypes.c_double * 1)()) == ERROR
    assert "4000" in fmu.said
    assert fmu.SetDebugLogging(1, c_size_t(1), None) == ERROR
    assert fmu.said.endswith("NULL for an array of 1")
    assert fmu.SetDebugLogging(1, c_size_t(1), (ctypes.c_char_p * 1)(b"x" * 300)) == ERROR
    assert fmu.said.endswith("there is no log category " + "x" * 100)
    assert fmu.set("trip_time", 0.25) == OK
    assert fmu.ExitInitializationMode() == OK
    assert fmu.step() == OK
    for name, value in (("trip", -3), ("trip_time", 0.5)):
        assert fmu.set(name, value) == OK
    assert fmu.step() == ERROR
    assert "changed from 1 to -3" in fmu.said


def test_a_message_is_cut_where_its_room_ends(load, write_component):
    name = "y" * 1020
    body = f"""
from railcosim.components import Component, Input, Output

class C(Component):
    \"\"\"Divides.\"\"\"

    u = Input("1", 1.0)
    {name} = Output("1")

    def outputs(self):
        return {{"{name}": 1.0 / self.u}}
"""
    fmu = load(write_component(body), profile="real-time")
    fmu.initialize()
    assert fmu.set("u", 0.0) == OK
    assert fmu.status_of_get(name) == ERROR
    assert fmu.said == f"C: outputs: '{name}"[:1023]


@linux
@pytest.mark.skipif("COVERAGE_NOTES" in os.environ, reason="what counts the lines asks for more")
def test_nothing_is_asked_of_the_c_library_but_mathematics_and_copies(tmp_path):
    """Undefined symbols of the library are all it can call."""
    with zipfile.ZipFile(build(LEARNER, kind="native", profile="real-time")) as archive:
        archive.extractall(tmp_path)
    (library,) = tmp_path.glob("binaries/*/*.so")
    table = subprocess.run(["nm", "-D", "--undefined-only", library], capture_output=True, text=True, check=True).stdout
    found = {line.split()[-1].partition("@")[0] for line in table.splitlines() if " U " in line}
    mathematics = {"exp", "floor", "ceil", "rint", "pow", "log10", "fabs"}
    copies = {"memcpy", "memset", "memmove", "strncpy", "strcmp", "strncmp", "strlen"}
    once = {"calloc", "free"}  # for the instance itself
    assert found - mathematics - copies - once <= {"__stack_chk_fail"}


@linux
def test_a_pool_of_instances_takes_no_memory_at_all(tmp_path, unpack, driver):
    folder = tmp_path / "fmu"
    shutil.copytree(unpack(build(LEARNER, kind="native", profile="real-time")), folder)
    (library,) = folder.glob("binaries/*/*.so")
    library.unlink()
    options = ("-shared", "-fPIC", "-DMAX_INSTANCES=2", "-DTAPE_ROWS=21")
    toolchain.compile_program([folder / "sources" / "all.c"], library, options)
    first, second = driver.Fmu(folder), driver.Fmu(folder)
    assert first.instantiate("third") is None
    assert first.said.endswith("all instances are taken; compile with a larger MAX_INSTANCES")
    first.initialize(sample_time=0.1, tape_duration=2.0)
    done = learn(first)
    first.free()
    again = driver.Fmu(folder)
    assert again.initialize(sample_time=0.1, tape_duration=2.0).get("command") == 0.0
    assert learn(again) == done
    second.free()
    again.free()
