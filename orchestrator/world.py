"""The seam to the world: through these names alone the orchestrator meets clocks, files, processes, messages and FMUs.

Each is the very function it is named after, looked up when it is called (``world.sleep(1.0)``, never ``from world
import sleep``): that costs nothing, and a test that puts another in its place has it everywhere. What asks and changes
nothing (``Path.is_file``, ``os.getpid``) is asked directly, and so is memory.
"""

from __future__ import annotations

import ctypes
import mmap
import os
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from filelock import FileLock

# Clocks, in s.
now, perf_counter, monotonic, sleep = time.time, time.perf_counter, time.monotonic, time.sleep

# Files, by their paths; what is opened is read, written and flushed by its own methods.
open = Path.open
read_text, read_bytes, write_text, write_bytes = Path.read_text, Path.read_bytes, Path.write_text, Path.write_bytes
mkdir, unlink, rmdir, chmod = Path.mkdir, Path.unlink, Path.rmdir, Path.chmod
stat, iterdir, glob, rglob, listdir = Path.stat, Path.iterdir, Path.glob, Path.rglob, os.listdir
replace, fsync = os.replace, os.fsync
rmtree, copyfileobj, mkdtemp, TemporaryDirectory = (
    shutil.rmtree,
    shutil.copyfileobj,
    tempfile.mkdtemp,
    tempfile.TemporaryDirectory,
)
map_memory = mmap.mmap
# Files, by their descriptors.
open_descriptor, read, write, close = os.open, os.read, os.write, os.close

# Processes.
start, wait, poll, kill = subprocess.Popen, subprocess.Popen.wait, subprocess.Popen.poll, subprocess.Popen.kill
pipe, exit_at_once = os.pipe, os._exit
if sys.platform != "win32":
    fork, wait_for, signal_to, kill_group = os.fork, os.waitpid, os.kill, os.killpg

# Messages.
send, send_part, receive = socket.socket.sendall, socket.socket.send, socket.socket.recv
create_server, create_connection, socketpair = socket.create_server, socket.create_connection, socket.socketpair

# FMUs.
load_library = ctypes.cdll.LoadLibrary


def bound(function: Any) -> Any:
    """A function of an FMU's library as it is called from now on, from Python and by its address."""
    return function


def lock(path: Path) -> FileLock:
    """A lock that processes hold and lose with their lives."""
    from filelock import FileLock  # noqa: PLC0415 (0.03 s, which the process of an isolated instance need not wait)

    return FileLock(path)
