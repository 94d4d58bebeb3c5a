"""No path leads to exit code 0 but a finished command: what ends or crashes its process is told."""

import os
import pty
import signal
import subprocess
import sys
import time

import psutil
import pytest

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
        until = time.monotonic() + 10.0
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
