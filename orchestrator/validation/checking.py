"""Any FMU, looked at and tried: archive, description, our own rules where it is ours, and probes in other processes."""

from __future__ import annotations

from pathlib import Path

import fmpy
from fmpy.validation import validate_fmu
from lxml import etree

from .. import world
from ..fmi import Workspace, is_pedantry, load_fmu, read_as_written
from .findings import Finding, Report, listed
from .own_rules import broken_rules
from .probing import TIMEOUT, try_out

_SCHEMAS = {
    "1.0": "fmi1/fmiModelDescription.xsd",
    "2.0": "fmi2/fmi2ModelDescription.xsd",
    "3.0": "fmi3/fmi3ModelDescription.xsd",
}

_LARGE = 16 << 20
"""Bytes of a description that FMPy reads: in memory it is forty times as much."""


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
        archive = workspace.unpack(path).notes
        findings = [listed("archive", archive, "unpacks, and nothing in it points outside", "warning")]
        told = [remark for remark in interface.remarks if remark not in archive]
        findings.append(listed("notes", told, "a run has nothing to remark on its description", "note"))
        findings += _described(path, folder, interface.version)
        if interface.annotation:
            broken = broken_rules(folder, interface)
            findings.append(listed("rules of railcosim", broken, "all kept"))
        findings += try_out(interface, folder, path, timeout)
    return Report(path, interface, tuple(findings))


def _described(path: Path, folder: Path, version: str) -> list[Finding]:
    description = folder / "modelDescription.xml"
    if world.stat(description).st_size > _LARGE:
        return _described_in_parts(path, description, version)
    schema = etree.XMLSchema(file=str(Path(fmpy.__file__).parent / "schema" / _SCHEMAS[version]))
    parsed = etree.parse(str(description))
    schema.validate(parsed)
    against = [f"line {entry.line}: {entry.message}" for entry in schema.error_log]
    findings = [listed("schema", against, f"modelDescription.xml keeps the schema of FMI {version}")]
    if against:
        return [*findings, Finding("description", "skipped", "FMPy looks no further than the schema")]
    problems = [problem for problem in validate_fmu(str(path)) if not is_pedantry(version, problem)]
    # What belongs there is disputed, no importer needs it, and most tools write something else.
    unknowns = [problem for problem in problems if problem.startswith("ModelStructure/InitialUnknowns")]
    others = [problem for problem in problems if problem not in unknowns]
    findings.append(listed("description", others, "FMPy's validator finds nothing"))
    return [*findings, *([listed("initial unknowns", unknowns, "", "note")] if unknowns else [])]


def _described_in_parts(path: Path, description: Path, version: str) -> list[Finding]:
    """The same of a description that is too large for FMPy, but for what it says of names and model structure."""
    reading = read_as_written(description, str(path), mending=False)
    against = reading.against_schema
    findings = [listed("schema", against, f"modelDescription.xml keeps the schema of FMI {version}")]
    if against:
        return [*findings, Finding("description", "skipped", "of a file that does not keep the schema")]
    problems = [problem for problem in reading.inconsistencies() if not is_pedantry(version, problem)]
    fine = (
        f"variables and units are consistent; of more than {_LARGE >> 20} MiB names and model structure are not judged"
    )
    return [*findings, listed("description", problems, fine)]
