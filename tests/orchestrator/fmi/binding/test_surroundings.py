"""What one FMU does to the process that it shares with others: put back, told, and never fatal to results."""

import ctypes
import json
import locale
import os
import platform
import shutil
import signal
import subprocess
import sys

import pytest
from railcosim.orchestrator import System, run
from railcosim.orchestrator.cli.app import call
from railcosim.orchestrator.fmi.binding.surroundings import FLOATS, are_floats_changed
from railcosim.orchestrator.isolation import isolate

pytestmark = pytest.mark.skipif(
    shutil.which("gcc") is None or sys.platform != "linux", reason="compiles its FMUs with gcc"
)

DECAY = "Y = t < 0.05 ? 1e-303 : 1e-3 * Y; return fmi2OK;"
UPWARD = "fesetround(FE_UPWARD);"
PRECISION = '{ short x87 = 0x7f; __asm__ volatile("fldcw %0" : : "m"(x87)); }'
TRAPS = "feenableexcept(FE_DIVBYZERO | FE_INVALID);"
FLUSH = "__builtin_ia32_ldmxcsr(__builtin_ia32_stmxcsr() | 0x8040);"
GOES_ON = "static void *spin(void *x) { for (volatile int k = 0;; k++) usleep(100); return x; }"
MODE = f"changed {FLOATS}, put back since"
OF_X86 = pytest.mark.skipif(platform.machine() != "x86_64", reason="sets a register of x86")


@pytest.fixture
def pair(lag):
    """A system of one FMU whose numbers tell of flushing and rounding, and another one."""

    def make(**other):
        headers = ["fenv", "unistd", "signal", "locale", "pthread", "sys/stat", "sys/resource"]
        included = [part for header in headers for part in ("-include", f"{header}.h")]
        other["options"] = [*included, "-D_GNU_SOURCE", *other.get("options", ())]
        system = System(stop_time=1.0, step=0.1)
        system.add("a", str(lag(name="decay.fmu", on_step=DECAY)))
        system.add("b", str(lag(name="other.fmu", **other)))
        return system

    return make


@pytest.fixture
def own_place(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("OF_A_USER", "kept")


def check_numbers(outcome):
    assert outcome["a.y"][3] == 1e-309
    assert outcome["a.y"][4] == 1e-312
    assert list(outcome.time) == [k * 0.1 for k in range(11)]
    assert not are_floats_changed()


@pytest.mark.sample(8)
@pytest.mark.usefixtures("loop")
@pytest.mark.parametrize("algorithm", ["jacobi", "gauss-seidel"])
@pytest.mark.parametrize(
    "code",
    [
        {"options": ["-ffast-math"]},
        {"on_instantiate": UPWARD},
        {"on_step": UPWARD},
        {"on_get": UPWARD},
        pytest.param({"on_step": FLUSH}, marks=OF_X86),
    ],
    ids=["fast-math", "instantiate", "step", "get", "flush"],
)
def test_how_one_fmu_rounds_is_not_how_others_do(pair, code, algorithm):
    outcome = run(pair(**code), algorithm=algorithm)
    check_numbers(outcome)
    assert outcome.notes == [f"b (Lag) {MODE}; isolate it to keep that to itself"]


@pytest.mark.usefixtures("loop")
@pytest.mark.parametrize("place", ["on_instantiate", "on_step"])
@pytest.mark.parametrize("code", [TRAPS, pytest.param(PRECISION, marks=OF_X86)], ids=["traps", "precision"])
def test_what_sums_do_not_tell_of_is_read_from_the_registers(pair, place, code):
    outcome = run(pair(**{place: code}))
    check_numbers(outcome)
    assert outcome.notes[-1].startswith(f"b (Lag) changed {FLOATS}")


@pytest.mark.parametrize("place", ["on_instantiate", "on_step"])
def test_threads_and_processes_of_their_own_do_not_change_it(pair, place):
    check_numbers(run(pair(**{place: UPWARD}), algorithm="jacobi", threads=2))
    outcome = run(isolate(pair(**{place: UPWARD}), ["b"]))
    check_numbers(outcome)
    assert outcome.notes == []


@pytest.mark.sample(16)
@pytest.mark.usefixtures("loop", "own_place")
@pytest.mark.parametrize("place", ["on_instantiate", "on_step", "on_free"])
@pytest.mark.parametrize(
    ("code", "what"),
    [
        ('chdir("/");', "the working directory"),
        ('setenv("OF_AN_FMU", "1", 1); unsetenv("OF_A_USER");', "environment variables (OF_AN_FMU, OF_A_USER)"),
        ('setlocale(LC_NUMERIC, "C.UTF-8");', "the locale"),
        ('uselocale(newlocale(LC_ALL_MASK, "C.UTF-8", 0));', "the locale"),
        ("signal(SIGINT, SIG_IGN);", "signal handlers"),
        ("{ sigset_t all; sigfillset(&all); sigprocmask(SIG_BLOCK, &all, 0); }", "which signals reach it"),
        ("umask(0777);", "the mask of new files' rights (umask)"),
        ("{ struct rlimit it = {100, RLIM_INFINITY}; setrlimit(RLIMIT_FSIZE, &it); }", "limits of resources"),
    ],
    ids=["folder", "environment", "locale", "locale of the thread", "signals", "blocked", "mask", "limits"],
)
def test_what_is_shared_is_put_back_and_told(pair, tmp_path, place, code, what):
    before = locale.setlocale(locale.LC_ALL), signal.getsignal(signal.SIGINT)
    outcome = run(pair(**{place: code}), output="out")
    check_numbers(outcome)
    assert f"b (Lag) changed {what}" in outcome.notes[-1]
    assert os.getcwd() == str(tmp_path)
    assert (locale.setlocale(locale.LC_ALL), signal.getsignal(signal.SIGINT)) == before
    getenv = ctypes.CDLL(None).getenv
    getenv.restype = ctypes.c_char_p
    assert (getenv(b"OF_A_USER"), getenv(b"OF_AN_FMU"), os.environ["OF_A_USER"]) == (b"kept", None, "kept")
    assert json.loads((tmp_path / "out" / "run.json").read_text())["notes"][-1] == outcome.notes[-1]
    assert (tmp_path / "out" / "results.csv").is_file()


def test_a_thread_that_outlives_its_instance_finds_its_code(pair):
    code = "{ pthread_t it; pthread_create(&it, 0, spin, 0); }"
    outcome = run(pair(on_instantiate=code, before=GOES_ON))
    check_numbers(outcome)
    assert outcome.notes == ["b (Lag) left threads behind: its library stays loaded; isolate it to keep that to itself"]


def test_a_thread_that_has_ended_does_not_keep_the_library(pair):
    code = "{ pthread_t it; pthread_create(&it, 0, (void *(*)(void *))getpid, 0); pthread_join(it, 0); }"
    assert run(pair(on_instantiate=code)).notes == []


def test_files_are_complete_before_anything_is_given_back(lag, tmp_path):
    """An FMU that crashes when it is freed takes the process along, and no result."""
    (tmp_path / "s.toml").write_text(
        f'[simulation]\nstop_time = 1.0\n[instances.a]\nfmu = "{lag(on_free="*(volatile int *)0 = 1;")}"\n',
        encoding="utf-8",
    )
    script = "import sys; from railcosim.orchestrator.cli.app import call; sys.exit(call(sys.argv[1:]))"
    command = [sys.executable, "-c", script, "run", "s.toml", "-o", "out"]
    assert subprocess.run(command, cwd=tmp_path, check=False, capture_output=True).returncode == -signal.SIGSEGV
    record = json.loads((tmp_path / "out" / "run.json").read_text())
    assert (record["status"], record["time_reached"]) == ("completed", 1.0)
    assert (tmp_path / "out" / "results.csv").read_text().splitlines()[-1].startswith("1.0,")


def test_results_stand_where_they_were_asked_for(lag, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    path = lag(on_step='chdir("/");', options=["-include", "unistd.h"])
    (tmp_path / "s.toml").write_text(f'[simulation]\nstop_time = 1.0\n[instances.a]\nfmu = "{path}"\n')
    assert call(["run", "s.toml", "-o", "out"]) == 0
    assert "a (Lag) changed the working directory" in capsys.readouterr().out
    assert (tmp_path / "out" / "results.csv").is_file()
