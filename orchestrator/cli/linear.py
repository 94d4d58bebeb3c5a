"""A linear model in words and as a file: ``linear.json``."""

from __future__ import annotations

import importlib.metadata
import json
import math
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from ..linearization import Linearization, Mode, Passing, Stability, default_input
from . import console

_PLAIN: Any = {"box": None, "pad_edge": False, "padding": (0, 2, 0, 0), "header_style": "underline"}
_MOST_MODES = 40


def show_linear(out: Console, model: Linearization, stability: Stability, passings: list[Passing]) -> None:
    """What a user asked for: is it stable, how fast, and does a disturbance grow from train to train."""
    console.say(out, model.system.title or model.system.name, "bold")
    kind = "continuous" if model.step is None else f"one step of {model.step:g} s"
    facts = f"linear at t = {model.time:g} s; {kind}; {len(model.states)} states"
    console.say(out, f"{facts}; inputs: {_short(model.inputs)}; outputs: {_short(model.outputs)}", "dim")
    for note in console.folded(model.notes):
        console.say(out, f"note: {note}", "yellow")
    out.print(_modes_table(stability))
    if passings:
        out.print(_string_table(model, passings))
    out.print()
    good = stability.verdict == "stable"
    console.say(out, stability.text, "green" if good else "bold red")
    for variable, mode in stability.slowest_by_variable.items():
        console.say(out, f"slowest mode of {variable}: time constant {_seconds(mode.time_constant)}")
    for quantity in dict.fromkeys(passing.quantity for passing in passings):
        mine = [passing for passing in passings if passing.quantity == quantity]
        worst = max(mine, key=lambda passing: passing.peak)
        text = f"|T| of {quantity} is at most {worst.peak:.6g} ({worst.pair}, at {worst.at:.4g} rad/s)"
        if worst.holds:
            console.say(out, f"string stable under {model.inputs[default_input(model)]}: {text}", "green")
        else:
            console.say(out, f"not string stable under {model.inputs[default_input(model)]}: {text}", "bold red")


def _short(names: tuple[str, ...]) -> str:
    families = dict.fromkeys(
        f"{name.partition('[')[0]}[:]{name.partition(']')[2]}" if "[" in name else name for name in names
    )
    listed = list(families)
    return ", ".join(listed[:6]) + (", ..." if len(listed) > 6 else "") if listed else "none"


def _seconds(value: float) -> str:
    return f"{value:.4g} s" if value < 1e4 else f"{value:.4g} s ({value / 3600:.3g} h)"


def _modes_table(stability: Stability) -> Table:
    table = Table(title="\nModes, slowest first", title_justify="left", title_style="bold", **_PLAIN)
    for head in ("eigenvalue [1/s]", "times", "damping", "frequency [rad/s]", "time constant [s]"):
        table.add_column(Text(head), justify="right", no_wrap=True)
    table.add_column("what moves most", overflow="fold")
    for mode in stability.modes[:_MOST_MODES]:
        what = ", ".join(mode.states) + ("" if mode.seen else " (not seen in the outputs)")
        table.add_row(*_mode_cells(mode), Text(what, style="" if mode.seen else "dim"))
    left = len(stability.modes) - _MOST_MODES
    if left > 0:
        table.add_row("...", "", "", "", "", f"{left} faster ones; all are in linear.json")
    return table


def _mode_cells(mode: Mode) -> list[str]:
    if math.isinf(mode.pole.real):
        return ["gone in a step", str(mode.count), "-", "-", "0"]
    sign = f" ± {mode.pole.imag:.4g}j" if mode.pole.imag else ""
    constant = "stays" if mode.is_neutral else f"{mode.time_constant:.4g}"
    damping = "-" if math.isnan(mode.damping) else f"{mode.damping:.3f}"
    return [f"{mode.pole.real:.4g}{sign}", str(mode.count), damping, f"{mode.frequency:.4g}", constant]


def _string_table(model: Linearization, passings: list[Passing]) -> Table:
    title = f"\nString stability under {model.inputs[default_input(model)]}: |T(jw)| from one to the next"
    table = Table(title=Text(title), title_justify="left", title_style="bold", **_PLAIN)
    for head in ("quantity", "from, to", "peak", "at [rad/s]", ""):
        table.add_column(Text(head), justify="right" if head in ("peak", "at [rad/s]") else "left", no_wrap=True)
    for passing in passings:
        first, second = passing.pair.split(" to ")[::-1]
        verdict = Text("holds", style="green") if passing.holds else Text("grows", style="bold red")
        table.add_row(passing.quantity, f"{first}, {second}", f"{passing.peak:.6g}", f"{passing.at:.4g}", verdict)
    return table


def write_linear(directory: Path, model: Linearization, stability: Stability, passings: list[Passing]) -> Path:
    """Write everything as ``linear.json``; the numbers read back to the same bits."""
    system = model.system
    content = {
        "scenario": system.name,
        "preset": system.preset,
        "modified": system.modified,
        "time": model.time,
        "step": model.step,
        "states": model.states,
        "inputs": model.inputs,
        "outputs": model.outputs,
        "units": dict(model.units),
        "values": dict(model.values),
        "A": model.a.tolist(),
        "B": model.b.tolist(),
        "C": model.c.tolist(),
        "D": model.d.tolist(),
        "verdict": stability.verdict,
        "text": stability.text,
        "modes": [
            {
                "real": _finite(m.pole.real),
                "imaginary": m.pole.imag,
                "count": m.count,
                "damping": _finite(m.damping),
                "frequency": _finite(m.frequency),
                "time_constant": _finite(m.time_constant),
                "states": m.states,
                "seen": m.seen,
            }
            for m in stability.modes
        ],
        "string_stability": [
            {"quantity": p.quantity, "pair": p.pair, "peak": p.peak, "at": p.at, "holds": p.holds} for p in passings
        ],
        "notes": model.notes,
        "version": importlib.metadata.version("railcosim"),
    }
    path = directory / "linear.json"
    text = json.dumps(content, indent=1, ensure_ascii=False) + "\n"
    path.write_text(text, encoding="utf-8", errors="backslashreplace")
    return path


def _finite(value: float) -> float | str:
    """JSON has no infinity and no NaN: they become text."""
    return value if math.isfinite(value) else repr(value)
