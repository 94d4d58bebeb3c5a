"""Memory that runs out: each request of the C runtime is refused in turn and told, and nothing is lost."""

import ctypes
import shutil
import subprocess
import sys
from ctypes import byref, c_void_p
from pathlib import Path

import fmpy
import pytest
from railcosim.fmus import toolchain
from railcosim.fmus.build import build

SCARCE = Path(__file__).parents[2] / "scarce.h"
HEADERS = Path(fmpy.__file__).parent / "c-code"
LEARNER = f"{Path(__file__).parents[2] / 'components' / 'samples.py'}:Learner"
OK = 0
ERROR = 3
pytestmark = [
    pytest.mark.skipif(not sys.platform.startswith("linux"), reason="compiles a Linux library"),
    pytest.mark.skipif(toolchain.system_compiler() is None, reason="needs a C compiler"),
]


@pytest.fixture(scope="module")
def scarce(tmp_path_factory, unpack):
    """The unpacked FMU of the learner, compiled so that it can be refused memory, and how often it is granted."""
    folder = tmp_path_factory.mktemp("scarce") / "fmu"
    shutil.copytree(unpack(build(LEARNER, kind="native")), folder)
    (library,) = folder.glob("binaries/*/*.so")
    library.unlink()
    command = [toolchain.system_compiler(), "-std=c11", "-O1", "-shared", "-fPIC", "-include", SCARCE, "-I", HEADERS]
    subprocess.run([*command, folder / "sources" / "all.c", "-o", library, "-lm"], check=True)
    return folder, ctypes.c_int.in_dll(ctypes.CDLL(str(library)), "scarce_left")


@pytest.fixture
def learner(scarce, driver):
    """Makes the instance, and the number."""
    folder, left = scarce
    left.value = -1
    made = driver.Fmu(folder)
    yield made, left
    left.value = -1
    made.free()


def test_an_instance_that_finds_no_room(learner):
    fmu, left = learner
    left.value = 0
    assert fmu.instantiate() is None
    assert fmu.said.endswith("out of memory")
    other = fmu.instantiate()
    assert other is not None
    fmu.library.fmi2FreeInstance(c_void_p(other))


def test_a_tape_that_finds_no_room(learner):
    fmu, left = learner
    fmu.enter()
    fmu.set("sample_time", 0.1)
    fmu.set("tape_duration", 1.0)
    left.value = 0
    assert fmu.ExitInitializationMode() == ERROR
    assert "out of memory for a tape of 11 samples" in fmu.said
    assert fmu.Reset() == OK
    fmu.initialize(sample_time=0.1, tape_duration=1.0)
    assert fmu.step(0.1) == OK


def test_a_state_that_finds_no_room(learner):
    """Whether it is to be saved or read from bytes; the instance goes on."""
    fmu, left = learner
    fmu.initialize(sample_time=0.1, tape_duration=1.0)
    state = fmu.save()
    content = fmu.to_bytes(state)
    nothing = c_void_p()
    for ask in (lambda: fmu.GetFMUstate(byref(nothing)), lambda: fmu.from_bytes(content)):
        left.value = 0
        assert ask() == ERROR
        assert fmu.said.endswith("out of memory for a saved state")
    assert nothing.value is None
    assert fmu.step(0.1) == OK
    fmu.FreeFMUstate(byref(state))


def test_half_a_restored_state_writes_no_tape(learner, tmp_path):
    """One whose tape is of another length and finds no room: the file of before stays as it is."""
    fmu, left = learner
    path = tmp_path / "tape"
    fmu.initialize(sample_time=0.1, tape_duration=1.0, tape_file=str(path))
    assert fmu.Terminate() == OK
    before = path.read_bytes()
    state = fmu.save()
    fmu.Reset()
    fmu.initialize(sample_time=0.1, tape_duration=2.0, tape_file=str(tmp_path / "other"))
    left.value = 0
    assert fmu.SetFMUstate(state) == ERROR
    assert "out of memory for a tape of 11 samples" in fmu.said
    assert fmu.Terminate() == ERROR
    assert path.read_bytes() == before
    assert fmu.SetFMUstate(state) == OK
    fmu.FreeFMUstate(byref(state))
