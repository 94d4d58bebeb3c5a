"""The interface of an FMU as tables, and what was found about it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

from rich.console import Console
from rich.text import Text

from ...fmi import Interface, Variable
from ...validation import Report
from .console import say
from .listing import show_listing
from .tables import table, verdict


def show_model(out: Console, interface: Interface, facts: Mapping[str, str]) -> None:
    """What a model is, a fact a line, what is wrong with it, and its variables."""
    say(out, interface.model, "bold")
    for label, fact in facts.items():
        if fact:
            say(out, f"{label}: {fact}" if label else fact)
    for warning in interface.warnings:
        say(out, f"warning: {warning}", "yellow")
    show_interface(out, interface)


def show_interface(out: Console, interface: Interface) -> None:
    """Every variable of an FMU by causality: unit, start, and what an output depends on directly."""
    for causality, title in (
        ("parameter", "Parameters"),
        ("calculatedParameter", "Calculated parameters"),
        ("structuralParameter", "Structural parameters (they keep their values)"),
        ("input", "Inputs"),
        ("output", "Outputs"),
        ("local", "Local variables"),
        ("independent", "Independent variable"),
    ):
        variables = interface.of(causality)
        if variables:
            _show_variables(out, title, variables, interface)


def _show_variables(out: Console, title: str, variables: Sequence[Variable], interface: Interface) -> None:
    starts = any(v.start is not None for v in variables)
    outputs = title == "Outputs"
    columns = ["name", "type", "unit", *(["start"] if starts else []), "description"]
    columns += ["depends directly on"] if outputs else []
    places = {v.name: k for k, v in enumerate(interface.of("input"))} if outputs else {}
    rows = []
    for v in variables:
        cells = [v.name, v.fmi_type or v.type, v.unit or ""]
        cells += ["" if v.start is None else _start(v.start)] if starts else []
        hint = "optional" if v.name in interface.optional_inputs else ""
        hint = f"read where {interface.flags[v.name]}" if v.name in interface.flags else hint
        hint = f"{hint}, not used".strip(", ") if v.name in interface.unused_inputs else hint
        hint = "tunable" if v.causality == "parameter" and v.variability == "tunable" else hint
        hint = ", ".join([*([hint] if hint else []), *(f"{name} = {value}" for name, value in v.choices)])
        cells += [f"{v.description} ({hint})".strip() if hint else v.description]
        if outputs:
            cells.append(_dependencies(v, places))
        rows.append(cells)
    show_listing(out, title, columns, rows, right=("start",), fold=("name", "description", "depends directly on"))


def _dependencies(output: Variable, inputs: Mapping[str, int]) -> str:
    if output.dependencies is None:
        return "not said"
    return ", ".join(sorted(output.dependencies & inputs.keys(), key=inputs.__getitem__)) or "no input"


def _start(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:.10g}" if isinstance(value, float) else str(value)


def show_report(out: Console, report: Report, quiet: bool = False) -> None:
    """One row a check, and the verdict in a line; when quiet, only what is wrong."""
    made = table("", ("check", "verdict", "what was found"), fold=("what was found",))
    shown = [each for each in report.findings if not quiet or each.verdict in ("warning", "fail")]
    for finding in shown:
        made.add_row(Text(finding.check), verdict(finding.verdict), Text(finding.detail))
    if quiet and not shown:
        return
    say(out, f"{report.path}: {report.interface.model}", "bold")
    out.print(made)
    found = Counter(finding.verdict for finding in report.findings)
    told = ", ".join(f"{found[word]} {word}" for word in ("pass", "note", "warning", "fail", "skipped") if found[word])
    say(out, f"{'valid' if report.passed else 'not valid'}: {told}", "green" if report.passed else "bold red")
