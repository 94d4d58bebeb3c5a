"""FMI 1.0 in the compiled loop: the same bits as in Python for all types, and steps that fail or are taken in parts."""

import shutil
import sys

import pytest
from railcosim.orchestrator.master import compiled
from railcosim.orchestrator.run.execution import run
from railcosim.orchestrator.system import Event, System

pytestmark = [
    pytest.mark.skipif(compiled.kernel is None, reason="installed without the compiled step loop"),
    pytest.mark.skipif(not sys.platform.startswith("linux"), reason="FMUs by hand are compiled for Linux here"),
    pytest.mark.skipif(shutil.which("gcc") is None, reason="FMUs by hand need gcc"),
]
ALGORITHMS = pytest.mark.parametrize("algorithm", ["gauss-seidel", "jacobi"])
MANY = pytest.mark.parametrize("anywhere", ["here", pytest.param("isolated", marks=pytest.mark.long)], indirect=True)
"""Of many cases those in processes of their own are in the long tier."""


def two_of(model, **how):
    """Two that swing around each other."""
    system = System(**{"stop_time": 6.0, "step": 0.25} | how)
    system.add("a", model, x=2.0)
    system.add("b", model)
    system.connect("a.x", "b.u")
    system.connect("b.x", "a.u", scale=-1.0, offset=2.0)
    return system


@ALGORITHMS
@pytest.mark.parametrize("delay", [0, 2])
def test_every_type(anywhere, first, odd, algorithm, delay):
    """Truth values are a byte each here, of which any bit is true; one goes to an FMU of FMI 2.0 and comes back."""
    system = two_of(first, algorithm=algorithm)
    system.add("odd", odd)
    system.instances["a"].start.update(n=7, gear="high", on=True)
    system.connect("a.m", "b.n", delay=delay)
    system.connect("a.shown", "b.gear")
    system.connect("a.off", "b.on", delay=delay)
    system.connect("b.off", "odd.m")
    system.connect("odd.n", "a.on", threshold=0.5)
    system.events.append(Event("a.n", "set", 3.0, value=-9))
    result = anywhere(system)
    assert [result[name][-1] for name in ("a.m", "b.m", "b.shown")] == [-8.0, -7.0, 3.0]
    assert set(result["a.off"]) == {0.0, 1.0} == set(result["b.off"])


@MANY
@ALGORITHMS
@pytest.mark.parametrize("mode", [1, 3, 4, 5, 6, 7, 9, 23])
def test_steps_that_are_taken_in_parts_or_fail(anywhere, first, algorithm, mode):
    """Also by one that wants to be told that a shorter step repeats a longer one."""
    system = two_of(first, algorithm=algorithm)
    system.instances["a"].start["mode"] = mode
    assert anywhere(system).status == ("completed" if mode in {1, 6, 7} else "failed")


@pytest.mark.parametrize("order", [1, 2])
def test_inputs_that_go_on(anywhere, first, order):
    anywhere(two_of(first, extrapolation=order))


@pytest.mark.parametrize("version", [1, 3])
def test_numbers_that_are_rounded_otherwise_are_those_of_nobody_else(plainly, odd, both, version):
    """It is put back after the very call, and told; whatever version of FMI it is that did it."""
    system = two_of(plainly(version))
    system.add("odd", odd)
    system.connect("a.x", "odd.u", scale=0.1)
    undisturbed = both(system)
    system.instances["a"].start["mode"] = 10
    disturbed = both(system)
    assert [note for note in disturbed.notes if note.startswith("a ") and "rounding" in note]
    assert (disturbed["odd.x"] == undisturbed["odd.x"]).all()


def test_what_is_left_to_python(plainly, used):
    """What is the negative of another variable."""
    assert run(two_of(plainly(1, negated=True))).status == "completed"
    assert not used


@pytest.mark.skipif(not compiled.HAS_THREADS, reason="no threads")
def test_threads_give_the_same_bits(both, used, first, contents):
    system = two_of(first, algorithm="jacobi")
    alone = contents(run(system))
    used.clear()
    assert contents(both(system, threads=2)) == alone
    assert {len(arguments[1]) for arguments in used} == {4}
