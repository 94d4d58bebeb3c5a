"""Instances that share a process: the same numbers as ever, answers find whom they are for, and who is to blame."""

import ctypes
import os
import re
import shutil
import socket
import sys
import time
from pathlib import Path

import pytest
from railcosim.orchestrator import System, run
from railcosim.orchestrator.errors import FmuError, LostError
from railcosim.orchestrator.fmi.models import load_fmu
from railcosim.orchestrator.isolation import process as host_process
from railcosim.orchestrator.isolation.choice import house, isolate
from railcosim.orchestrator.system import Event

pytestmark = [
    pytest.mark.skipif(not sys.platform.startswith("linux"), reason="FMUs by hand are compiled for Linux here"),
    pytest.mark.skipif(shutil.which("gcc") is None, reason="FMUs by hand need gcc"),
    pytest.mark.usefixtures("in_time", "nothing_left"),
]
TOGETHER = ["together"]


def ring(path, mute, **how):
    """Three instances that hand on values of every type, but texts where they are mute."""
    system = System(**{"stop_time": 5.0, "step": 0.25} | how)
    for name in "abc":
        system.add(name, path)
    for source, target in ("ab", "bc", "ca"):
        system.connect(f"{source}.x", f"{target}.u", scale=-0.7, offset=0.5)
        if target != "a":
            wires = [("y", "v"), ("n", "m"), ("off", "on"), ("said", "word")]
            for out, into in wires[: 3 if mute else 4]:
                system.connect(f"{source}.{out}", f"{target}.{into}")
    if not mute:
        system.instances["a"].start["word"] = "ab"
    return system


def contents(result):
    """What was recorded, to the bit; not in which process."""
    columns = {name: result[name] for name in result.names() if not name.endswith(".pid")}
    return {name: list(x) if x.dtype == object else x.tobytes() for name, x in columns.items()}


@pytest.fixture
def shared(hostile, workspace, begin):
    """Instances of hostile.c in one process, initialized but for ``begun=False``; given back at the end."""
    made = []

    def make(*names, deeds=None, begun=True, **how):
        model = load_fmu(Path(hostile()), workspace)
        found = house([(name, model.interface, model.folder) for name in names], **how)
        made.extend(found)
        for one in found:
            if deed := (deeds or {}).get(one.name):
                one.channel("String", ["deed"]).set([deed])
            if begun:
                begin(one)
        return found

    yield make
    for one in made:
        one.free()


# -------------------------------------------------------------------- the same numbers


@pytest.mark.parametrize(
    ("algorithm", "mute"),
    [
        ("gauss-seidel", True),
        ("jacobi", True),
        ("jacobi", False),
        *(pytest.param(x, False, marks=pytest.mark.long) for x in ("gauss-seidel", "iterative", "adaptive")),
    ],
)
def test_one_process_gives_the_bits_of_none(hostile, algorithm, mute):
    """By calls through the lane, and by messages where texts are exchanged."""
    how = {"algorithm": algorithm, "tolerances": {f"{x}.calls": [0.0, 1e9] for x in "abc"}, "tolerance": 1e-2}
    system = ring(hostile(mute=mute), mute, **how)
    system.events.append(Event("a.u", "bias", at=2.0, value=0.125, duration=1.0))
    whole, apart = run(system), run(isolate(system, TOGETHER))
    assert contents(apart) == contents(whole)
    (pid,) = {int(apart[f"{name}.pid"][-1]) for name in "abc"}
    assert pid != os.getpid()


def test_what_is_asked_of_one_is_not_answered_by_another(shared):
    """Also where steps are not waited for, and where more is said than a socket holds."""
    a, b, c = shared("a", "b", "c")
    inputs, outputs = ([one.channel("Real", [name]) for one in (a, b, c)] for name in ("u", "x"))
    texts = [one.channel("String", ["word"] * 2000) for one in (a, b, c)]
    found = []
    for k in range(6):
        for n, (u, words) in enumerate(zip(inputs, texts, strict=True)):
            u.set([n + 1.0])
            if k == 3:
                words.set([f"{n}" * 190] * 2000)
        for one in (c, a, b):
            one.step(0.5 * k, 0.5)
        found.append([x.get()[0] for x in (outputs if k % 2 else reversed(outputs))])
        if k == 3:
            assert [words.get() for words in texts] == [[f"{n}" * 190] * 2000 for n in range(3)]
    steps = [[0.5 * (k + 1) * n for n in (1.0, 2.0, 3.0)] for k in range(6)]
    assert found == [row if k % 2 else row[::-1] for k, row in enumerate(steps)]
    assert len({one.pid for one in (a, b, c)}) == 1


@pytest.mark.parametrize(("limit", "most"), [("_MOST_UNREAD", 10), ("_MOST_EXPECTED", 1)])
def test_answers_are_read_before_more_is_said_than_a_socket_holds(shared, monkeypatch, limit, most):
    monkeypatch.setattr(host_process, limit, most)
    a, b = shared("a", "b")
    for k in range(3):
        for one in (a, b):
            one.step(0.5 * k, 0.5)
            assert one.channel("Real", ["calls"]).get() == [k + 1.0]
    for one in (a, b):
        one.step(1.5, 0.5)
    assert len(a._process._expecting) == 1, "what a has answered was read before b was asked"
    assert [one.channel("Real", ["calls"]).get() for one in (a, b)] == [[4.0], [4.0]]


def test_a_socket_holds_what_is_not_read():
    """Of whatever length: what goes there, and what comes back while nobody reads it."""
    one, other = socket.socketpair()
    with one, other:
        for end in (one, other):
            end.setblocking(False)
            for _ in range(host_process._MOST_EXPECTED):
                end.send(bytes(max(1, host_process._MOST_UNREAD // host_process._MOST_EXPECTED)))


def test_one_is_given_back_and_the_other_goes_on(shared):
    a, b = shared("a", "b")
    a.terminate()
    a.free()
    assert Path(f"/proc/{b.pid}").exists()
    b.step(0.0, 0.5)
    assert b.channel("Real", ["calls"]).get() == [1.0]
    b.free()
    assert not Path(f"/proc/{b.pid}").exists()


def test_one_that_is_never_asked_for_anything(shared):
    a, b = shared("a", "b", begun=False)
    a.setup(0.0, 1.0)
    b.free()
    a.enter_initialization()


def test_who_lives_together(hostile, tmp_path):
    """Instances of one file, with the same limits, that are not to be alone in their process."""
    first, second = hostile(mute=True), hostile("nothing", mute=True, name="other.fmu")
    once = hostile("instantiate once", simulation="canBeInstantiatedOnlyOncePerProcess", mute=True, name="once.fmu")
    system = System(stop_time=0.5, step=0.25)
    for name, path in zip("abcdefgh", [first, first, second, second, first, first, once, once], strict=True):
        system.add(name, path)
    system.instances["e"].isolate = True
    system.instances["f"].isolate, system.instances["f"].step_timeout = "together", 30.0
    result = run(isolate(system, TOGETHER))
    pids = {name: int(result[f"{name}.pid"][-1]) for name in "abcdefgh"}
    assert pids["a"] == pids["b"]
    assert pids["c"] == pids["d"]
    assert len({*pids.values()} | {os.getpid()}) == 7
    assert [x.isolate for x in isolate(system, ["a", "together"]).instances.values()][:2] == [True, "together"]


# -------------------------------------------------------------------- who is to blame


BATCH = "; it was the process of a, c as well"
ENDS = {
    "step null 1": r"b, t = 1 s: its process crashed in fmi2DoStep \(SIGSEGV\)",
    "get abort 1": r"b, t = 1 s: its process crashed in fmi2GetReal \(SIGABRT\)",
    "set exit 1": r"b, t = 1 s: its process ended in fmi2SetReal \(exit code 7\)",
    "step hang 1": r"b, t = 1 s: did not return from fmi2DoStep within 1 s; its process was ended; set step_timeout .*",
    "terminate null": r"b, t = 2 s: its process crashed in fmi2Terminate \(SIGSEGV\)",
}


@pytest.mark.sample(6)
@pytest.mark.parametrize("algorithm", ["gauss-seidel", "jacobi"])
@pytest.mark.parametrize("mute", [True, False])
@pytest.mark.parametrize("deed", ENDS)
def test_whoever_was_called_is_named(hostile, deed, mute, algorithm):
    """Whoever waits for an answer then; and the rows until then are kept, as without isolation."""
    system = ring(hostile(mute=mute), mute, algorithm=algorithm, stop_time=2.0, step=0.5)
    whole = run(system)
    system = isolate(system, TOGETHER)
    for instance in system.instances.values():
        instance.step_timeout = 1.0
    system.instances["b"].start["deed"] = deed
    with pytest.raises(LostError) as caught:
        run(system)
    error = caught.value
    assert error.instance == "b"
    assert re.fullmatch(ENDS[deed] + re.escape(BATCH), str(error))
    kept = error.run["c.x"]
    assert len(kept) >= 2
    assert kept.tobytes() == whole["c.x"][: len(kept)].tobytes()


def test_a_crash_is_at_the_begin_of_a_step_of_its_own(shared):
    """In the lane, where it is seen when others have gone on, and the master with them."""
    a, b = shared("a", "b", deeds={"b": "step null 5"})
    rides = [one.ride() for one in (a, b)]
    calls = [ride.add_step(final=True) for ride in rides]
    for ride in rides:
        ride.board()
    for ride in rides:
        ride.begin()
    for (function, rider), length in zip(calls, (0.25, 1.0), strict=True):
        _function(function, ctypes.c_double, ctypes.c_double, ctypes.c_int)(rider, 5.0, length, 1)
    b.time = 5.25
    with pytest.raises(LostError, match=r"^b, t = 5 s: its process crashed in fmi2DoStep"):
        a.await_lane()


@pytest.mark.parametrize("at_once", [True, False])
def test_a_crash_is_where_it_has_come_back_to(shared, at_once):
    """As it is set after a step, from whose begin a state was restored."""
    (it,) = shared("it", deeds={"it": "set null 5"})
    ride, u = it.ride(), it.channel("Real", ["u"])
    step, (put, rider), (save, restore, _, state) = (
        ride.add_step(final=False),
        ride.add(u.parts[0][0], is_get=False),
        ride.add_state(0, at_once=at_once),
    )
    ride.add(it.channel("Real", ["x"]).parts[0][0], is_get=True)
    ride.board()
    ride.begin()
    pointer, handle, value = ctypes.c_void_p, ctypes.c_void_p(), ctypes.c_double(1.0)
    assert not _function(step[0], ctypes.c_double, ctypes.c_double, ctypes.c_int)(step[1], 4.5, 0.5, 0)
    assert not _function(save, pointer)(state, ctypes.byref(handle))
    assert not _function(step[0], ctypes.c_double, ctypes.c_double, ctypes.c_int)(step[1], 5.0, 0.25, 0)
    assert not _function(restore, pointer)(state, handle)
    assert not _function(put, pointer, ctypes.c_size_t, pointer)(rider, None, 1, ctypes.byref(value))
    with pytest.raises(LostError, match=r"^it, t = 5 s: its process crashed in fmi2SetReal"):
        it.await_lane()


def _function(address, *arguments):
    return ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, *arguments)(address)


@pytest.mark.parametrize("what", ["discard", "error"])
def test_a_failure_of_one_is_that_of_no_other(hostile, what):
    """Two fail in the same step: the first is named; all was stepped in one go."""
    system = System(stop_time=2.0, step=0.5, algorithm="jacobi")
    for name in "abc":
        system.add(name, hostile(mute=True), deed="" if name == "a" else f"step {what} 1")
    errors = []
    for how in ([], TOGETHER):
        with pytest.raises(FmuError) as caught:
            run(isolate(system, how))
        errors.append((str(caught.value), caught.value.instance, caught.value.run["a.calls"].tobytes()))
    assert errors[0] == errors[1]
    assert errors[0][1] == "b"


def test_each_may_take_its_time(hostile):
    """The limit is for a call, not for all that follow each other in one process."""
    system = System(stop_time=0.5, step=0.5, algorithm="jacobi")
    for name in "abcd":
        system.add(name, hostile(mute=True), deed="step slow 0").step_timeout = 0.8
    begin = time.perf_counter()
    assert run(isolate(system, TOGETHER)).status == "completed"
    assert time.perf_counter() - begin > 1.1


def test_a_crash_where_one_is_given_back_is_told_once(shared, caplog):
    a, b = shared("a", "b", deeds={"a": "free null"})
    a.free()
    (record,) = caplog.records
    told = "its process crashed in fmi2FreeInstance (SIGSEGV); it was the process of b as well"
    assert record.getMessage() == f"a: {told}"
    with pytest.raises(LostError, match=re.escape(f"a, t = 0 s: {told}")):
        b.step(0.0, 0.5)
    b.free()
    assert len(caplog.records) == 1


def test_a_crash_between_two_calls_is_that_of_whoever_was_asked(shared):
    a, b = shared("a", "b")
    os.kill(a.pid, 11)
    for _ in range(2):
        with pytest.raises(LostError, match=r"^b, t = 0 s: its process crashed between two calls \(SIGSEGV\); it was "):
            b.terminate()
    with pytest.raises(LostError, match=r"^b, t = 0 s"):
        a.terminate()


def test_one_that_crashes_as_it_is_made_is_named(hostile, workspace, begin):
    model = load_fmu(Path(hostile("instantiate null")), workspace)
    made = house([(name, model.interface, model.folder) for name in "abcdefg"])
    told = "a: its process crashed in fmi2Instantiate (SIGSEGV); it was the process of b, c, d, e, 2 more as well"
    with pytest.raises(LostError, match=re.escape(told)):
        begin(made[1])
    for one in made:
        one.free()
