"""Which calls of FMUs are under way, in memory that may be shared: whoever is left can say what ended a process."""

from __future__ import annotations

import json
import mmap
import struct
import sys
from collections.abc import Iterable
from contextlib import suppress
from typing import Any, NamedTuple

from ... import world
from ...times import digits

_HEAD = struct.Struct("=qq")
"""The exit code that was decided on, plus one; and how much of the table is filled."""
_NOTE = struct.Struct("=QQdQ32x")
"""As guard.h has it: instance, function, time, rows."""
NOTE_SIZE = _NOTE.size
_NOTES_BEGIN, _COUNT = 64, 256
_TABLE = _NOTES_BEGIN + _COUNT * _NOTE.size
_RUN = 3
"""The number that stands for the directory of the run; no address is so small."""
_SIZE = _TABLE + (16 << 20)
"""Pages that nobody writes to take no memory."""


class Seen(NamedTuple):
    """A call that is under way.

    Attributes:
        instance: its name in the system. model: what it is made of.
        call: the function. time: the communication point of the last step that was begun, s; None before the first.
    """

    instance: str
    model: str
    call: str
    time: float | None


class Notes:
    """The memory: a note for each thread, written where FMUs are called, and a table of what its numbers stand for."""

    def __init__(self) -> None:
        self._is_shared = self._is_handed_on = False
        self.memory = self._map(private=True)

    @staticmethod
    def _map(*, private: bool) -> mmap.mmap:
        if sys.platform == "win32" or not private:
            return world.map_memory(-1, _SIZE)
        return world.map_memory(-1, _SIZE, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)

    def share(self) -> None:
        """From now on share it with the next process that is forked, and with no other."""
        self.memory = self._map(private=False)
        self._is_shared = self._is_handed_on = True

    def begin_anew(self) -> None:
        """In a process that was forked: have memory of one's own, unless it was to be shared."""
        if self._is_shared and not self._is_handed_on:
            self.memory = self._map(private=True)
            self._is_shared = False
        self._is_handed_on = False

    # ---------------------------------------------------------------- what the numbers stand for

    def tell(self, number: int, *words: str) -> None:
        """Say what a number stands for from now on: an instance (two words: its name, its model), or a function."""
        line = json.dumps([number, *words]).encode() + b"\n"
        decided, length = _HEAD.unpack_from(self.memory)
        if _TABLE + length + len(line) <= _SIZE:
            self.memory[_TABLE + length : _TABLE + length + len(line)] = line
            _HEAD.pack_into(self.memory, 0, decided, length + len(line))

    def forget(self) -> None:
        """Nothing is loaded any more: numbers will stand for other things."""
        _HEAD.pack_into(self.memory, 0, _HEAD.unpack_from(self.memory)[0], 0)

    @property
    def directory(self) -> str:
        """Where the run that is under way writes; empty where there is none, or it writes nothing."""
        words = self._table().get(_RUN)
        return words[0] if words else ""

    @directory.setter
    def directory(self, path: str) -> None:
        self.tell(_RUN, path)

    def _table(self) -> dict[int, list[str]]:
        found: dict[int, list[str]] = {}
        length = _HEAD.unpack_from(self.memory)[1]
        for line in self.memory[_TABLE : _TABLE + max(0, length)].splitlines():
            with suppress(ValueError, TypeError, IndexError):  # an FMU may have written there
                number, *words = json.loads(line)
                found[int(number)] = [str(word) for word in words]
        return found

    # ---------------------------------------------------------------- what is noted

    def under_way(self) -> list[Seen]:
        """The calls that are under way, or were when the process ended."""
        table = self._table()
        notes = (self.note(k) for k in range(_COUNT))
        return [self._seen(table, *note[:3]) for note in notes if note[0]]

    def seen(self, instance: int, function: int, time: float) -> Seen:
        """One call in words."""
        return self._seen(self._table(), instance, function, time)

    @staticmethod
    def _seen(table: dict[int, list[str]], instance: int, function: int, time: float) -> Seen:
        name, model = (*table.get(instance, ()), "", "")[:2]
        (call,) = (*table.get(function, ()), "")[:1]
        return Seen(name, model, call, time if abs(time) < sys.float_info.max else None)

    def note(self, number: int) -> tuple[Any, ...]:
        """A thread's note: instance, function, time, rows."""
        return _NOTE.unpack_from(self.memory, _NOTES_BEGIN + number * _NOTE.size)

    @property
    def place(self) -> tuple[int, int]:
        """Where the notes begin in the memory, and how many there are."""
        return _NOTES_BEGIN, _COUNT

    # ---------------------------------------------------------------- the verdict

    @property
    def decided(self) -> int | None:
        """The exit code with which the process is to end, if it has decided on one by itself."""
        code = _HEAD.unpack_from(self.memory)[0]
        return code - 1 if code > 0 else None

    def decide(self, code: int) -> None:
        """Decide on the exit code."""
        _HEAD.pack_into(self.memory, 0, code + 1, _HEAD.unpack_from(self.memory)[1])


def described(seen: Iterable[Seen]) -> str:
    """``train[1] (Lag) in fmi2DoStep at t = 3 s``, or several."""
    return " or ".join(dict.fromkeys(_words(each) for each in seen))


def _words(seen: Seen) -> str:
    where = f" in {seen.call}" if seen.call else ""
    when = "" if seen.time is None else f" at t = {digits(seen.time)} s"
    return f"{seen.instance or 'an FMU'}{f' ({seen.model})' if seen.model else ''}{where}{when}"


NOTES = Notes()
"""Those of this process."""
