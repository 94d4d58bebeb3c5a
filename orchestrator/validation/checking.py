"""Any FMU, looked at and tried: archive, description, our own rules where it is ours, and probes in other processes."""

from __future__ import annotations

from pathlib import Path

import fmpy
from fmpy.validation import validate_fmu
from lxml import etree

from ..fmi import Workspace, is_pedantry, load_fmu
from .findings import Finding, Report, listed
from .own_rules import broken_rules
from .probing import TIMEOUT, try_out

_SCHEMAS = {
    "1.0": "fmi1/fmiModelDescription.xsd",
    "2.0": "fmi2/fmi2ModelDescription.xsd",
    "3.0": "fmi3/fmi3ModelDescription.xsd",
}


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
    schema = etree.XMLSchema(file=str(Path(fmpy.__file__).parent / "schema" / _SCHEMAS[version]))
    parsed = etree.parse(str(folder / "modelDescription.xml"))
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
