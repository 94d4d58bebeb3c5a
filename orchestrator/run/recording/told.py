"""What a run has written down as JSON, read back from a directory that anybody may have made."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from ... import world

MOST = 256 << 20
"""Bytes that are read: a run of a million variables writes less, and in memory it is twenty times as much at worst."""


def read_json(path: Path) -> Any:
    """What a file says.

    Raises:
        OSError: it cannot be read.
        ValueError: it is no JSON, too large, or nested too deep.
    """
    check_size(path.name, world.stat(path).st_size)
    try:
        return json.loads(world.read_text(path, encoding="utf-8"))
    except RecursionError:
        raise ValueError(f"{path.name} is nested too deep") from None


def check_size(name: str, size: int) -> None:
    """Refuse what no run has written.

    Raises:
        ValueError: it is too large.
    """
    if size > MOST:
        raise ValueError(f"{name} has {size >> 20} MiB, and no run writes more than {MOST >> 20}")
