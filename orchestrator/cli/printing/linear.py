"""A linear model in words."""

from __future__ import annotations

import math

from rich.console import Console
from rich.table import Table
from rich.text import Text

from ...linearization import Linearization, Mode, Passing, Stability, default_input
from ...times import digits
from .console import say, show_notes
from .tables import table

_MOST_MODES = 40


def show_linear(out: Console, model: Linearization, stability: Stability, passings: list[Passing]) -> None:
    """What a user asked for: is it stable, how fast, and does a disturbance grow from train to train."""
    say(out, model.system.provenance.title or model.system.provenance.name, "bold")
    kind = "continuous" if model.step is None else f"one step of {digits(model.step)} s"
    facts = f"linear at t = {digits(model.time)} s; {kind}; {len(model.states)} states"
    say(out, f"{facts}; inputs: {_short(model.inputs)}; outputs: {_short(model.outputs)}", "dim")
    show_notes(out, model.notes)
    out.print(_modes_table(stability))
    if passings:
        out.print(_string_table(model, passings))
    out.print()
    good = stability.verdict == "stable"
    say(out, stability.text, "green" if good else "bold red")
    for variable, mode in stability.slowest_by_variable.items():
        say(out, f"slowest mode of {variable}: time constant {_seconds(mode.time_constant)}")
    for quantity in dict.fromkeys(passing.quantity for passing in passings):
        mine = [passing for passing in passings if passing.quantity == quantity]
        worst = max(mine, key=lambda passing: passing.peak)
        text = f"|T| of {quantity} is at most {worst.peak:.6g} ({worst.pair}, at {worst.at:.4g} rad/s)"
        if worst.holds:
            say(out, f"string stable under {model.inputs[default_input(model)]}: {text}", "green")
        else:
            say(out, f"not string stable under {model.inputs[default_input(model)]}: {text}", "bold red")


def _short(names: tuple[str, ...]) -> str:
    families = dict.fromkeys(
        f"{name.partition('[')[0]}[:]{name.partition(']')[2]}" if "[" in name else name for name in names
    )
    listed = list(families)
    return ", ".join(listed[:6]) + (", ..." if len(listed) > 6 else "") if listed else "none"


def _seconds(value: float) -> str:
    return f"{value:.4g} s" if value < 1e4 else f"{value:.4g} s ({value / 3600:.3g} h)"


def _modes_table(stability: Stability) -> Table:
    numbers = ("eigenvalue [1/s]", "times", "damping", "frequency [rad/s]", "time constant [s]")
    made = table("Modes, slowest first", (*numbers, "what moves most"), right=numbers, fold=("what moves most",))
    for mode in stability.modes[:_MOST_MODES]:
        what = ", ".join(mode.states) + ("" if mode.seen else " (not seen in the outputs)")
        made.add_row(*_mode_cells(mode), Text(what, style="" if mode.seen else "dim"))
    left = len(stability.modes) - _MOST_MODES
    if left > 0:
        made.add_row("...", "", "", "", "", f"{left} faster ones; all are in linear.json")
    return made


def _mode_cells(mode: Mode) -> list[str]:
    if math.isinf(mode.pole.real):
        return ["gone in a step", str(mode.count), "-", "-", "0"]
    sign = f" ± {mode.pole.imag:.4g}j" if mode.pole.imag else ""
    constant = "stays" if mode.is_neutral else f"{mode.time_constant:.4g}"
    damping = "-" if math.isnan(mode.damping) else f"{mode.damping:.3f}"
    return [f"{mode.pole.real:.4g}{sign}", str(mode.count), damping, f"{mode.frequency:.4g}", constant]


def _string_table(model: Linearization, passings: list[Passing]) -> Table:
    title = f"String stability under {model.inputs[default_input(model)]}: |T(jw)| from one to the next"
    made = table(title, ("quantity", "from, to", "peak", "at [rad/s]", ""), right=("peak", "at [rad/s]"))
    for passing in passings:
        first, second = passing.pair.split(" to ")[::-1]
        verdict = Text("holds", style="green") if passing.holds else Text("grows", style="bold red")
        made.add_row(passing.quantity, f"{first}, {second}", f"{passing.peak:.6g}", f"{passing.at:.4g}", verdict)
    return made
