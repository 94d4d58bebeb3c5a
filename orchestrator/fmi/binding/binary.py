"""Binary variables of FMI 3.0, whose bytes pass as they are; here they are texts of hexadecimal digits."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from typing import Any

from ...errors import FmuError
from .channel import Owner


class BinaryChannel:
    """Some Binary variables of an FMU.

    Args:
        slave: the instance.
        kind: their type.
        names: the variables.
    """

    def __init__(self, slave: Owner, kind: str, names: Sequence[str]) -> None:
        suffix = slave.TYPES[kind][0]
        self._slave, self._names = slave, names
        self._calls = f"{slave.SET}{suffix}", f"{slave.GET}{suffix}"
        self._references = slave.references(names)
        self._sizes = (ctypes.c_size_t * len(names))()

    def set(self, values: Sequence[Any]) -> None:
        """Set all of them."""
        contents = [bytes.fromhex(value) for value in values]
        for name, content in zip(self._names, contents, strict=True):
            most = self._slave.interface.variables[name].longest
            if most is not None and len(content) > most:
                what = f"{name!r} cannot become {len(content)} bytes long: it takes up to {most}"
                raise FmuError(what, instance=self._slave.name, time=self._slave.time)
        self._sizes[:] = [len(content) for content in contents]
        self._call(self._calls[0], (ctypes.c_char_p * len(contents))(*contents))

    def get(self) -> list[Any]:
        """Read all of them; what the FMU gives is its own until the next call, and copied before."""
        places = (ctypes.c_void_p * len(self._names))()
        self._call(self._calls[1], places)
        found = []
        for name, place, size in zip(self._names, places, self._sizes, strict=True):
            if size and not place:
                what = f"{self._calls[1]} says that {name!r} has {size} bytes, and not where"
                raise FmuError(what, instance=self._slave.name, time=self._slave.time)
            found.append(ctypes.string_at(place, size).hex() if size else "")
        return found

    def _call(self, call: str, values: Any) -> None:
        self._slave.call(call, self._references, len(self._references), self._sizes, values, len(self._names))
