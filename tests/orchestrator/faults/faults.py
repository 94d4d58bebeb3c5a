"""A world in which one call fails: functions of its own in the place of those of `orchestrator/world.py`.

Calls are counted by the process that makes them (0 is that of the command, the others are those of isolated instances
in the order in which they start) and by kind. Time passes by as many seconds a look at the clock as it is told, nothing
waits, and the process of an isolated instance is a fork of this one: a case takes a few hundredths of a second.
"""

import contextlib
import ctypes
import errno
import io
import mmap
import os
import select
import signal
import struct
import sys
import threading
import time
import traceback
from pathlib import Path
from typing import NamedTuple

from railcosim.orchestrator import world
from railcosim.orchestrator.isolation import guard, host

KINDS = ("fmi", "file", "write", "clock", "send", "receive", "start", "load")
PROCESSES = 4
_SIGNALS = ("SIGINT", "SIGTERM", "SIGHUP", "SIGKILL")
_TWICE, _FOR_GOOD = "SIGINT twice", "EIO for good"
_ERRORS = ("ENOSPC", "EIO", "EACCES", "EMFILE")
MANNERS = {
    "fmi": ("status 1", "status 2", "status 3", "status 4", "status 5", "status 42", "nan", "late", "SIGSEGV", "exit"),
    "file": (*_ERRORS, _FOR_GOOD, _TWICE),
    "write": (*_ERRORS, _FOR_GOOD, _TWICE, "full", "short", "torn", "cut off"),
    "clock": ("late",),
    "send": ("EPIPE", "garble", "cut", "lost"),
    "receive": ("ECONNRESET", "garble", "end", "lost", "hang"),
    "start": ("EAGAIN", "ENOMEM"),
    "load": ("ENOENT",),
}
"""How calls of a kind fail. A process may also be sent a signal during any of them."""
FATAL = (_TWICE, "cut off")
"""Those among them that may end the process."""
_FILE = (
    *("read_text", "read_bytes", "mkdir", "unlink", "rmdir", "chmod", "stat", "iterdir", "glob", "rglob", "listdir"),
    *("replace", "fsync", "copyfileobj", "mkdtemp", "map_memory", "open_descriptor", "read"),
)
_COUNT = struct.Struct("=q")
_BEGIN, _LONG = 1000.0, 3600.0
_WAIT = 10.0
"""Wall time in s after which a message that does not come never will."""
_REAL = {name: getattr(world, name) for name in dir(world)}


class Plan(NamedTuple):
    """Which call fails, and how: the process that makes it, its kind, how many of that kind come before."""

    process: int
    kind: str
    index: int
    manner: str


def manners(kind, process):
    """How a call of a kind may fail in a process."""
    return (*MANNERS[kind], *(_SIGNALS if process == 0 else ("SIGKILL",)))


class Counts:
    """How many calls there have been, by process and kind; all processes that are forked later share it."""

    def __init__(self):
        self._memory = mmap.mmap(-1, _COUNT.size * PROCESSES * len(KINDS))

    def add(self, process, kind):
        """One more; how many there were before."""
        place = _COUNT.size * (process * len(KINDS) + KINDS.index(kind))
        (before,) = _COUNT.unpack_from(self._memory, place)
        _COUNT.pack_into(self._memory, place, before + 1)
        return before

    def all(self):
        """By process and kind, where there were any."""
        found = [count for (count,) in _COUNT.iter_unpack(self._memory)]
        places = [(process, kind) for process in range(PROCESSES) for kind in KINDS]
        return {place: count for place, count in zip(places, found, strict=True) if count}


class Faults:
    """The functions that stand in `world` while a case goes.

    Args:
        counts: shared by the processes of the case.
        struck: a file that is told where the fault has struck.
        tick: how far a look at the clock takes it, in s.
        plan: what fails; None for nothing.
    """

    def __init__(self, counts, struck, tick, plan=None):
        self.counts, self.struck, self.tick, self.plan = counts, struck, tick, plan
        self.process, self.started = 0, 0
        self.time, self.is_full = _BEGIN, False
        self.is_dead, self.is_pressed, self.is_hanging = False, False, False
        self.workers = {}

    @contextlib.contextmanager
    def installed(self):
        """Put them there for a while."""
        try:
            self._install()
            yield
        finally:
            for name, real in _REAL.items():
                setattr(world, name, real)

    def _install(self):
        for name in _FILE:
            setattr(world, name, self._file(name))
        for name in ("bound", "lock", "open", "write_text", "write_bytes", "sleep", "rmtree", "start", "fork", "send"):
            setattr(world, name, getattr(self, name))
        for name in ("receive", "send_part", "load_library", "wait", "poll", "kill"):
            setattr(world, name, getattr(self, name))
        world.perf_counter = world.monotonic = self.clock
        world.now = lambda: time.time() + self.clock() - _BEGIN

    def meet(self, kind, what):
        """Count a call; how it fails, or nothing."""
        if self.process is None or threading.current_thread() is not threading.main_thread():
            return ""
        index = self.counts.add(self.process, kind)
        if self.is_dead and kind in ("file", "write"):
            return "EIO"
        if self.is_pressed and kind != "fmi":
            self.is_pressed = False
            os.kill(os.getpid(), signal.SIGINT)
        if self.plan is None or self.plan[:3] != (self.process, kind, index):
            return ""
        ours = [x for x in traceback.extract_stack() if "/orchestrator/" in x.filename and "/tests/" not in x.filename]
        place = f"{Path(ours[-1].filename).name}:{ours[-1].lineno} in {ours[-1].name}" if ours else "nowhere"
        self.struck.write_text(f"{what}\nin process {self.process}, called from {place}: {self.plan.manner}\n")
        if self.plan.manner in (*_SIGNALS, "SIGSEGV"):
            os.kill(os.getpid(), getattr(signal, self.plan.manner))
        if self.plan.manner == _TWICE:
            self.is_pressed = True
            os.kill(os.getpid(), signal.SIGINT)
        if self.plan.manner == _FOR_GOOD:
            self.is_dead = True
            return "EIO"
        if self.plan.manner == "exit":
            os._exit(0)
        if self.plan.manner == "late":
            self.time += _LONG
        return self.plan.manner

    def fail(self, kind, what):
        """The same; what the system would say is raised."""
        manner = self.meet(kind, what)
        if manner in errno.errorcode.values():
            number = getattr(errno, manner)
            raise OSError(number, os.strerror(number))
        return manner

    # ---------------------------------------------------------------- clocks and files

    def clock(self):
        """A clock that goes on when it is looked at."""
        self.meet("clock", "a clock")
        self.time += self.tick
        return self.time

    def sleep(self, seconds):
        """Nobody waits but what runs beside the run."""
        self.time += seconds
        time.sleep(seconds if threading.current_thread() is not threading.main_thread() else 0.001)

    def _file(self, name):
        real = _REAL[name]

        def call(*arguments, **named):
            try:
                self.fail("file", f"{name} {' '.join(map(str, arguments))[:200]}")
            except OSError as error:
                if name not in ("fsync", "map_memory", "copyfileobj", "read"):
                    error.filename = str(arguments[0]) if arguments else None
                raise
            return None if name == "fsync" else real(*arguments, **named)

        return call

    def open(self, path, mode="r", **how):
        """Open a file; what is written to it may fail."""
        try:
            self.fail("file", f"open {path} {mode}")
        except OSError as error:
            error.filename = str(path)
            raise
        if not set(mode) & set("wax+"):
            return _REAL["open"](path, mode, **how)
        raw = _Raw(path, mode.replace("b", ""))
        raw.faults = self
        if how.pop("buffering", None) == 0:
            return raw
        stream = io.BufferedRandom(raw) if "+" in mode else io.BufferedWriter(raw)
        return stream if "b" in mode else io.TextIOWrapper(stream, **how)

    def write_text(self, path, text, **how):
        """Write a file."""
        with self.open(path, "w", **how) as stream:
            return stream.write(text)

    def write_bytes(self, path, content):
        """Write a file."""
        with self.open(path, "wb") as stream:
            return stream.write(content)

    def rmtree(self, path, ignore_errors=False):
        """Remove a folder, or fail to without a word."""
        with contextlib.suppress(OSError):
            self.fail("file", f"rmtree {path}")
            _REAL["rmtree"](path, ignore_errors)

    def lock(self, path):
        """A lock that may not be had."""
        lock = _REAL["lock"](path)
        try:
            self.fail("file", f"lock {path}")
        except OSError as error:
            lock.acquire = self._raising(error)
        return lock

    @staticmethod
    def _raising(error):
        def call(*_, **__):
            raise error

        return call

    # ---------------------------------------------------------------- processes and messages

    def start(self, command, *, stdout, **_):
        """A fork of this process that does what the process of an isolated instance does."""
        self.fail("start", command[-3])
        self.started += 1
        pid = os.fork()
        if not pid:
            self._serve(command[-2:], stdout.fileno())
        process = _Process(pid)
        self.workers[pid] = process
        return process

    def _serve(self, arguments, output):
        sys.settrace(None)
        with contextlib.suppress(BaseException):
            self.process = None  # the guard, of which nothing fails; what it forks does the work
            master = os.getppid()
            os.setsid()
            os.dup2(output, 1)
            os.dup2(output, 2)
            door = int(arguments[1])
            os.closerange(3, door)
            os.closerange(door + 1, 256)
            guard.run(host, str(master), *arguments)
        traceback.print_exc()
        os._exit(1)

    def fork(self):
        """A guard makes the process it watches."""
        pid = _REAL["fork"]()
        if not pid:
            self.process = self.started
        return pid

    def wait(self, process, timeout=None):
        """Wait for the end of a process."""
        return process.wait(timeout)

    def poll(self, process):
        """Whether it has ended."""
        return process.poll()

    def kill(self, process):
        """End it."""
        os.kill(process.pid, signal.SIGKILL)

    def _lose(self, number):
        for pid in self.workers:
            with contextlib.suppress(OSError):
                os.kill(pid, number)

    def send(self, end, frames):
        """Ring, or fail to."""
        self.send_part(end, frames, _REAL["send"])

    def send_part(self, end, frames, send=_REAL["send_part"]):
        """Say a part of what is to be said."""
        manner = self.fail("send", f"send {len(frames)} bytes")
        if manner == "lost":
            self._lose(signal.SIGKILL)
        frames = _garbled(bytes(frames)) if manner == "garble" else frames
        sent = send(end, frames[: len(frames) // 2] if manner == "cut" else frames)
        if manner == "cut":
            end.shutdown(1)
        return sent

    def receive(self, end, size, *flags):
        """Hear, or fail to."""
        if threading.current_thread() is not threading.main_thread():
            return _REAL["receive"](end, size, *flags)
        manner = self.fail("receive", "receive")
        if manner in ("hang", "lost"):
            self._lose(signal.SIGSTOP if manner == "hang" else signal.SIGKILL)
        self.is_hanging = self.is_hanging or manner == "hang"
        if self.is_hanging and self.process == 0:
            raise TimeoutError
        self._await(end)
        found = b"" if manner == "end" else _REAL["receive"](end, size, *flags)
        return _garbled(found) if manner == "garble" else found

    def _await(self, end):
        if self.process == 0 and not select.select([end], [], [], _WAIT)[0]:
            raise TimeoutError

    # ---------------------------------------------------------------- FMUs

    def load_library(self, path):
        """Load a library, or fail to."""
        self.fail("load", f"load {Path(path).name}")
        return _REAL["load_library"](path)

    def bound(self, function):
        """A function of an FMU that may fail, as Python and the kernel call it."""
        name = function.__name__

        def call(*arguments):
            manner = self.meet("fmi", name)
            status = int(manner.removeprefix("status ")) if manner.startswith("status ") else 0
            if status > 1 and function.restype is not None:
                return status if function.restype is ctypes.c_int else None
            found = function(*arguments)
            if manner == "nan" and name.endswith("GetReal") and arguments[2]:
                ctypes.c_double.from_address(arguments[3]).value = float("nan")
            return status if status and function.restype is ctypes.c_int else found

        return ctypes.CFUNCTYPE(function.restype, *function.argtypes)(call)


class _Raw(io.FileIO):
    """A file as the system has it."""

    def write(self, content):
        faults, content = self.faults, memoryview(content).cast("B")
        half = content[: max(1, len(content) // 2)]
        manner = faults.fail("write", f"write {len(content)} bytes to {self.name}")
        faults.is_full = faults.is_full or manner == "full"
        if faults.is_full:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        if manner == "cut off":
            super().write(half)
            os.kill(os.getpid(), signal.SIGKILL)
        faults.is_full = manner == "torn"
        return super().write(half if manner in ("torn", "short") else content)


class _Process:
    """What `subprocess.Popen` is, for a fork."""

    stdin = None

    def __init__(self, pid):
        self.pid, self.returncode = pid, None

    def poll(self):
        if self.returncode is None:
            pid, status = os.waitpid(self.pid, os.WNOHANG)
            self.returncode = os.waitstatus_to_exitcode(status) if pid else None
        return self.returncode

    def send_signal(self, number):
        if self.poll() is None:
            os.kill(self.pid, number)

    def terminate(self):
        self.send_signal(signal.SIGTERM)

    def wait(self, timeout=None):
        until = time.monotonic() + (timeout or _WAIT)
        while self.poll() is None:
            if time.monotonic() > until:
                raise _REAL["subprocess"].TimeoutExpired("a fork", timeout)
            time.sleep(0.001)
        return self.returncode


def _garbled(content):
    """A byte of it is another, past the head of a frame where there is more."""
    place = len(content) - 1 if len(content) > 5 else 0
    return content[:place] + bytes([content[place] ^ 0x5A]) + content[place + 1 :] if content else content
