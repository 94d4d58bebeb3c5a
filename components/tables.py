"""Tables that components take as `Data`: columns are declared once, rows are read and refused in one way."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from .errors import nearest

FASTEST = 170.0
"""m/s: faster than any train on wheels (574.8 km/h, 159.7 m/s); more is meant as km/h."""
_REQUIRED: Any = object()
_WORDS = {float: "number", int: "whole number"}


def _as_it_is(*row: Any) -> Any:
    return row


@dataclass(frozen=True)
class Column:
    """One value of each row.

    Attributes:
        name: its key. unit: SI unit, for messages.
        type: float, int, bool, str, or the `Table` that stands in it.
        sign: of a number.
        within: the bounds beyond which it cannot be meant: almost surely it is in another unit.
        after: the column whose value it must exceed: one to its left, or by its own name itself in the row before.
        default: what it is where a row leaves it out; without one it is required.
        word: a text that may stand there instead.
        choices: the texts that may stand there, of a text that is not free.
        note: what the value means, where its name does not say it.
    """

    name: str
    unit: str = "1"
    type: Any = float
    sign: Literal["", "positive", "non-negative"] = ""
    within: tuple[float, float] | None = None
    after: str = ""
    default: Any = _REQUIRED
    word: str = ""
    choices: tuple[str, ...] = ()
    note: str = ""

    def read(self, value: Any) -> Any:
        """A value, checked by itself; a whole number may stand for a real one.

        Raises:
            ValueError: it is of another type or sign, beyond its bounds, or not a number.
        """
        if isinstance(self.type, Table):
            return self.type.record(value) if self.type.single else self.type.read(value)
        if self.type is str:
            if not isinstance(value, str) or (self.choices and value not in self.choices):
                wanted = f"one of {', '.join(map(repr, self.choices))}" if self.choices else "a text"
                raise ValueError(f"{self.name!r} must be {wanted}, not {value!r}")
            return value
        if (self.word and value == self.word) or (self.type is bool and isinstance(value, bool)):
            return value
        if self.type is bool:
            raise ValueError(f"{self.name!r} must be true or false, not {value!r}")
        accepted = isinstance(value, (int, float) if self.type is float else int) and not isinstance(value, bool)
        if not accepted or math.isnan(value) or (self.sign and (value < 0 or (value == 0 and self.sign == "positive"))):
            wanted = f"a {f'{self.sign} {_WORDS[self.type]}'.strip()}{'' if self.unit == '1' else f' in {self.unit}'}"
            raise ValueError(f"{self.name!r} must be {wanted}{self.word and f' or {self.word!r}'}, not {value!r}")
        if self.within is not None and not self.within[0] <= value <= self.within[1]:
            meant = ", ".join(text for text in (self.note, "" if self.unit == "1" else f"in {self.unit}") if text)
            low, high = self.within
            told = f"{self.name!r} is {value!r}{f' ({meant})' if meant else ''}"
            raise ValueError(f"{told}, which is beyond all that runs, {low:g} to {high:g}: is it in another unit?")
        return self.type(value)


@dataclass(frozen=True)
class Table:
    """What rows are made of.

    Attributes:
        what: one row is, for messages: ``"vehicle"``.
        columns: what it has, in order.
        make: makes a row's object of its values; a tuple by default. It may raise ValueError.
        whole: makes the table's object of its rows.
        by_place: whether a row is a list of its values, not a table of them by name.
        may_be_empty: whether there may be no row.
        single: whether it is one row that stands by itself, not a list of rows.
    """

    what: str
    columns: Sequence[Column]
    make: Callable[..., Any] = _as_it_is
    whole: Callable[[Sequence[Any]], Any] = tuple
    by_place: bool = False
    may_be_empty: bool = False
    single: bool = False

    def read(self, data: Any) -> Any:
        """The table of a list of rows.

        Raises:
            ValueError: unusable data; the message names row, column and what is wanted.
        """
        if isinstance(data, str) or not isinstance(data, Sequence) or not (data or self.may_be_empty):
            some = "a list" if self.may_be_empty else "a list of at least one"
            raise ValueError(f"{self.what}s are {some}, each {self._form()}, not {data!r}")
        rows: list[Any] = []
        values: dict[str, Any] = {}
        for number, row in enumerate(data, 1):
            try:
                values = self._values(row, values)
                rows.append(self.make(*values.values()))
            except ValueError as error:
                raise ValueError(f"{self.what} {number}: {error}") from None
        return self.whole(rows)

    def record(self, data: Any) -> Any:
        """A single row that stands by itself."""
        return self.make(*self._values(data, {}).values())

    def _values(self, row: Any, before: Mapping[str, Any]) -> dict[str, Any]:
        names = [column.name for column in self.columns]
        if self.by_place and isinstance(row, Sequence) and not isinstance(row, str) and len(row) == len(names):
            row = dict(zip(names, row, strict=True))
        elif self.by_place or not isinstance(row, Mapping):
            raise ValueError(f"a {self.what} is {self._form()}, not {row!r}")
        for unknown in sorted(map(str, row.keys() - set(names))):
            raise ValueError(f"a {self.what} has no {nearest(unknown, names)}")
        found: dict[str, Any] = {}
        for column in self.columns:
            name, after = column.name, column.after
            left_out = name not in row and column.default is not _REQUIRED
            found[name] = column.default if left_out else column.read(row.get(name))
            bound = before.get(name) if after == name else found.get(after)
            if bound is not None and not found[name] > bound:
                raise ValueError(f"{name!r} must exceed {f'{after!r}, {bound:g}' if after != name else bound}: {row!r}")
        return found

    @property
    def description(self) -> str:
        """What the data is, in one line."""
        return f"{self.what}s, each {self._form()}"

    def _form(self) -> str:
        meanings = [", ".join(text for text in (c.unit, c.note) if text not in ("", "1")) for c in self.columns]
        shown = ", ".join(f"{c.name} ({m})" if m else c.name for c, m in zip(self.columns, meanings, strict=True))
        return f"[{shown}]" if self.by_place else f"a table of {shown}"
