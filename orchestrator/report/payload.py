"""Signals as a page carries them: single precision, compressed, each unpacked when it is first looked at."""

from __future__ import annotations

import base64
import zlib
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

_LEVEL = 1
"""Higher ones make a page a twentieth smaller and take three times as long."""


@dataclass(frozen=True)
class Packed:
    """One column.

    Attributes:
        text: base64 of the compressed (RFC 1951) little-endian ``float32``.
        offset: what was taken off before rounding, so that far positions keep their digits.
        loss: the greatest difference to the full number, in ranges of the column.
    """

    text: str
    offset: float
    loss: float


def pack(values: NDArray[Any]) -> Packed:
    """Pack a column of numbers; what is not finite stays so.

    Args:
        values: shape (points,).
    """
    full = np.asarray(values, dtype=np.float64)
    finite = full[np.isfinite(full)]
    low, high = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 0.0)
    offset = 0.5 * low + 0.5 * high
    with np.errstate(over="ignore"):
        rounded = (full - offset).astype("<f4")
    back = rounded[np.isfinite(full)].astype(np.float64) + offset
    loss = float(np.abs(back - finite).max(initial=0.0))
    half = 0.5 * high - 0.5 * low
    loss = 0.5 * loss / half if half else 0.0
    squeeze = zlib.compressobj(_LEVEL, wbits=-15)
    # Bytes of like weight side by side: neighbouring points share all but the last.
    shuffled = np.ascontiguousarray(rounded.view(np.uint8).reshape(-1, 4).T)
    packed = squeeze.compress(shuffled.data) + squeeze.flush()
    return Packed(base64.b64encode(packed).decode(), offset, loss)


def is_even(time: NDArray[np.float64]) -> bool:
    """Whether the points of time are so evenly spaced that first, last and number tell them."""
    if len(time) < 2:
        return True
    spaced = np.linspace(time[0], time[-1], len(time))
    return bool(np.abs(spaced - time).max() <= 1e-6 * (time[1] - time[0]))
