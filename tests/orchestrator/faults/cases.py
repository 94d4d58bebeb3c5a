"""A case of the campaign: from a seed to a small scenario, what fails in it, and what came of it."""

import contextlib
import faulthandler
import gc
import io
import logging
import os
import random
import select
import shutil
import signal
import sys
import tempfile
import time
import traceback
import warnings
from pathlib import Path
from typing import NamedTuple

import pytest
import typer.main
from faults import FATAL, MANNERS, Counts, Faults, Plan, manners
from railcosim.orchestrator import Results
from railcosim.orchestrator.cli import app

VARIANTS = 16
_SCENARIO = """title = "A small system"
[simulation]
algorithm = "{algorithm}"
stop_time = 2.0
step = 0.1
{record}
[instances.one]
fmu = "{folder}/Lag.fmu"
start.x = 5.0
[instances.two]
fmu = "{folder}/{second}.fmu"
[connections]
"one.u" = "two.x"
"two.u" = "one.x"
{third}
{event}
[require]
low = "always one.x < {most}"
[metrics]
end = "final(two.x)"
"""
_THIRD = '"three.u" = "two.slope"\n[instances.three]\nfmu = "{folder}/Keep.fmu"\n'
_EVENT = '[[events]]\nsignal = "one.x"\naction = "bias"\nat = 0.5\nvalue = 0.5\nduration = 0.7\n'
_TOGETHER = ("together",)
_PATIENCE = 60.0
"""Wall time in s after which a command hangs."""


class Variant(NamedTuple):
    """A scenario, and how it is run."""

    number: int
    algorithm: str
    threads: int
    isolated: tuple[str, ...]
    every: float | None
    record: float | None
    has_event: bool
    fails: bool
    tick: float

    @classmethod
    def of(cls, number):
        """The variant of a number."""
        draw = random.Random(number)
        algorithm = draw.choice(["gauss-seidel", "gauss-seidel", "jacobi", "jacobi", "iterative", "adaptive"])
        isolated = draw.choice([(), (), (), ("one",), ("one", "two")])
        isolated = _TOGETHER if len(isolated) == 2 and number % 4 == 1 else isolated
        threads = 2 if algorithm == "jacobi" and not isolated and draw.random() < 0.5 else 1
        every, record = draw.choice([None, 0.8, 0.8]), draw.choice([None, 0.3])
        tick = draw.choice([1e-4, 0.05, 0.4])
        return cls(number, algorithm, threads, isolated, every, record, draw.random() < 0.5, draw.random() < 0.2, tick)

    def write(self, folder, fmus, *, thinned=True):
        """Write the scenario."""
        record = f"record = {self.record}" if self.record and thinned else ""
        event, most = _EVENT if self.has_event else "", 4.0 if self.fails else 100.0
        third = "" if self.algorithm == "adaptive" or self.number % 2 else _THIRD.format(folder=fmus)  # it is sampled
        second = "Lag" if self.isolated == _TOGETHER else "LagWithSlope"  # instances of one FMU share a process
        parts = {"record": record, "event": event, "third": third, "second": second}
        text = _SCENARIO.format(algorithm=self.algorithm, most=most, folder=fmus, **parts)
        (folder / "small.toml").write_text(text)

    @property
    def arguments(self):
        """The command."""
        isolated = [word for name in self.isolated for word in ("--isolate", name)]
        every = ["--checkpoint-every", str(self.every)] if self.every else []
        how = ["--threads", str(self.threads)] if self.threads > 1 else []
        return ["run", "small.toml", "-o", "out", "--no-figures", "--quiet", *isolated, *every, *how]


class Ended(NamedTuple):
    """How a command ended: its exit code (minus the signal), what it said, where its fault struck."""

    code: int
    said: str
    struck: str
    counts: dict
    orphans: bool


class Reference(NamedTuple):
    """The undisturbed run of a variant: its exit code, its calls, its rows, those at every point, times of events."""

    code: int
    counts: dict
    rows: dict
    every_row: dict
    events: tuple


class Bench:
    """Runs cases.

    Args:
        folder: where. fmus: where the FMUs are.
    """

    def __init__(self, folder, fmus):
        self.folder, self.fmus = folder, fmus
        self._references = {}
        self._command = typer.main.get_command(app.app)  # made once: it takes longer than a case

    def reference(self, variant):
        """The undisturbed run."""
        if variant not in self._references:
            found = []
            for thinned in (True, False) if variant.record else (True,):
                place = self.place(variant, thinned=thinned)
                ended = self.run(place, variant.arguments, variant.tick)
                assert not ended.orphans
                results = Results.load(place / "out")
                found.append((ended, {"time": results.time, **results}))
            (ended, rows), (_, every_row) = found[0], found[-1]
            assert ended.code == int(variant.fails), ended
            self._references[variant] = Reference(
                ended.code, ended.counts, rows, every_row, (0.5, 1.2) if variant.has_event else ()
            )
        return self._references[variant]

    def place(self, variant, *, thinned=True):
        """An empty folder with the scenario in it, and a neighbour."""
        place = self.folder / "case"
        shutil.rmtree(place, ignore_errors=True)
        for name in ("tmp", "other"):
            (place / name).mkdir(parents=True)
        (place / "other" / "results.bin").write_text("another's")
        variant.write(place, self.fmus, thinned=thinned)
        return place

    def draw(self, seed):
        """The variant of a seed, the fault in its run, and perhaps one while that is resumed.

        Kinds of which there are few calls fail as often as others.
        """
        draw = random.Random(f"case {seed}")
        variant = Variant.of(draw.randrange(VARIANTS))
        counts, plans = self.reference(variant).counts, []
        for _ in range(draw.choice([1, 1, 1, 2])):
            process, kind = draw.choice(sorted(counts))
            plans.append(
                Plan(process, kind, draw.randrange(counts[process, kind]), draw.choice(manners(kind, process)))
            )
        return variant, plans

    def run(self, place, arguments, tick, plan=None):
        """Run a command in this process."""
        said, counts, struck = io.StringIO(), Counts(), place / "struck"
        struck.unlink(missing_ok=True)
        with (
            contextlib.chdir(place),
            contextlib.redirect_stdout(said),
            contextlib.redirect_stderr(said),
            pytest.MonkeyPatch.context() as patch,
            warnings.catch_warnings(action="ignore"),
            Faults(counts, struck, tick, plan).installed(),
        ):
            patch.setattr(tempfile, "tempdir", str(place / "tmp"))
            patch.setattr(app, "app", self._command)
            try:
                code = app.call(arguments)
            except BaseException:
                traceback.print_exc()
                code = 99
        where = struck.read_text() if struck.exists() else ""
        return Ended(code, said.getvalue(), where, counts.all(), _are_left())

    def disturb(self, place, arguments, tick, plan):
        """Run a command of which something fails; where that may end the process, in a fork of this one."""
        if plan.kind != "fmi" and plan.manner in MANNERS[plan.kind] and plan.manner not in FATAL:
            return self.run(place, arguments, tick, plan)
        counts, struck = Counts(), place / "struck"
        struck.unlink(missing_ok=True)
        gc.freeze()
        pid = os.fork()
        if not pid:
            self._become(place, arguments, Faults(counts, struck, tick, plan))
        code = _await(pid)
        orphans = _are_left()
        where = struck.read_text() if struck.exists() else ""
        said = (place / "stderr").read_text(errors="replace")
        return Ended(code, said, where, counts.all(), orphans)

    def _become(self, place, arguments, faults):
        """Be the command; what it reaches is written down nowhere."""
        sys.settrace(None)
        try:
            gc.disable()
            faulthandler.disable()
            warnings.simplefilter("ignore")
            logging.getLogger().handlers.clear()
            os.chdir(place)
            tempfile.tempdir = str(place / "tmp")
            for number, name in ((1, "stdout"), (2, "stderr")):
                os.dup2(os.open(name, os.O_WRONLY | os.O_CREAT | os.O_TRUNC), number)
            sys.stdout, sys.stderr = (io.TextIOWrapper(io.FileIO(number, "w", closefd=False)) for number in (1, 2))
            command, app.app = app._command, self._command

            def disturbed():
                with faults.installed():
                    return command()

            app._command = disturbed
            if faults.plan.manner not in ("SIGSEGV", "exit"):  # a second fork costs much
                app.supervised = lambda command: command()
            sys.argv = ["orchestrate", *arguments]
            app.main()
        except BaseException:
            traceback.print_exc()
            sys.stderr.flush()
        os._exit(99)


def _await(pid):
    """The exit code of a child; None if it had to be killed."""
    descriptor = os.pidfd_open(pid)
    ended = select.select([descriptor], [], [], _PATIENCE)[0]
    os.close(descriptor)
    if not ended:
        os.kill(pid, signal.SIGKILL)
    code = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
    return code if ended else None


def _are_left():
    """Whether there are processes left that the case has started; this process is the parent of all orphans."""
    until = time.monotonic() + 30.0
    with contextlib.suppress(ChildProcessError):
        while time.monotonic() < until:
            if os.waitpid(-1, os.WNOHANG) == (0, 0):
                time.sleep(0.001)
        _kill_all()
        return True
    return False


def _kill_all():
    for child in Path(f"/proc/{os.getpid()}/task/{os.getpid()}/children").read_text().split():
        os.kill(int(child), signal.SIGKILL)
