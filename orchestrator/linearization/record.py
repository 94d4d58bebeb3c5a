"""A linear model as a file: ``linear.json``."""

from __future__ import annotations

import importlib.metadata
import json
import math
from collections.abc import Sequence
from pathlib import Path

from .. import world
from .closed_loop import Linearization
from .modes import Stability
from .responses import Passing


def write_linear(
    directory: Path,
    model: Linearization,
    stability: Stability,
    passings: Sequence[Passing],
    figures: Sequence[Path] = (),
) -> Path:
    """Write everything as ``linear.json``; the numbers read back to the same bits.

    Args:
        directory: it exists.
        model: the linear model.
        stability: its modes.
        passings: its string stability; empty where there are no trains in a row.
        figures: those that were drawn of it.

    Returns:
        The file.
    """
    system = model.system
    content = {
        "scenario": system.provenance.name,
        "preset": system.provenance.preset,
        "modified": system.provenance.modified,
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
        "figures": [path.name for path in figures],
        "version": importlib.metadata.version("railcosim"),
    }
    path = directory / "linear.json"
    text = json.dumps(content, indent=1, ensure_ascii=False) + "\n"
    world.write_text(path, text, encoding="utf-8", errors="backslashreplace")
    return path


def _finite(value: float) -> float | str:
    """JSON has no infinity and no NaN: they become text."""
    return value if math.isfinite(value) else repr(value)
