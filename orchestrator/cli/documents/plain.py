"""Declared data as JSON: what the fields of a document become."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Iterable, Mapping, Set
from typing import Any


def plain(value: Any) -> Any:
    """A value as JSON has it.

    Dataclasses and named tuples become objects, all numbers keep every digit, and those that JSON has none for become
    the texts ``"nan"``, ``"inf"`` and ``"-inf"``, as in the files of a run. A key that is no text becomes one, that of
    a value without an index ``""``.
    """
    if dataclasses.is_dataclass(value):
        value = {field.name: getattr(value, field.name) for field in dataclasses.fields(value)}
    elif hasattr(value, "_asdict"):
        value = value._asdict()
    elif hasattr(value, "tolist"):  # of NumPy
        value = value.tolist()
    match value:
        case Mapping():
            return {"" if key is None else str(key): plain(one) for key, one in value.items()}
        case float():
            return float(value) if math.isfinite(value) else repr(float(value))
        case None | str() | int():
            return value
        case Set():
            return sorted(map(plain, value))
        case Iterable():
            return [plain(one) for one in value]
    return str(value)


def text_of(document: Any) -> str:
    """A document as text of ASCII letters, so that it survives any pipe and terminal."""
    return json.dumps(plain(document), indent=1, allow_nan=False)
