"""The probes of an FMU, each in a process of its own, which the FMU may take down."""

from __future__ import annotations

import contextlib
import os
import subprocess
import threading
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from .. import world
from ..errors import FmuFileError
from ..fmi import Interface
from ..fmi.binding import library, names_of_platform
from ..isolation import end_process, signal_name, starting
from .findings import Finding, Verdict, listed
from .probes import Task

PROBES = {
    "instantiate": "loads, instantiates, frees",
    "simulate": "simulates",
    "surroundings": "surroundings",
    "starts": "start values",
    "reset": "resets",
    "instances": "several instances",
    "state": "saves its state",
    "dependencies": "dependencies",
    "steps": "steps of other lengths",
    "derivatives": "derivatives",
    "order": "wrong calls",
}
"""The probes of `probe_process`, as a user reads them."""
TIMEOUT = 60.0
"""How long one probe may take by default, in s."""
_DEFAULT_STEP = 0.1
_SAID = "output.txt"
_LIVES = {"dependencies": 10, "order": 20}
"""Processes that a probe may take which does what FMUs may not stand: what takes one down is left out by the next."""
_MOMENT = 0.25
"""How often a probe that takes long is asked whether it is still wanted, in s."""
_HANGS = "not finished after"


def try_out(
    interface: Interface, folder: Path, path: Path, timeout: float, probes: Sequence[str] = tuple(PROBES)
) -> list[Finding]:
    """Whether there is a library for this machine, and what every probe of it finds.

    Args:
        interface: the FMU's.
        folder: where it was unpacked; the probes write beside it.
        path: the archive, for messages.
        timeout: how long one probe may take, in s.
        probes: which ones.
    """
    binaries = folder / "binaries"
    platforms = sorted(p.name for p in world.iterdir(binaries) if p.is_dir()) if binaries.is_dir() else []
    here = names_of_platform(interface.version)
    if not set(here) & set(platforms):
        brings = f"it brings {', '.join(platforms)}" if platforms else "it brings none"
        return [Finding("binary", "skipped" if platforms else "fail", f"none for {here[0]}; {brings}")]
    try:
        found = library(folder, interface, str(path))
    except FmuFileError as error:
        return [Finding("binary", "fail", str(error))]
    problems = []
    if found.stem != interface.identifier:
        problems.append(f"{found.name} is not named after the model identifier {interface.identifier!r}")
    if found.parent.name != here[0]:
        problems.append(f"{found.name} stands in binaries/{found.parent.name}, not in binaries/{here[0]}")
    problems = [f"{problem}: most importers need that" for problem in problems]
    findings = [listed("binary", problems, f"for {', '.join(platforms)}")]
    stopped = threading.Event()
    with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        try:
            answers = list(pool.map(lambda probe: _probe(probe, interface, folder, timeout, stopped), probes))
        except BaseException:  # Ctrl-C, above all: no probe is waited for
            stopped.set()
            raise
    return findings + [_judged(PROBES[probe], answer, interface) for probe, answer in zip(probes, answers, strict=True)]


def _probe(
    probe: str, interface: Interface, folder: Path, timeout: float, stopped: threading.Event
) -> tuple[Verdict, str]:
    place = Path(world.mkdtemp(prefix=f"{probe}_", dir=folder.parent))
    step = interface.default_step or interface.recommended_step or _DEFAULT_STEP
    task = Task(probe, interface, folder, step, answer=place / "answer.jsonl")
    task.write(place / "task.json")
    for _ in range(_LIVES.get(probe, 1)):
        death = _live(place, timeout, stopped)
        if task.record.last("verdict") is not None:
            return task.record.last("verdict"), str(task.record.last("detail"))
        task.record.add(died=death)
    culprit = task.record.last("trying")
    what = f"took its process down{f' at {culprit}' if culprit else ''} ({death})"
    if death.startswith(_HANGS):
        what = f"{death} by {culprit or 'its library'} and was ended"
    return "fail", f"{what}{_last_words(place / _SAID)}"


def _live(place: Path, timeout: float, stopped: threading.Event) -> str:
    """Let a process try, until it ends; how it did.

    Raises:
        InterruptedError: nobody wants to know any more.
    """
    command = [*starting("validation.probe_process"), str(place / "task.json")]
    with world.open(place / _SAID, "wb") as output:
        process = world.start(
            command, cwd=place, stdin=subprocess.DEVNULL, stdout=output, stderr=output, start_new_session=True
        )
        left = timeout
        try:
            while left > 0.0:
                if stopped.is_set():
                    raise InterruptedError
                with contextlib.suppress(subprocess.TimeoutExpired):
                    return _cause(world.wait(process, min(left, _MOMENT)))
                left -= _MOMENT
            return f"{_HANGS} {timeout:g} s"
        finally:
            if process.returncode is None:
                end_process(process)


def _cause(code: int) -> str:
    if code < 0:
        return signal_name(-code)
    return f"exit code {code}" if code < 2**31 else f"exit code {code:#x}"


def _last_words(path: Path) -> str:
    end = world.read_bytes(path)[-2000:].decode(errors="replace")
    lines = [line.strip() for line in end.splitlines() if line.strip()]
    return f"; last words: {lines[-1]}" if lines else ""


def _judged(title: str, answer: tuple[Verdict, str], interface: Interface) -> Finding:
    verdict, detail = answer
    # What is doubtful in the FMU of another maker is a defect in ours; a Python FMU's outer shell is pythonfmu's.
    ours = interface.own_kind == "native"
    return Finding(title, "fail" if verdict == "warning" and ours else verdict, detail)
