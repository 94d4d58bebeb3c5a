"""What an FMU does to its streams, its process and other processes: its own files are whole, and nobody stays."""

import contextlib
import os
import re
import subprocess
import sys
import time
from pathlib import Path

import pytest
from railcosim.orchestrator.errors import FmuError

pytestmark = [
    pytest.mark.skipif(not sys.platform.startswith("linux"), reason="FMUs by hand are compiled for Linux here"),
    pytest.mark.usefixtures("in_time", "nothing_left"),
]


@pytest.fixture
def log(tmp_path, monkeypatch):
    """Where an FMU keeps a log of its own; by this path in their environment its processes are found."""
    path = tmp_path / "own.log"
    monkeypatch.setenv("DEEDS", str(path))
    return path


def left(log):
    """Processes that an FMU has started, and those of ours, the dead ones aside."""
    found = []
    for place in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            is_of_it = f"DEEDS={log}\0".encode() in (place / "environ").read_bytes() and int(place.name) != os.getpid()
            if is_of_it and (place / "stat").read_text().rpartition(")")[2].split()[0] != "Z":
                found.append(place.name)
    return found


def live(it, *deeds):
    """Do a deed in each step, and look whether it goes on; the error that ends it, if one does."""
    deed, u, x = it.channel("String", ["deed"]), it.channel("Real", ["u"]), it.channel("Real", ["x"])
    u.set([1.0])
    try:
        for k, what in enumerate(deeds):
            deed.set([f"step {what}"])
            it.step(0.5 * k, 0.5)
            assert x.get() == [0.5 * (k + 1)], what
        deed.set([""])
        it.terminate()
    except FmuError as error:
        return error
    return None


# -------------------------------------------------------------------- what it may do


@pytest.mark.sample(3)
@pytest.mark.parametrize(
    ("how", "content"),
    [
        (("reopen",), "".join(f"line {k} of a log of its own that is not to be touched\n" for k in range(100_000))),
        (("reopen_stderr", "say"), None),
        (("close_streams", "say", "say"), "mine\nprinted at 0.5 s\nprinted at 1 s\n"),
        (("dup_streams", "say"), "mine\nprinted at 0.5 s\n"),
        (("close_some", "say"), "mine\n"),
    ],
)
def test_a_log_of_its_own_is_its_own(apart, log, how, content):
    """Longer than what is kept of its output; and what it says to us does not get into it."""
    it = apart(begun=True)
    assert live(it, *how, "nothing", "nothing") is None
    time.sleep(0.3 * (how == ("reopen",)))  # somebody might look after its output meanwhile
    it.free()
    found = log.read_text()
    assert "beware" not in found
    assert found == content if content else found.count("\n") == 100_000


def test_what_it_may_do_to_its_process_and_its_streams(apart, log, capfd):
    """In one life, one after the other, the worst in the end."""
    before = os.getcwd(), os.umask(0o22)
    deeds = ["chdir", "umask", "read", "garbage", "never_newline", "flood", "threads", "session", "orphan", "raise_13"]
    deeds += ["raise_17", "raise_2", "deaf", "talker", "come_back", "hurry", "no_processes", "no_file_size", "no_files"]
    it = apart(begun=True)
    assert live(it, *deeds) is None
    it.free()
    assert (os.getcwd(), os.umask(before[1])) == before
    assert capfd.readouterr() == ("", "")
    assert not left(log)


def test_the_last_of_what_it_printed_is_told_however_much_that_was(apart, log):
    error = live(apart(begun=True), "flood", "null")
    assert error.log == [f"{k:099d}" for k in range(19_980, 20_000)]


# -------------------------------------------------------------------- what it may not


NO_LINE = "its process lost its line to the master in fmi2DoStep or before: the FMU closes descriptors that are not its"


@pytest.mark.sample(5)
@pytest.mark.parametrize(
    ("deed", "told"),
    [
        ("close_all", NO_LINE),
        ("replace_all", NO_LINE),
        ("send", r"its process sends what cannot be read \(no frame begins with b'hello.*\) and was ended"),
        ("exit0", r"its process ended in fmi2DoStep \(exit code 0\)"),
        ("end_parent", r"its process was ended in fmi2DoStep by a signal \(SIGTERM\)"),
        (
            "kill_parent",
            r"its process was killed in fmi2DoStep \(SIGKILL\), most likely by the system, for lack of memory",
        ),
        *(
            pytest.param(deed, told, marks=pytest.mark.long)
            for deed, told in {
                "send_frame": r"did not return from what it was asked for within 1 s; its process was ended",
                "_exit0": r"its process ended in fmi2DoStep \(exit code 0\)",
                "thread_exit": r"its process ended in fmi2DoStep \(exit code 7\)",
                "end_thread": r"its process ended in fmi2DoStep \(exit code 0\)",
                "daemon": r"its process ended in fmi2DoStep \(exit code 0\)",
                "divide": r"its process crashed in fmi2DoStep \(SIGFPE\)",
                "trap": r"its process crashed in fmi2DoStep \(SIGILL\)",
                "overflow": r"its process crashed in fmi2DoStep \(SIGSEGV\)",
                "twice": r"its process crashed in fmi2DoStep \(SIGABRT\)",
                "raise_1": r"its process was ended in fmi2DoStep by a signal \(SIGHUP\)",
                "raise_19": r"did not return from fmi2DoStep within 1 s; its process was ended",
                "kill_group": r"its process was killed in fmi2DoStep \(SIGKILL\), most likely by the system",
                "seccomp": r"its process was killed in fmi2DoStep \(SIGKILL\), most likely by the system",
                "exec": r"its process left in fmi2DoStep and was ended",
            }.items()
        ),
    ],
)
def test_what_ends_it_is_told_and_its_own_log_is_not_written_into(apart, log, deed, told):
    hangs = "did not return" in told  # the others end by themselves, later on a busy machine
    error = live(apart(begun=True, step_timeout=1.0 if hangs else 60.0), deed)
    assert re.match(rf"it, t = 0(\.5)? s: {told}", str(error))
    assert not log.exists() or log.read_text() == "mine\n"
    assert not left(log)


# -------------------------------------------------------------------- whom it leaves


@pytest.mark.parametrize(
    "deeds",
    [
        ("child", "grandchild", "shell", "popen"),
        ("child_cry",),
        ("grandchild_cry",),
        *(pytest.param((deed,), marks=pytest.mark.long) for deed in ("many", "breeder", "stop_parent")),
    ],
)
def test_whoever_it_has_started_ends_with_it(apart, log, deeds):
    it = apart(begun=True)
    error = live(it, *deeds)
    assert ("SIGABRT" in str(error)) == deeds[0].endswith("_cry")
    it.free()
    assert not left(log)


MASTER = """
import sys, threading, time
from pathlib import Path
from railcosim.orchestrator.fmi.archive import Workspace
from railcosim.orchestrator.isolation.choice import house
from railcosim.orchestrator.fmi.models import load_fmu

def work():
    model = load_fmu(Path(sys.argv[1]), Workspace())
    [it] = house([("it", model.interface, model.folder)])
    it.channel("String", ["deed"]).set([sys.argv[2]])
    it.setup(0.0, 10.0)
    it.enter_initialization()
    it.exit_initialization()
    it.step(0.0, 1.0)
    it.channel("String", ["deed"]).set([sys.argv[3]])
    print(it.pid, flush=True)
    it.step(1.0, 1.0)
    time.sleep(60)

if sys.argv[4] == "thread":
    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
else:
    work()
"""


@pytest.mark.parametrize(
    ("deeds", "thread"),
    [
        (("step grandchild", "step hang"), "main"),
        pytest.param(("nothing", "step hang"), "thread", marks=pytest.mark.long),
        pytest.param(("nothing", "nothing"), "main", marks=pytest.mark.long),
        pytest.param(("step shell", "nothing"), "thread", marks=pytest.mark.long),
    ],
)
def test_nobody_and_no_file_is_left_by_a_master_that_was_killed(hostile, log, tmp_path, deeds, thread):
    place = tmp_path / "tmp"
    place.mkdir()
    command = [sys.executable, "-c", MASTER, hostile(), *deeds, thread]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, text=True, env=os.environ | {"TMPDIR": str(place)}
    ) as master:
        process = Path(f"/proc/{int(master.stdout.readline())}")
        assert process.exists()
        assert list(place.iterdir())
        master.kill()
    until = time.monotonic() + 60.0
    while (left(log) or list(place.iterdir())) and time.monotonic() < until:
        time.sleep(0.05)
    assert not process.exists()
    assert not left(log)
    assert not list(place.iterdir())
