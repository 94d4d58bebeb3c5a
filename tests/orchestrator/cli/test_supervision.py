"""No path leads to exit code 0 but a finished command: what ends or crashes its process is told."""

import json
import os
import pty
import signal
import subprocess
import sys
import time
from importlib import import_module

import psutil
import pytest
from railcosim.orchestrator.cli import supervision
from railcosim.orchestrator.fmi.guard import NOTES, notes

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="commands are supervised on Linux")
CODE = """
import ctypes, os, signal, sys, time
from railcosim.orchestrator.cli.supervision import supervised
def command():
    print(os.getpid(), flush=True)
    WORK
    return 7
os._exit(supervised(command))
"""


def start(work):
    code = CODE.replace("WORK", work)
    return subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def end_of(process):
    with process:
        out, err = process.communicate(timeout=60)
    assert not psutil.pid_exists(int(out.splitlines()[0]))
    return process.returncode, err


@pytest.mark.sample(4)
@pytest.mark.parametrize(
    ("work", "code", "said"),
    [
        ("pass", 7, ""),
        ("__import__('atexit').register(os.write, 2, b'temporary folders are removed')", 7, "are removed"),
        ("os._exit(0)", 3, "most likely an FMU, ended the process (exit code 0); --isolate"),
        ("ctypes.CDLL(None).exit(0)", 3, "ended the process (exit code 0)"),
        ("ctypes.CDLL(None)._exit(5)", 3, "ended the process (exit code 5)"),
        ("os.kill(os.getpid(), signal.SIGSEGV)", 3, "most likely an FMU, crashed (SIGSEGV); --isolate"),
        ("ctypes.CDLL(None).abort()", 3, "crashed (SIGABRT)"),
        ("os.kill(os.getpid(), signal.SIGKILL)", -9, "was killed (SIGKILL), most likely by the system"),
        ("os.kill(os.getpid(), signal.SIGTERM)", -15, ""),
        ("raise RuntimeError('a bug')", 1, "RuntimeError: a bug\n"),
        ("os.fork() or (os.close(1), os.close(2), time.sleep(2))", 7, ""),
    ],
)
def test_the_end_of_a_command(work, code, said):
    returned, err = end_of(start(work))
    assert returned == code
    assert said in err
    assert bool(said) == bool(err)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_for_the_parent_is_one_for_the_command(number):
    work = f"signal.signal({int(number)}, lambda *_: os._exit(9)); print('ready', flush=True); time.sleep(60)"
    with start(work) as process:
        child = int(process.stdout.readline())
        process.stdout.readline()
        process.send_signal(number)
        assert process.wait(30) == 3  # what the handler did is no end of a command
        assert not psutil.pid_exists(child)


def test_a_command_does_not_outlive_its_parent():
    with start("time.sleep(60)") as process:
        child = psutil.Process(int(process.stdout.readline()))
        process.kill()
        process.wait(30)
        until = time.monotonic() + 60.0
        while child.is_running() and child.status() != psutil.STATUS_ZOMBIE and time.monotonic() < until:
            time.sleep(0.02)
        assert not child.is_running() or child.status() == psutil.STATUS_ZOMBIE


def test_ctrl_c_in_a_terminal_comes_once():
    """The terminal sends it to both processes: it must not be passed on, because a second one does not wait."""
    work = "n = []; signal.signal(2, lambda *_: n.append(1)); print('ready', flush=True); time.sleep(1); return len(n)"
    child, terminal = pty.fork()
    if child == 0:
        os.execv(sys.executable, [sys.executable, "-c", CODE.replace("WORK", work)])
    seen = b""
    while b"ready" not in seen:
        seen += os.read(terminal, 100)
    os.write(terminal, b"\x03")
    _, status = os.waitpid(child, 0)
    os.close(terminal)
    assert os.waitstatus_to_exitcode(status) == 1


@pytest.fixture
def seen(monkeypatch):
    """As if an FMU's function had been called when the process ended."""
    monkeypatch.setattr(supervision, "NOTES", notes.Notes())
    found = [notes.Seen("train[1]", "Lag", "fmi2DoStep", 3.0)]
    monkeypatch.setattr(supervision.NOTES, "under_way", lambda: found)
    supervision.NOTES.directory = "out"
    told = []
    monkeypatch.setattr(
        import_module("railcosim.orchestrator.run"), "conclude", lambda *arguments: told.append(arguments)
    )
    return told


@pytest.mark.parametrize(
    ("code", "said"), [(0, "ended the process (exit code 0)"), (-signal.SIGSEGV, "crashed (SIGSEGV)")]
)
def test_who_ended_the_process_is_named_and_noted(seen, capsys, code, said):
    assert supervision._untimely(7, code, ()) == 3
    who = "train[1] (Lag) in fmi2DoStep at t = 3 s"
    assert capsys.readouterr().err == f"error: {who} {said}; --isolate keeps that to itself\n"
    ((directory, child, status, why),) = seen
    assert (str(directory), child, status, why) == ("out", 7, "failed", f"{who} {said}")


def test_who_does_not_return_is_named_and_noted(seen, capsys):
    assert supervision._interrupted(7, signal.SIGTERM) == 128 + signal.SIGTERM
    why = "interrupted: train[1] (Lag) in fmi2DoStep at t = 3 s does not return"
    assert capsys.readouterr().err == f"error: {why}; --isolate keeps that to itself\n"
    assert seen[0][2:] == ("interrupted", why)


DEAF = """
import os, signal, time
from railcosim.orchestrator.cli import supervision
supervision._PATIENCE, supervision._TOGETHER = 0.05, 0.0
awaited = {signal.SIGTERM, signal.SIGCHLD}
signal.pthread_sigmask(signal.SIG_BLOCK, awaited)
child = os.fork()
if child == 0:  # where both stay blocked
    for _ in range(2):
        os.kill(os.getppid(), signal.SIGTERM)
        time.sleep(0.02)
    time.sleep(60.0)
    os._exit(0)
status, asked = supervision._outlived(child, awaited)
print(os.waitstatus_to_exitcode(status), int(asked))
"""


def test_a_command_that_hears_nothing_is_ended_after_the_second_signal():
    """In a process of its own: threads of this one would be ended by the signal."""
    done = subprocess.run([sys.executable, "-c", DEAF], capture_output=True, text=True, check=True, timeout=60)
    assert done.stdout.split() == [str(-signal.SIGKILL), str(int(signal.SIGTERM))]


@pytest.mark.parametrize("number", [signal.SIGHUP])
def test_a_signal_that_is_ignored_stays_ignored(number):
    """As nohup and shells have it for what runs in the background."""
    work = "print('ready', flush=True); time.sleep(0.3)"
    code = f"import signal; signal.signal({int(number)}, signal.SIG_IGN)" + CODE.replace("WORK", work)
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True) as process:
        process.stdout.readline()
        process.stdout.readline()
        process.send_signal(number)
        process.send_signal(number)
        assert process.wait(30) == 7


def test_what_a_command_has_decided_on_is_said_by_nobody_else():
    work = "from railcosim.orchestrator.fmi.guard import NOTES; NOTES.decide(130); os._exit(130)"
    assert end_of(start(work)) == (130, "")
    assert NOTES.decided is None


def test_a_command_that_crashes_leaves_a_document_where_one_was_asked_for():
    code = CODE.replace("WORK", "os.kill(os.getpid(), signal.SIGSEGV)").replace(
        "print(os.getpid(), flush=True)", "pass"
    )
    command = [sys.executable, "-c", code, "run", "small.toml", "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    document = json.loads(done.stdout)
    assert (done.returncode, document["exit_code"], document["command"], document["result"]) == (3, 3, "run", None)
    assert "crashed (SIGSEGV)" in document["error"]["message"]
