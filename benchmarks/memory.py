"""Memory of this process, as Linux tells it."""

from __future__ import annotations

import resource
from pathlib import Path


def resident() -> float:
    """Memory of this process in KB, as Linux tells it."""
    statm = Path("/proc/self/statm")
    return int(statm.read_text().split()[1]) * resource.getpagesize() / 1024 if statm.exists() else 0.0


def forget_peak() -> None:
    """Let `peak` begin anew, where Linux can."""
    forget = Path("/proc/self/clear_refs")
    if forget.exists():
        forget.write_text("5")


def peak() -> float:
    """The most memory of this process since then in KB, as Linux tells it."""
    status = Path("/proc/self/status")
    lines = status.read_text().splitlines() if status.exists() else []
    return next((float(line.split()[1]) for line in lines if line.startswith("VmHWM")), 0.0)
