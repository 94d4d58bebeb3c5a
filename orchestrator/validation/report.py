"""Any FMU, looked at and tried: archive, description, our own rules where it is ours, and probes in other processes."""

from __future__ import annotations

import json
import os
import pickle
import signal
import subprocess
import tempfile
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import fmpy
from fmpy.validation import validate_fmu
from lxml import etree

from ..errors import FmuFileError
from ..fmi import Interface, Workspace, is_pedantry, load_fmu
from ..fmi.binding import library, names_of_platform
from ..isolation import starting
from . import probes_fmi2
from .own_rules import broken_rules
from .probes import Task

Verdict = Literal["pass", "warning", "fail", "skipped"]
PROBES = {
    "instantiate": "loads, instantiates, frees",
    "simulate": "simulates",
    "starts": "start values",
    "reset": "resets",
    "instances": "several instances",
    "state": "saves its state",
    "order": "wrong calls",
}
"""The probes of `probe.PROBES`, as a user reads them."""
TIMEOUT = 60.0
_DEFAULT_STEP = 0.1
_LISTED = 20
_SCHEMAS = {
    "1.0": "fmi1/fmiModelDescription.xsd",
    "2.0": "fmi2/fmi2ModelDescription.xsd",
    "3.0": "fmi3/fmi3ModelDescription.xsd",
}


@dataclass(frozen=True)
class Finding:
    """One line of the verdict table."""

    check: str
    verdict: Verdict
    detail: str


@dataclass(frozen=True)
class Report:
    """What was found; `passed` unless something failed."""

    path: Path
    interface: Interface
    findings: tuple[Finding, ...]

    @property
    def passed(self) -> bool:
        """Whether nothing failed."""
        return all(finding.verdict != "fail" for finding in self.findings)


def validate(path: Path, *, timeout: float = TIMEOUT) -> Report:
    """Check one FMU, whoever made it.

    Args:
        path: the file.
        timeout: how long one probe may take, in s; it is then ended and has failed.

    Raises:
        FmuFileError: the file is no FMU that can be used at all: missing, damaged, hostile, of another FMI version.
    """
    with Workspace() as workspace:
        model = load_fmu(path, workspace)
        interface, folder = model.interface, model.folder
        findings = [Finding("archive", "pass", "unpacks, and nothing in it points outside")]
        findings += _described(path, folder, interface.version)
        if interface.annotation:
            broken = broken_rules(folder, interface)
            findings.append(_listed("rules of railcosim", broken, "all kept"))
        findings += _probed(interface, folder, path, timeout)
    return Report(path, interface, tuple(findings))


# -------------------------------------------------------------------- what stands in the file


def _described(path: Path, folder: Path, version: str) -> list[Finding]:
    schema = etree.XMLSchema(file=str(Path(fmpy.__file__).parent / "schema" / _SCHEMAS[version]))
    parsed = etree.parse(str(folder / "modelDescription.xml"))
    schema.validate(parsed)
    against = [f"line {entry.line}: {entry.message}" for entry in schema.error_log]
    findings = [_listed("schema", against, f"modelDescription.xml keeps the schema of FMI {version}")]
    if against:
        return [*findings, Finding("description", "skipped", "FMPy looks no further than the schema")]
    problems = [problem for problem in validate_fmu(str(path)) if not is_pedantry(version, problem)]
    return [*findings, _listed("description", problems, "FMPy's validator finds nothing")]


def _listed(check: str, problems: Sequence[str], fine: str) -> Finding:
    more = f"\n... and {len(problems) - _LISTED} more" if len(problems) > _LISTED else ""
    return Finding(check, "fail", "\n".join(problems[:_LISTED]) + more) if problems else Finding(check, "pass", fine)


# -------------------------------------------------------------------- what it does


def _probed(interface: Interface, folder: Path, path: Path, timeout: float) -> list[Finding]:
    binaries = folder / "binaries"
    platforms = sorted(p.name for p in binaries.iterdir() if p.is_dir()) if binaries.is_dir() else []
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
    findings = [_listed("binary", problems, f"for {', '.join(platforms)}")]
    with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        answers = pool.map(lambda probe: _probe(probe, interface, folder, timeout), PROBES)
        findings += [_judged(title, answer, interface) for title, answer in zip(PROBES.values(), answers, strict=True)]
    return findings


def _probe(probe: str, interface: Interface, folder: Path, timeout: float) -> tuple[Verdict, str]:
    if probe in probes_fmi2.PROBES and interface.version != "2.0":
        return "skipped", "tried with FMI 2.0 only"
    place = Path(tempfile.mkdtemp(prefix=f"{probe}_", dir=folder.parent))
    step = interface.default_step or interface.recommended_step or _DEFAULT_STEP
    task = Task(probe, interface, folder, step, answer=place / "answer.json", trying=place / "trying.txt")
    (place / "task").write_bytes(pickle.dumps(task))
    command = [*starting("validation.probe_process"), str(place / "task")]
    with (place / "output.txt").open("wb") as output:
        process = subprocess.Popen(
            command, cwd=place, stdin=subprocess.DEVNULL, stdout=output, stderr=output, start_new_session=True
        )
        try:
            code = process.wait(timeout)
        except subprocess.TimeoutExpired:
            _end(process)
            return "fail", f"not finished after {timeout:g} s: it was ended"
        except BaseException:
            _end(process)
            raise
    if task.answer.is_file():
        told = json.loads(task.answer.read_text(encoding="utf-8"))
        return told["verdict"], told["detail"]
    at = f" at {task.trying.read_text(encoding='utf-8')}" if task.trying.is_file() else ""
    return "fail", f"it took its process down{at} ({_cause(code)}){_last_words(place / 'output.txt')}"


def _end(process: subprocess.Popen[bytes]) -> None:
    """The probe and whatever the FMU started."""
    if hasattr(os, "killpg"):
        os.killpg(process.pid, signal.SIGKILL)
    else:
        process.kill()
    process.wait()


def _cause(code: int) -> str:
    if code >= 0:
        return f"exit code {code}" if code < 2**31 else f"exit code {code:#x}"
    try:
        return signal.Signals(-code).name
    except ValueError:
        return f"signal {-code}"


def _last_words(path: Path) -> str:
    lines = [line.strip() for line in path.read_bytes()[-2000:].decode(errors="replace").splitlines() if line.strip()]
    return f"; last words: {lines[-1]}" if lines else ""


def _judged(title: str, answer: tuple[Verdict, str], interface: Interface) -> Finding:
    verdict, detail = answer
    # What is doubtful in the FMU of another maker is a defect in ours; a Python FMU's outer shell is pythonfmu's.
    ours = interface.own_kind == "native"
    return Finding(title, "fail" if verdict == "warning" and ours else verdict, detail)
