"""Where in an author's own file something is: what errors about equations point at."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

_OURS = Path(__file__).parent
_NUMPY = Path(np.__file__).parent


def line_of(error: BaseException, *others: Path) -> str:
    """The innermost line of an author that an exception passed through, as ``file.py:12, 'text'``; or nothing.

    Args:
        error: as caught.
        others: further folders whose files are never to blame, beside this one and NumPy's.
    """
    for frame in reversed(traceback.extract_tb(error.__traceback__)):
        path = Path(frame.filename)
        if path.parent not in (_OURS, *others) and not path.is_relative_to(_NUMPY):
            return f"{path.name}:{frame.lineno}{f', {frame.line!r}' if frame.line else ''}"
    return ""


def place_of(function: Callable[..., Any] | None) -> str:
    """Where a method is written, as ``file.py:12``; nothing where it is not Python's."""
    code = getattr(function, "__code__", None)
    return f"{Path(code.co_filename).name}:{code.co_firstlineno}" if code else ""
