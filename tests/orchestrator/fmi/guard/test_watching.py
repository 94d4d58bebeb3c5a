"""An FMU that ends the process instead of returning is an error that names it, wherever it does so."""

import logging
import os
import signal
import subprocess
import sys

import pytest
from railcosim.orchestrator import System, run
from railcosim.orchestrator.errors import FmuError
from railcosim.orchestrator.fmi.guard import NOTES, watching
from railcosim.orchestrator.run import Results

pytestmark = pytest.mark.skipif(
    not sys.platform.startswith("linux") or watching.calls is None, reason="FMUs are guarded on Linux"
)
HEADERS = [option for name in ("unistd", "pthread", "threads") for option in ("-include", f"{name}.h")]
WAYS = ["exit(0)", "_exit(0)", "_Exit(5)", "quick_exit(0)", "abort()", "pthread_exit(0)", "thrd_exit(0)"]
SAID = {"_Exit(5)": "_exit(5)", "pthread_exit(0)": "pthread_exit()", "thrd_exit(0)": "pthread_exit()"}


@pytest.fixture
def system(lag):
    """A system of two FMUs, the second one with code of choice, that is stepped in Python."""

    def make(options=(), **code):
        made = System(step=0.1, stop_time=1.0, algorithm="iterative")
        made.add("good", str(lag(name="good.fmu")))
        made.add("bad", str(lag(name="bad.fmu", options=[*HEADERS, *options], **code)))
        made.connect("good.y", "bad.u")
        return made

    return make


@pytest.fixture
def forked():
    """Do something in another process; how that ended, and what it printed last."""

    def do(work):
        heard, saying = os.pipe()
        child = os.fork()
        if child == 0:
            os.dup2(saying, 1)
            os.dup2(saying, 2)
            sys.stdout, sys.stderr = os.fdopen(1, "w"), os.fdopen(2, "w")
            logging.getLogger().handlers = [logging.StreamHandler(sys.stderr)]
            try:
                work()
            finally:
                os._exit(99)
        os.close(saying)
        with os.fdopen(heard) as stream:
            text = stream.read()
        return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), text

    return do


@pytest.mark.parametrize("way", WAYS)
def test_the_end_of_the_process_is_an_error_of_the_instance(system, tmp_path, way):
    with pytest.raises(FmuError) as caught:
        run(system(on_step=f"if (t > 0.45) {way};"), output=tmp_path)
    assert str(caught.value).startswith(f"bad, t = 0.5 s: fmi2DoStep called {SAID.get(way, way)}, which would have")
    assert (caught.value.instance, caught.value.time) == ("bad", pytest.approx(0.5))
    assert Results.load(tmp_path).time[-1] == pytest.approx(0.5)
    assert caught.value.run.status == "failed"


@pytest.mark.parametrize(
    ("place", "call", "when"),
    [("instantiate", "fmi2Instantiate", ""), ("get", "fmi2GetReal", ", t = 0 s")],
)
def test_in_every_call(system, place, call, when):
    with pytest.raises(FmuError, match=rf"^bad{when}: (cannot be instantiated: )?{call} called exit\(0\)"):
        run(system(**{f"on_{place}": "exit(0);"}))


def test_when_it_is_freed_the_run_is_complete(system):
    outcome = run(system(on_free="_exit(0);"))
    assert outcome.status == "completed"
    assert any("bad (Lag) fmi2FreeInstance called _exit(0)" in note for note in outcome.notes)


def test_what_an_fmu_has_forked_ends_as_it_likes(system):
    code = (
        "pid_t it = fork(); if (it == 0) _exit(7); int how; waitpid(it, &how, 0); if (how != 7 << 8) return fmi2Error;"
    )
    assert run(system(on_step=code, options=["-include", "sys/wait.h"])).status == "completed"


def test_its_own_threads_end_as_they_like(system):
    before = "static void *leaves(void *_) { pthread_exit(0); }"
    code = "pthread_t it; pthread_create(&it, 0, leaves, 0); pthread_join(it, 0);"
    assert run(system(on_step=code, before=before)).status == "completed"


def test_a_thread_of_its_own_that_ends_the_process(system, tmp_path, forked):
    """Nothing leads back from there: the process ends, with what was computed on the disk and never with code 0."""
    before = "static void *leaves(void *_) { _exit(0); }"
    code = "if (t > 0.45) { pthread_t it; pthread_create(&it, 0, leaves, 0); pthread_join(it, 0); }"
    bad = system(on_step=code, before=before)
    code, said = forked(lambda: run(bad, output=tmp_path))
    assert code == 3
    assert said == "an FMU called _exit(0), which ended the process; isolate it to keep that to itself\n"
    assert Results.load(tmp_path).time[-1] == pytest.approx(0.5)


@pytest.mark.parametrize("way", ["exit(0)", "_exit(0)", "quick_exit(0)"])
def test_a_library_that_ends_the_process_as_it_is_unloaded(system, forked, way):
    bad = system(before=f"__attribute__((destructor)) static void leaves(void) {{ {way}; }}")
    code, said = forked(lambda: run(bad))
    assert code == 3
    assert said.startswith(f"bad (Lag) in unloading its library at t = 0.9 s called {way}")


ALONE = """
import sys
from railcosim.orchestrator import System, run
made = System(step=0.1, stop_time=1.0, algorithm="iterative")
made.add("good", sys.argv[1])
made.add("bad", sys.argv[2])
made.connect("good.y", "bad.u")
run(made)
"""


def test_an_end_that_no_table_shows(system):
    """``err`` ends the process inside the C library; a new process, in which no other library ends in its own way."""
    bad = system(on_step='if (t > 0.45) err(0, "no more");', options=["-include", "err.h"])
    paths = [bad.instances[name].model for name in ("good", "bad")]
    done = subprocess.run(
        [sys.executable, "-c", ALONE, *paths], capture_output=True, text=True, check=False, timeout=60
    )
    assert done.returncode == 3
    assert "bad (Lag) in fmi2DoStep at t = 0.5 s called exit(0), which ended the process" in done.stderr


def test_python_that_ends_the_process_within_a_run(system, forked):
    good = system()
    code, said = forked(lambda: run(good, progress=lambda *_: os._exit(0)))
    assert (code, "called _exit(0), which ended the process" in said) == (3, True)


def test_python_ends_as_it_likes_after_a_run_and_in_processes_of_its_own(system, forked):
    def work():
        child = os.fork()
        if child == 0:
            os._exit(5)
        assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 5

    def runs():
        run(system(), progress=lambda *_: work())
        os._exit(7)

    assert forked(runs)[0] == 7


def test_what_cannot_be_saved_does_not_keep_the_culprit_quiet(caplog):
    def will(_):
        raise OSError("the disk is full")

    with watching.run_guarded(will, None):
        watching._speak(0, 0, 0.0, 1, 0)
    assert [record.getMessage() for record in caplog.records] == [
        "what was computed could not be saved",
        "an FMU called exit(0), which ended the process; isolate it to keep that to itself",
    ]
    assert NOTES.decided == watching.ENDED
    NOTES.decide(-1)


def test_without_the_guard_functions_are_called_as_they_are(monkeypatch, lag, alone):
    monkeypatch.setattr(watching, "calls", None)
    one = alone(lag())
    assert type(one.function("fmi2DoStep")).__name__ == "_FuncPtr"
    assert not NOTES.under_way()
    assert not watching.described([])
    with watching.run_guarded(lambda _: None, None):
        one.setup(0.0, 1.0)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
