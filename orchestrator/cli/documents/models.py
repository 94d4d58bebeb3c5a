"""The documents of commands that are about models: describe of a model, pack, export, validate, new."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ...fmi import Interface
    from ...packing import Exported, Packed
    from ...validation import Report


@dataclass(frozen=True)
class VariableDocument:
    """A variable of an FMU.

    Attributes:
        minimum, maximum: in its unit. choices: of an enumeration, name and value.
        depends_on: the inputs that an output depends on directly; null where the FMU does not say.
        optional, read_where: of an input, whether it may stay open, and the flag under which it is read.
    """

    name: str
    causality: str
    variability: str
    type: str
    unit: str | None
    start: Any
    minimum: float | None
    maximum: float | None
    choices: dict[str, int]
    description: str
    depends_on: list[str] | None
    optional: bool
    read_where: str | None


@dataclass(frozen=True)
class ModelDocument:
    """A component or an FMU: where it comes from, what it can, its variables. `facts` are those of the tables.

    Attributes:
        facts: by name, as text. default_step: in s. kind: always "model".
    """

    model: str
    description: str
    facts: dict[str, str]
    default_step: float | None
    can_save_state: bool
    warnings: list[str]
    variables: list[VariableDocument]
    kind: str = "model"


def describe_document(interface: Interface, facts: dict[str, str]) -> ModelDocument:
    """The document of a model.

    Args:
        interface: of its FMU.
        facts: what is told of it above its variables.
    """
    inputs = interface.inputs
    variables = [
        VariableDocument(
            name,
            v.causality,
            v.variability,
            v.fmi_type or v.type,
            v.unit,
            v.start,
            v.minimum,
            v.maximum,
            dict(v.choices),
            v.description,
            None if v.dependencies is None else sorted(v.dependencies & inputs),
            name in interface.optional_inputs,
            interface.flags.get(name),
        )
        for name, v in interface.variables.items()
    ]
    told = {label: fact for label, fact in facts.items() if label and fact}
    model = interface.model
    return ModelDocument(
        model,
        interface.description,
        told,
        interface.default_step,
        interface.can_save_state,
        list(interface.warnings),
        variables,
    )


@dataclass(frozen=True)
class PackDocument:
    """An FMU that holds a scenario: its file, how many FMUs are in it, what it shows, and for which platforms."""

    file: str
    instances: int
    exposed: list[str]
    platforms: list[str]
    notes: list[str]


def pack_document(packed: Packed, instances: int) -> PackDocument:
    """The document of an FMU that was packed."""
    names = [each.name for each in packed.exposed]
    return PackDocument(str(packed.path), instances, names, list(packed.platforms), list(packed.notes))


@dataclass(frozen=True)
class ExportDocument:
    """A scenario written for other tools: the files, how many instances are in it, and what a user should know."""

    files: list[str]
    instances: int
    notes: list[str]


def export_document(exported: Exported) -> ExportDocument:
    """The document of a scenario that was written for other tools."""
    return ExportDocument(list(map(str, exported.files)), exported.parts, list(exported.notes))


@dataclass(frozen=True)
class ProbeDocument:
    """One thing that was looked at or tried, its verdict, and what was found."""

    check: str
    verdict: str
    detail: str


@dataclass(frozen=True)
class ValidateDocument:
    """What was found about an FMU: a verdict (pass, note, warning, fail, skipped) for each check."""

    file: str
    model: str
    passed: bool
    findings: list[ProbeDocument]


def validate_document(report: Report) -> ValidateDocument:
    """The document of a report."""
    findings = [ProbeDocument(each.check, each.verdict, each.detail) for each in report.findings]
    return ValidateDocument(str(report.path), report.interface.model, report.passed, findings)


@dataclass(frozen=True)
class NewDocument:
    """A controller that was written: its file and its class."""

    file: str
    name: str


def new_document(path: Path, name: str) -> NewDocument:
    """The document of a new file."""
    return NewDocument(str(path), name)
