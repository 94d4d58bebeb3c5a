"""The figures of a linear model: eigenvalues, step responses, Bode diagram, string stability."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from ...fmus.units import BASE
from ...fmus.units import parse as parse_unit
from ..figures import COLOURS, DASHES, FORMATS, bracketed, colour, legend, page
from ..names import SignalName
from ..times import digits
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
    format: str = FORMATS[0],
    dpi: float | None = None,
) -> list[Path]:
    """Draw all figures into a directory.

    Args:
        model: the linear model.
        stability: its modes.
        passings: its string stability; empty where there are no trains in a row.
        directory: it exists.
        duration: of the step responses, s.
        format: one of `figures.FORMATS`.
        dpi: dots per inch.

    Returns:
        The files.
    """
    page = partial(_page, directory, format=format, dpi=dpi)
    title = f"{model.system.provenance.title or model.system.provenance.name}\nLinear at t = {digits(model.time)} s"
    paths = [_poles(stability, title, page)]
    if not model.inputs:
        return paths
    for index in _stepped_inputs(model):
        paths.append(_steps(model, index, duration or default_duration(model), title, page))
    paths.append(_bode(model, title, page))
    if passings:
        paths.append(_string(model, passings, title, page))
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


def _shades(families: dict[str, list[tuple[str, Array, str]]]) -> dict[str, Any]:
    """The colour of each label: the same for a train in all panels, and for the gap in front of it."""
    labels = [label for curves in families.values() for label, _, _ in curves]
    things = {label: re.split(r" – ", label)[-1].split()[-1] for label in labels}
    numbered = sorted({thing for thing in things.values() if thing.isdigit()}, key=int)
    order = {thing: k for k, thing in enumerate(numbered)}
    for thing in things.values():
        order.setdefault(thing, len(order))
    return {label: colour(order[thing], len(order)) for label, thing in things.items()}


class _Page(Protocol):
    """Opens a page: its file's name without ending, its title and the number of its panels."""

    def __call__(self, name: str, title: str, panels: int) -> AbstractContextManager[tuple[Path, list[Axes]]]: ...


@contextmanager
def _page(
    directory: Path, name: str, title: str, panels: int, *, format: str, dpi: float | None
) -> Iterator[tuple[Path, list[Axes]]]:
    path = directory / f"{name}.{format}"
    height = 4.2 if panels == 1 else 1.0 + 2.2 * panels
    with page(title, panels, path, size=(8.5, height), title_size=10.5, dpi=dpi) as axes:
        yield path, axes


def _legend(ax: Axes, count: int) -> None:
    if count > 1 and ax.get_legend_handles_labels()[0]:
        legend(ax)


def _poles(stability: Stability, title: str, page: _Page) -> Path:
    """Eigenvalues in the s plane; of a pair both. Modes that are gone after one step have no place in it."""
    with page("eigenvalues", f"{title}: eigenvalues", 1) as (path, axes):
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


def _steps(model: Linearization, index: int, duration: float, title: str, page: _Page) -> Path:
    name, unit = model.inputs[index], model.units.get(model.inputs[index], "")
    families = _families(model)
    times, found = step_response(model, index, duration)
    file = f"step-{re.sub(r'[^a-z0-9]+', '-', name.lower()).strip('-')}"
    shades = _shades(families)
    with page(file, f"{title}: step of 1 {unit} at {name}", len(families)) as (path, axes):
        for ax, (panel, curves) in zip(axes, families.items(), strict=True):
            for label, row, _ in curves:
                style: Any = {"drawstyle": "steps-post"} if model.step is not None and len(times) < 200 else {}
                ax.plot(times, row @ found, label=label, color=shades[label], **style)
            ax.set_ylabel(f"{panel} {bracketed(curves[0][2])}".rstrip())
            ax.margins(x=0.01)
            _legend(ax, len(curves))
        axes[-1].set_xlabel("time after the step [s]")
    return path


def _bode(model: Linearization, title: str, page: _Page) -> Path:
    index, frequencies = default_input(model), default_frequencies(model)
    response = FrequencyResponse(model)(frequencies, index)
    families = {k: v for k, v in _families(model).items() if any(np.abs(row @ response).any() for _, row, _ in v)}
    shades = _shades(families)
    with page("bode", f"{title}: frequency response to {model.inputs[index]}", 2 * len(families)) as (path, axes):
        for k, (panel, curves) in enumerate(families.items()):
            size, phase = axes[2 * k : 2 * k + 2]
            for label, row, _ in curves:
                g = row @ response
                if not np.abs(g).any():
                    continue
                style: Any = {"label": label, "color": shades[label], "linestyle": DASHES[0]}
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


def _string(model: Linearization, passings: Sequence[Passing], title: str, page: _Page) -> Path:
    quantities = list(dict.fromkeys(passing.quantity for passing in passings))
    heading = f"{title}: string stability under {model.inputs[default_input(model)]}"
    with page("string-stability", heading, len(quantities)) as (path, axes):
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
