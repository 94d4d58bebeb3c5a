"""The interface of an FMU as tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from rich.console import Console
from rich.table import Table
from rich.text import Text

from ...fmi import Interface, Variable
from .tables import table


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
            out.print(_variables(title, variables, interface))


def _variables(title: str, variables: Sequence[Variable], interface: Interface) -> Table:
    starts = any(v.start is not None for v in variables)
    outputs = title == "Outputs"
    columns = ["name", "type", "unit", *(["start"] if starts else []), "description"]
    columns += ["depends directly on"] if outputs else []
    made = table(title, columns, right=("start",), fold=("name", "description", "depends directly on"))
    places = {v.name: k for k, v in enumerate(interface.of("input"))}
    for v in variables:
        cells = [v.name, v.fmi_type or v.type, v.unit or ""]
        cells += ["" if v.start is None else _start(v.start)] if starts else []
        hint = "optional" if v.name in interface.optional_inputs else ""
        hint = f"{hint}, not used".strip(", ") if v.name in interface.unused_inputs else hint
        hint = "tunable" if v.causality == "parameter" and v.variability == "tunable" else hint
        hint = ", ".join([*([hint] if hint else []), *(f"{name} = {value}" for name, value in v.choices)])
        cells += [f"{v.description} ({hint})".strip() if hint else v.description]
        if outputs:
            cells.append(_dependencies(v, places))
        made.add_row(*map(Text, cells))
    return made


def _dependencies(output: Variable, inputs: Mapping[str, int]) -> str:
    if output.dependencies is None:
        return "not said"
    return ", ".join(sorted(output.dependencies & inputs.keys(), key=inputs.__getitem__)) or "no input"


def _start(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:.10g}" if isinstance(value, float) else str(value)
