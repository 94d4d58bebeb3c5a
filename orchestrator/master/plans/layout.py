"""What the kernel's arrays hold, and its numbers for what is to be done: as ``native/kernel.h`` has them."""

from __future__ import annotations

from enum import IntEnum
from typing import Any

import numpy as np


class Kind(IntEnum):
    """What an operation does."""

    SET = 0
    STEP = 1
    GET = 2
    CHANGE = 3
    READ = 4
    LOOK = 5
    STAMP = 6
    EXTEND = 7
    SLOPES = 8
    BEGIN = 9
    MARK = 10
    END = 11
    SAVE = 12
    RESTORE = 13
    FORGET = 14
    NOTE = 15
    SOLVE = 16
    ASK = 17


AS_IT_IS, TRUE_ABOVE, ROUNDED_UP = 0, 1, 2
"""What a threshold does."""
CIRCLE, ITERATION = 0, 1
"""Kinds of loops."""
AT_STAMP, AT_END, AS_NOTED = 0, 1, 2
"""What time the values of inputs that go on belong to."""
METHODS = {"none": 0, "aitken": 1, "anderson": 2}
"""Ways to the next guess of an iteration."""
APART = Kind.SET, Kind.EXTEND, Kind.READ, Kind.SLOPES, Kind.ASK
"""What an isolated instance that fails of it fails of at that time, and not in the step that was posted last."""
NOBODY = None, ""
"""Whom an operation calls that calls nobody, and by which function."""
NONE = 2**32 - 1
"""What stands where there is no value reference, so that lists of other lengths are others."""

CHANNEL = np.dtype(
    [(name, "u8") for name in ("function", "component")]
    + [(name, "i8") for name in ("begin", "count", "is_real", "type", "reference_count")]
)
INSTANCE = np.dtype([("function", "u8"), ("component", "u8"), ("told", "u8")])
ENTRY = np.dtype(
    [
        ("place", "i8"),
        ("age", "i8"),
        ("change", "i8"),
        ("scale", "f8"),
        ("offset", "f8"),
        ("whole", "i8"),
        ("threshold", "f8"),
        ("form", "i8"),
    ]
)
CHANGES = np.dtype(
    [("active", "i8"), ("place", "i8"), ("is_real", "i8"), *((n, "f8") for n in ("scale", "offset", "slope", "since"))]
)
OPERATION = np.dtype([(name, "i4") for name in ("kind", "index", "period", "phase", "is_watched", "is_late")])
COURSE = np.dtype([("function", "u8"), *((n, "i8") for n in ("channel", "begin", "count", "depth", "order", "at"))])
NOTING = np.dtype([(name, "i8") for name in ("from", "to", "course", "shown")])
POINTS = np.dtype(
    [
        ("times", "f8", 3),
        ("values", "f8", 3),
        ("slopes", "f8", 2),
        *((n, "i8") for n in ("count", "place", "reference")),
    ]
)
STATE = np.dtype([(name, "u8") for name in ("save", "restore", "forget", "component", "handle")])
LOOP = np.dtype(
    [(n, "i8") for n in ("kind", "limit", "work", "begin", "real_count", "guess_count", "other_count", "method")]
    + [("relaxation", "f8")]
)
SOLVER = np.dtype(
    [(n, "i8") for n in ("work", "begin", "real_count", "other_count", "attempts", "party", "party_count")]
    + [(n, "i8") for n in ("evaluating", "deriving", "end")]
)
PARTY = np.dtype(
    [("function", "u8"), ("component", "u8"), ("counts_values", "i8")]
    + [(n, "i8") for n in ("writing", "written", "reading", "read", "ask")]
    + [(n, "i8") for n in ("term", "known_count", "row_count", "whole_count")]
)
TERM = np.dtype([(n, "i8") for n in ("of", "reference", "count", "element")])
PLACE = np.dtype([(name, "i8") for name in ("begin", "failed", "status")])
CONTROL = np.dtype(
    [(name, "f8") for name in ("start", "step", "last", "late", "end", "due", "every", "shortest")]
    + [(name, "f8") for name in ("exponent", "of_halves", "of_same", "of_end")]
    + [(name, "i8") for name in ("value_count", "point_count", "plain_count", "shown_count", "work")]
    + [(name, "f8") for name in ("time", "length", "least", "most")]
    + [(name, "i8") for name in ("accepted", "rejected", "in_a_row", "jump")]
    + [(name, "f8") for name in ("called_at", "called_for")]
)
"""Which steps are wanted where they vary, and how they went, as adaptive.h has it."""

SWING = np.dtype(
    [(name, "f8") for name in ("peak", "last", "from", "size")] + [(x, "i8") for x in ("way", "rises", "is_begun")]
)
"""What the kernel notes of how a signal grows, as growth.h has it."""

_SIZES: dict[str, Any] = {
    "operations": OPERATION, "parts": "i8", "channels": CHANNEL, "instances": INSTANCE, "entries": ENTRY,
    "references": "u4", "forms": "i8", "courses": COURSE, "notes": NOTING, "loops": LOOP, "solvers": SOLVER,
    "parties": PARTY, "terms": TERM, "passed": "i8",
    "points": POINTS, "states": STATE, "work": "f8", "stamps": "f8", "changes": CHANGES, "kept": "i8", "values": "f8",
    "history": "f8", "table": "f8", "places": PLACE, "disturbed": "i8", "control": CONTROL,
}  # fmt: skip
SIZES = tuple(np.dtype(each).itemsize for each in _SIZES.values())
"""Of what the kernel's buffers hold, in bytes, in the order in which it takes them."""
