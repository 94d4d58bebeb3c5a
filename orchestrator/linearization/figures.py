"""The figures of a linear model: eigenvalues, step responses, Bode diagram, string stability."""

from __future__ import annotations

import itertools
import re
from collections.abc import Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...fmus.units import BASE
from ...fmus.units import parse as parse_unit
from ..figures import COLOURS, DASHES, bracketed, colour, legend, page
from ..names import SignalName
from .blocks import Array
from .closed_loop import Linearization
from .modes import Stability
from .responses import FrequencyResponse, Passing, default_duration, default_frequencies, default_input, step_response

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_MOST_FAMILIES = 4
_MOST_STEPS = 6


def draw_linear(
    model: Linearization,
    stability: Stability,
    passings: Sequence[Passing],
    directory: Path,
    *,
    duration: float | None = None,
) -> list[Path]:
    """Draw all figures into a directory.

    Args:
        model: the linear model.
        stability: its modes.
        passings: its string stability; empty where there are no trains in a row.
        directory: it exists.
        duration: of the step responses, s.

    Returns:
        The files.
    """
    title = f"{model.system.provenance.title or model.system.provenance.name}\nLinear at t = {model.time:g} s"
    paths = [_poles(stability, title, directory / "eigenvalues.png")]
    if not model.inputs:
        return paths
    for index in _stepped_inputs(model):
        paths.append(_steps(model, index, duration or default_duration(model), title, directory))
    paths.append(_bode(model, title, directory / "bode.png"))
    if passings:
        paths.append(_string(model, passings, title, directory / "string-stability.png"))
    return paths


def _stepped_inputs(model: Linearization) -> list[int]:
    """The first of each family of inputs: what a push on the first train does, and a new target."""
    first: dict[str, int] = {}
    for k, name in enumerate(model.inputs):
        first.setdefault(str(SignalName.parse(name).family), k)
    return list(first.values())[:_MOST_STEPS]


def _families(model: Linearization) -> dict[str, list[tuple[str, Array, str]]]:
    """Curves by panel: (label, row over the outputs, unit); gaps in place of the positions of trains in a row."""
    found: dict[str, list[tuple[str, Array, str]]] = {}
    rows = np.eye(len(model.outputs))
    for name, row in zip(model.outputs, rows, strict=True):
        signal, unit = SignalName.parse(name), model.units.get(name, "")
        panel = f"{signal.group} {signal.array}"
        label = name if "[" in signal.variable else signal.instance.replace("[", " ").replace("]", "")
        found.setdefault(panel, []).append((label, row, unit))
    for panel in [panel for panel in found if panel.endswith(" position")]:
        curves = found[panel]
        if len(curves) > 1 and all(re.fullmatch(r"\w+ \d+", label) for label, _, _ in curves):
            gaps = [
                (f"{a} – {b.split()[-1]}", row - other, unit)
                for (a, row, unit), (b, other, _) in itertools.pairwise(curves)
            ]
            found = {
                (f"{k.split()[0]} gap" if k == panel else k): (gaps if k == panel else v) for k, v in found.items()
            }
    return dict(list(found.items())[:_MOST_FAMILIES])


def _page(title: str, panels: int, path: Path) -> AbstractContextManager[list[Axes]]:
    height = 4.2 if panels == 1 else 1.0 + 2.2 * panels
    return page(title, panels, path, size=(8.5, height), title_size=10.5)


def _legend(ax: Axes, count: int) -> None:
    if count > 1 and ax.get_legend_handles_labels()[0]:
        legend(ax, count)


def _poles(stability: Stability, title: str, path: Path) -> Path:
    """Eigenvalues in the s plane; of a pair both. Modes that are gone after one step have no place in it."""
    with _page(f"{title}: eigenvalues", 1, path) as axes:
        ax = axes[0]
        for seen, mark, label in ((True, "x", "seen in the outputs"), (False, "+", "not seen")):
            poles = [m.pole for m in stability.modes if m.seen == seen and abs(m.pole) < np.inf]
            both = np.array(poles + [p.conjugate() for p in poles if p.imag])
            if len(both):
                ax.plot(both.real, both.imag, mark, color=COLOURS[0 if seen else 1], markersize=8, label=label)
        ax.axvline(0.0, color="#555555", linewidth=1.0)
        ax.axhline(0.0, color="#555555", linewidth=0.6)
        ax.margins(0.08)
        if all(abs(m.pole.imag) < 1e-9 for m in stability.modes):
            ax.set_ylim(-0.1, 0.1)
        ax.set_xlabel("real part [1/s]")
        ax.set_ylabel("imaginary part [rad/s]")
        _legend(ax, 2)
    return path


def _steps(model: Linearization, index: int, duration: float, title: str, directory: Path) -> Path:
    name, unit = model.inputs[index], model.units.get(model.inputs[index], "")
    families = _families(model)
    times, found = step_response(model, index, duration)
    path = directory / f"step-{re.sub(r'[^a-z0-9]+', '-', name.lower()).strip('-')}.png"
    with _page(f"{title}: step of 1 {unit} at {name}", len(families), path) as axes:
        for ax, (panel, curves) in zip(axes, families.items(), strict=True):
            for k, (label, row, _) in enumerate(curves):
                style: Any = {"drawstyle": "steps-post"} if model.step is not None and len(times) < 200 else {}
                ax.plot(times, row @ found, label=label, color=colour(k, len(curves)), **style)
            ax.set_ylabel(f"{panel} {bracketed(curves[0][2])}".rstrip())
            ax.margins(x=0.01)
            _legend(ax, len(curves))
        axes[-1].set_xlabel("time after the step [s]")
    return path


def _bode(model: Linearization, title: str, path: Path) -> Path:
    index, frequencies = default_input(model), default_frequencies(model)
    response = FrequencyResponse(model)(frequencies, index)
    families = {k: v for k, v in _families(model).items() if any(np.abs(row @ response).any() for _, row, _ in v)}
    with _page(f"{title}: frequency response to {model.inputs[index]}", 2 * len(families), path) as axes:
        for k, (panel, curves) in enumerate(families.items()):
            size, phase = axes[2 * k : 2 * k + 2]
            for n, (label, row, _) in enumerate(curves):
                g = row @ response
                if not np.abs(g).any():
                    continue
                style: Any = {"label": label, "color": colour(n, len(curves)), "linestyle": DASHES[0]}
                size.loglog(frequencies, np.abs(g), **style)
                phase.semilogx(frequencies, np.degrees(np.unwrap(np.angle(g))), **style)
            ratio = unit_of_ratio(curves[0][2], model.units.get(model.inputs[index], ""))
            size.set_ylabel(f"{panel}\n|G| {bracketed(ratio)}".rstrip())
            phase.set_ylabel("phase [°]")
            _legend(size, len(curves))
            for ax in (size, phase):
                ax.margins(x=0.01)
        axes[-1].set_xlabel("angular frequency [rad/s]")
    return path


def unit_of_ratio(output: str, input: str) -> str:
    """The unit of an output over an input, in lowest terms: ``s`` for m/s over m/s2; ``1`` where both are the same."""
    if output == input or not input:
        return "1" if input else output
    try:
        above, below = parse_unit(output or "1"), parse_unit(input)
    except ValueError:  # a unit of another maker
        return f"({output or '1'})/({input})"
    if (above.factor, below.factor) != (1.0, 1.0):
        return f"({output or '1'})/({input})"
    powers = {base: a - b for base, a, b in zip(BASE, above.exponents, below.exponents, strict=True)}
    top, bottom = (
        [f"{base}{abs(power) if abs(power) > 1 else ''}" for base, power in powers.items() if sign * power > 0]
        for sign in (1, -1)
    )
    lower = ".".join(bottom) if len(bottom) < 2 else f"({'.'.join(bottom)})"
    return "/".join([".".join(top) or "1", *([lower] if lower else [])])


def _string(model: Linearization, passings: Sequence[Passing], title: str, path: Path) -> Path:
    quantities = list(dict.fromkeys(passing.quantity for passing in passings))
    heading = f"{title}: string stability under {model.inputs[default_input(model)]}"
    with _page(heading, len(quantities), path) as axes:
        for ax, quantity in zip(axes, quantities, strict=True):
            mine = [passing for passing in passings if passing.quantity == quantity]
            for k, passing in enumerate(mine):
                shade = colour(k, len(mine))
                ax.loglog(passing.frequencies, passing.size, label=passing.pair, color=shade)
                ax.plot(passing.at, passing.peak, "o", color=shade, markersize=4)
            ax.axhline(1.0, color="#444444", linewidth=1.2, linestyle=(0, (6, 3)))
            ax.set_ylabel(f"|T| of {quantity}")
            ax.margins(x=0.01)
            _legend(ax, max(2, len(mine)))
        axes[-1].set_xlabel("angular frequency [rad/s]")
    return path
