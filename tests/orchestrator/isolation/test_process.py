"""Whatever an FMU does in a process of its own is an error, not our end; and no process is left behind."""

import errno
import os
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
from railcosim.orchestrator import world
from railcosim.orchestrator.errors import FmuError, StoppedError
from railcosim.orchestrator.fmi.interface import Interface
from railcosim.orchestrator.fmi.models import load_fmu
from railcosim.orchestrator.isolation import launch
from railcosim.orchestrator.isolation import messages as doorbell
from railcosim.orchestrator.isolation import process as host_process

pytestmark = [
    pytest.mark.skipif(not sys.platform.startswith("linux"), reason="FMUs by hand are compiled for Linux here"),
    pytest.mark.usefixtures("in_time", "nothing_left"),
]


# -------------------------------------------------------------------- failures


CALLED = ("step", "get", "set", "enter", "exit", "terminate")


@pytest.mark.sample(5)
@pytest.mark.parametrize(
    ("where", "status"),
    [
        *((where, "error") for where in CALLED),
        ("step", "discard"),
        ("step", "fatal"),
        *(
            pytest.param(where, status, marks=pytest.mark.long)
            for where in CALLED[1:]
            for status in ("discard", "fatal")
        ),
    ],
)
def test_a_bad_status_is_the_error_it_is_without_isolation(apart, alone, hostile, live, *, where, status):
    told = []
    for one in (alone(hostile()), apart()):
        one.channel("String", ["deed"]).set([f"{where} {status} {1.0 if where in ('step', 'get', 'set') else 0.0}"])
        error = live(one)
        told.append((type(error), str(error), error.instance, error.time, error.status, error.log))
    assert told[0] == told[1]
    assert told[0][4] == status


def test_the_wish_to_end_is_handed_on(apart, foreign, xml):
    path = foreign([xml["variable"]("y", "output")], "    def step(self, t, h, v):\n        return t < 1.0\n")
    it = apart(path=path, begun=True)
    it.step(0.0, 1.0)
    with pytest.raises(StoppedError, match="it, t = 1 s: asks for the end of the simulation"):
        it.step(1.0, 1.0)


ENDS = {
    "null": r"its process crashed in {} \(SIGSEGV\)",
    "abort": r"its process crashed in {} \(SIGABRT\)",
    "exit": r"its process ended in {} \(exit code 7\)",
    "kill": r"its process was killed in {} \(SIGKILL\), most likely by the system, for lack of memory",
    "hang": r"did not return from {} within 1 s; its process was ended; set step_timeout to allow more wall time",
}
CALLS = {
    "enter": ("EnterInitializationMode", 0.0),
    "exit": ("ExitInitializationMode", 0.0),
    "set": ("SetReal", 1.0),
    "step": ("DoStep", 1.0),
    "get": ("GetReal", 1.0),
    "save": ("GetFMUstate", 1.0),
    "terminate": ("Terminate", 2.0),
}


@pytest.mark.sample(7)
@pytest.mark.parametrize(
    ("where", "what"),
    [*((where, "null") for where in CALLS), *(("step", what) for what in ENDS), ("terminate", "hang")],
)
def test_a_process_that_is_lost(apart, where, what, live):
    call, when = CALLS[where]
    it = apart(f"{where} {what} {when}", "odd[1]", step_timeout=1.0)
    error = live(it)
    assert (error.instance, error.time, error.status) == ("odd[1]", when, "")
    assert re.fullmatch(rf"odd\[1\], t = {when:g} s: {ENDS[what].format(f'fmi2{call}')}", str(error))
    u, y = it.channel("Real", ["u"]), it.channel("Real", ["y"])
    for after in (lambda: u.set([1.0]), y.get, lambda: it.step(0.0, 1.0), it.save, it.terminate):
        with pytest.raises(FmuError) as again:
            after()
        assert str(again.value) == str(error), "after its end nothing is called any more"
    it.forget(None)


@pytest.mark.sample(4)
@pytest.mark.parametrize("what", ["abort", "exit", "hang"])
@pytest.mark.parametrize("where", ["instantiate", "setup"])
def test_a_process_that_is_lost_before_it_can_be_told_anything(apart, hostile, where, what):
    it = apart(path=hostile(f"{where} {what}"), step_timeout=1.0)
    it.channel("Real", ["u"]).set([1.0])
    call, at = {"instantiate": ("Instantiate", ""), "setup": ("SetupExperiment", ", t = 0 s")}[where]
    with pytest.raises(FmuError, match=rf"^it{at}: {ENDS[what].format(f'fmi2{call}')}$"):
        it.setup(0.0, 1.0)


def test_an_instance_that_is_refused(apart, hostile):
    it = apart(path=hostile("instantiate error"))
    with pytest.raises(FmuError, match=r"^it: cannot be instantiated: it gives no instance\n    \[error\] it: error$"):
        it.setup(0.0, 1.0)
    with pytest.raises(FmuError, match="cannot be instantiated"):
        it.enter_initialization()


def test_a_library_that_does_not_load(apart, workspace, hostile):
    path = hostile()
    next(load_fmu(Path(path), workspace).folder.glob("binaries/*/*")).write_bytes(b"not a library")
    with pytest.raises(FmuError, match="cannot be instantiated: Failed to load shared library"):
        apart(path=path, begun=True)


@pytest.mark.sample(3)
@pytest.mark.parametrize("what", ENDS)
def test_a_process_that_is_lost_when_it_is_freed(apart, caplog, what):
    it = apart(f"free {what}", step_timeout=1.0, begun=True)
    it.terminate()
    it.free()
    it.free()
    (record,) = caplog.records
    assert record.levelname == "WARNING"
    assert "fmi2FreeInstance" in record.getMessage()


def test_a_crash_tells_what_the_fmu_said_last(apart, begin):
    it = apart("step cry 1")
    begin(it)
    it.step(0.0, 1.0)
    with pytest.raises(FmuError) as caught:
        it.step(1.0, 1.0)
    assert caught.value.log == ["[warning] it: beware", "printed at 1 s"]
    assert str(caught.value).endswith("(SIGSEGV)\n    [warning] it: beware\n    printed at 1 s")


def test_slow_is_not_hanging(apart):
    it = apart("step slow 0.5", step_timeout=5.0, begun=True)
    x = it.channel("Real", ["calls"])
    for k in range(4):
        it.step(0.5 * k, 0.5)
        assert x.get() == [k + 1.0]


def test_a_leak_ends_at_the_limit(apart, live):
    error = live(apart("step leak", memory_limit=100.0), 20)
    assert error.status == "error"
    assert error.log == ["[error] it: no memory is left"]
    assert re.search(
        "fmi2DoStep failed; it had [0-9]+ of the 100 MiB that memory_limit allows: a likely reason", str(error)
    )


def test_a_crash_for_lack_of_memory(apart, live):
    error = live(apart("step gulp", memory_limit=100.0), 20, pause=0.1)
    assert re.search(r"crashed in fmi2DoStep \(SIGSEGV\); it had \d+ of the 100 MiB that memory_limit", str(error))


def test_a_crash_under_a_limit(apart, live):
    error = live(apart("step null", memory_limit=100.0))
    assert str(error) == "it, t = 0 s: its process crashed in fmi2DoStep (SIGSEGV); its memory_limit was 100 MiB"


def test_a_limit_that_leaves_enough(apart):
    it = apart("step leak", memory_limit=100.0, begun=True)
    for k in range(3):
        it.step(0.5 * k, 0.5)
    it.terminate()


def test_a_process_that_does_not_start(apart, monkeypatch):
    monkeypatch.setattr(launch, "_BOOT", "raise SystemExit('no way')")
    with pytest.raises(FmuError, match=r"^it: its process could not be started \(exit code 1\)\n    no way$"):
        apart(begun=True)


def test_no_process_at_all(apart, monkeypatch):
    monkeypatch.setattr(sys, "executable", "/no/python")
    with pytest.raises(
        FmuError, match=r"^it: its process cannot be started: .*No such file or directory: '/no/python'$"
    ):
        apart()


def test_a_full_disk_is_an_error_before_anything_is_started(apart, workspace, monkeypatch):
    """It must not be found out by writing into shared memory: that ends a process."""
    write = world.write_bytes

    def fill(path, content):
        if path.name == "memory":
            raise OSError(errno.ENOSPC, "No space left on device")
        return write(path, content)

    monkeypatch.setattr(world, "write_bytes", fill)
    monkeypatch.setattr(world, "start", None)
    with pytest.raises(FmuError, match=r"^it: its process cannot be started: .*No space left on device: '.*host_\w+'$"):
        apart()
    assert not list(workspace.folder.glob("host_*"))


def test_a_process_that_is_lost_between_two_calls(apart):
    """And whose memory and files cannot be trusted."""
    it = apart(begun=True)
    shutil.rmtree(it._process._folder)
    it._process.memory[:16] = b"\xff" * 16
    os.kill(it.pid, signal.SIGSEGV)
    with pytest.raises(FmuError, match=r"^it, t = 0 s: its process crashed between two calls \(SIGSEGV\)$"):
        it.terminate()


def test_a_process_that_does_not_listen(apart):
    it = apart(step_timeout=0.5, begun=True)
    os.kill(it.pid, signal.SIGSTOP)
    with pytest.raises(FmuError, match=r"did not return from what it was asked for within 0\.5 s"):
        it.terminate()


@pytest.mark.parametrize("inherits", [True, False])
def test_a_process_that_takes_too_long_to_start(apart, monkeypatch, inherits):
    monkeypatch.setattr(launch, "INHERITS", inherits)
    monkeypatch.setattr(host_process, "PATIENCE", 0.5)
    monkeypatch.setattr(launch, "_BOOT", "import time; time.sleep(60)")
    with pytest.raises(FmuError, match=r"^it: its process did not start within 0.5 s$"):
        apart(step_timeout=0.5, begun=True)


def test_what_cannot_be_read_is_no_answer(apart, monkeypatch):
    it = apart(begun=True)
    monkeypatch.setattr(doorbell, "content", lambda body: int("garbage"))
    with pytest.raises(FmuError, match="its process sends what cannot be read"):
        it.save()
    assert not Path(f"/proc/{it.pid}").exists()


@pytest.mark.parametrize("told", [b"{", b"[1]", b'[0, "seven"]', b"7"])
def test_what_cannot_be_read_is_no_sign_of_life(apart, monkeypatch, told):
    read = doorbell.content
    monkeypatch.setattr(doorbell, "content", lambda body: read(told))
    with pytest.raises(FmuError, match="its process sends what cannot be read"):
        apart(begun=True)


@pytest.mark.parametrize(
    ("where", "call"), [("instantiate", "Instantiate"), ("step", "DoStep"), ("free", "FreeInstance")]
)
def test_once_the_run_is_to_stop_a_call_is_not_waited_for_long(
    apart, hostile, live, monkeypatch, caplog, *, where, call
):
    """The run is interrupted then; not so by an instance that is given back."""
    monkeypatch.setattr(host_process, "LAST_PATIENCE", 0.5)
    stopped = threading.Event()
    it = apart(path=hostile(f"{where} hang"), stopped=stopped.is_set)

    def stop():
        while it._process.last_call()[0] != where:
            time.sleep(0.01)
        stopped.set()

    threading.Thread(target=stop).start()
    if where == "free":
        assert live(it) is None
        it.free()
    else:
        with pytest.raises(KeyboardInterrupt):
            live(it)
    assert not Path(f"/proc/{it.pid}").exists()
    assert (
        f"did not return from fmi2{call} within 0.5 s after the run was to stop; its process was ended" in caplog.text
    )


def test_a_second_interruption_does_not_wait(apart):
    it = apart("step hang 1", begun=True)
    it.step(0.0, 1.0)

    def interrupt(*_):
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGUSR1, interrupt)
    helper = subprocess.Popen([sys.executable, "-c", f"import os, time; time.sleep(0.3); os.kill({os.getpid()}, 10)"])
    try:
        with pytest.raises(KeyboardInterrupt):
            it.step(1.0, 1.0)
    finally:
        helper.wait()
        signal.signal(signal.SIGUSR1, before)
    assert not Path(f"/proc/{it.pid}").exists()
    with pytest.raises(FmuError, match="was interrupted"):
        it.terminate()


def test_an_instance_that_was_never_used(apart):
    it = apart()
    pid = it.pid
    it.free()
    assert not Path(f"/proc/{pid}").exists()


def test_the_names_of_calls_are_the_standards():
    from railcosim.orchestrator.fmi.binding.versions import SLAVES, call_name

    for version, slave in SLAVES.items():
        interface = Interface("m", "m", "g", {}, {}, {}, version=version)
        for call in doorbell.CALLS[1:]:
            kind = next(iter(slave.TYPES))
            name = call_name(interface, call, kind, ())
            assert name in slave.SIGNATURES or name == call
