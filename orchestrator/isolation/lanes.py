"""Whether there are lanes here, through which the compiled step loop calls isolated FMUs, and where they stand."""

from __future__ import annotations

import os
from collections.abc import Iterable

from .messages import HEAD

__all__ = ["HAS_LANES", "LANE_SIZE", "lane", "layout", "spin_time"]

try:
    from . import lane
except ImportError:  # installed without a C compiler
    lane = None  # type: ignore[assignment]

HAS_LANES = hasattr(lane, "Lane")
"""They need a C compiler, and Linux."""
LANE_SIZE = lane.SIZE if HAS_LANES else 0
_SPIN = 50e-6
"""Wall time in s for which either side watches for the other's next before it sleeps: longer than a hand-over takes."""
_LINE = 64
"""Bytes of a line of the cache, where a lane begins."""


def layout(rooms: Iterable[int]) -> list[int]:
    """Where in their memory, in bytes, instances with room for so many numbers begin; and then the lane."""
    begins = [0]
    for cells in rooms:
        begins.append(begins[-1] + -(-(HEAD + 8 * cells) // _LINE) * _LINE)
    return begins


def spin_time() -> float:
    """How long to watch, in s: not at all on a single core, which that would keep from the other."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else 1
    return _SPIN if cores > 1 else 0.0
