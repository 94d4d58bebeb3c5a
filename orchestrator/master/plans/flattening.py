"""What the compiled loop makes of channels and values: single calls, and doubles.

Of whole numbers of 64 bits, which doubles do not hold, its values are the bits; of texts, their numbers.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...fmi import Channel
from ...fmi.binding import FmuChannel, Held, calls_of
from ...isolation import IsolatedChannel, IsolatedPart
from ..exchange import Exchange, Feed
from ..observer import Rows
from .layout import AS_IT_IS, ROUNDED_UP, TRUE_ABOVE
from .texts import Texts

_NUMBERS = "Float64", "Float32", "Int8", "UInt8", "Int16", "UInt16", "Int32", "UInt32", "Int64", "UInt64", "Boolean"
TYPES = {name: number for number, name in enumerate(_NUMBERS, 1)} | {"Enumeration": 9}
"""The kernel's numbers for the types of FMI 3.0."""
_BYTE = 12
"""That of truth values of FMI 1.0."""
_TEXT, _TEXT_3 = 13, 14
"""Those of texts of FMI 1.0 and 2.0, and of FMI 3.0."""
NUMBER, SIGNED_BITS, UNSIGNED_BITS, TEXT = 0, 1, 2, 3
"""The kernel's numbers for what a value is."""
_FORMS = {"Int64": SIGNED_BITS, "Enumeration": SIGNED_BITS, "UInt64": UNSIGNED_BITS}
_WIDEST = 2.0**53
"""Beyond that a whole number of 64 bits is compared with a threshold in Python."""
_BITS = {SIGNED_BITS: np.int64, UNSIGNED_BITS: np.uint64}

Entry = tuple[int, int, int, float, float, int, float, int]
"""A value's place, age and change; scale, offset, threshold and what that does; what the value is."""

Parts = Sequence[tuple[FmuChannel | IsolatedPart, Sequence[int | Held]]]


class Wide:
    """What each of the values of an exchange is.

    Attributes:
        forms: by place, for the kernel; empty where all of them are numbers.
        texts: those that are texts; None where there are none.
        held: elements that arrays which are set in part have beside, and where each stands behind the values.
    """

    def __init__(self, exchange: Exchange) -> None:
        variables = (
            exchange.slaves[owner].interface.variables[signal.removeprefix(f"{owner}.")]
            for owner, signal in zip(exchange.owners, exchange.signals, strict=True)
        )
        forms = [TEXT if v.type == "String" else _FORMS.get(v.fmi_type, NUMBER) for v in variables]
        self.forms = np.array(forms if any(forms) else [], dtype=np.int64)
        self._whole = [place for place, kind in enumerate(exchange.kinds) if kind not in ("Real", "String")]
        self._wide = [(place, _BITS[form]) for place, form in enumerate(forms) if form in _BITS]
        self._worded = [place for place, form in enumerate(forms) if form == TEXT]
        self.texts = Texts() if self._worded else None
        self.held: dict[Held, Entry] = {}
        self._more = 0

    def widen(self, cells: int) -> None:
        """There are so many numbers more behind the values."""
        self._more = cells
        if len(self.forms):
            self.forms = np.concatenate([self.forms, np.zeros(cells, np.int64)])

    def form(self, place: int) -> int:
        """What the value at a place is."""
        return int(self.forms[place]) if len(self.forms) else NUMBER

    def entries(self, feed: Feed, changes: Sequence[int], *, late: bool) -> list[Entry]:
        """Where the inputs of a feed come from.

        Args:
            feed: the inputs.
            changes: of each, the number of the change that events may make, or -1.
            late: whether they are set at a communication point that is not recorded yet.
        """
        made: list[Entry] = []
        ages = feed.ages_at_point if late else feed.ages
        for k, (source, age, threshold) in enumerate(zip(feed.sources, ages, feed.thresholds, strict=True)):
            whole = AS_IT_IS if threshold is None else TRUE_ABOVE if feed.kind == "Boolean" else ROUNDED_UP
            place = source, -1 if age is None else age, changes[k]
            made.append((*place, feed.scales[k], feed.offsets[k], whole, threshold or 0.0, self.form(source)))
        return made

    def hold(self, element: Held, kind: str, place: int) -> Entry:
        """Let an element of a type of the FMU's stand at a place behind the values, unless it has one: where it is."""
        form = TEXT if kind == "String" else _FORMS.get(kind, NUMBER)
        return self.held.setdefault(element, (place, -1, -1, 1.0, 0.0, AS_IT_IS, 0.0, form))

    def packed(self, values: Sequence[Any]) -> NDArray[np.float64]:
        """Values as the kernel takes them."""
        numbers = [*values, *[0.0] * self._more]
        if self.texts is not None:
            for place in self._worded:
                numbers[place] = self.texts.number(values[place])
        cells = np.array(numbers, dtype=np.float64)
        for place, bits in self._wide:
            cells.view(bits)[place] = int(values[place])
        for (array, name), (place, *_, form) in self.held.items():
            value = array.value_of(name)
            if form in _BITS:
                cells.view(_BITS[form])[place] = int(value)
            else:
                cells[place] = self.texts.number(value) if self.texts is not None and form == TEXT else value
        return cells

    def unpacked(self, cells: NDArray[np.float64]) -> list[Any]:
        """Values that the kernel has left."""
        values: list[Any] = cells[: len(cells) - self._more].tolist()
        for place in self._whole:  # the kernel's values are all doubles
            values[place] = 0 if values[place] != values[place] else int(values[place])
        for place, bits in self._wide:
            values[place] = int(cells.view(bits)[place])
        self._word(values)
        return values

    def told(self, rows: NDArray[np.float64]) -> Rows:
        """Rows that the kernel has left, a time before all the values, as an observer takes them."""
        if self.texts is None:
            return rows
        found: list[list[Any]] = rows.tolist()
        for row in found:
            self._word(row, 1)
        return found

    def _word(self, values: list[Any], before: int = 0) -> None:
        if self.texts is not None:
            for place in self._worded:
                values[place + before] = self.texts.text(values[place + before])


def noted(entry: Entry, place: int) -> Entry:
    """What shows again what an entry has made of a value, once that stands at another place."""
    *value, form = entry
    plain = value[2:] == [-1, 1.0, 0.0, AS_IT_IS, 0.0]
    return place, -1, -1, 1.0, 0.0, AS_IT_IS, 0.0, form if plain or form == TEXT else NUMBER


def parts_of(channel: Channel) -> Parts | None:
    """The calls behind a channel, each with the places of its values in it; None where there are others."""
    return channel.parts if isinstance(channel, IsolatedChannel) else calls_of(channel)


def type_of(version: str, kind: str) -> int:
    """The kernel's number for a type in a version of FMI; 0 where it is called as FMI 2.0 has it."""
    if kind == "String":
        return _TEXT_3 if version == "3.0" else _TEXT
    if version == "3.0":
        return TYPES[kind]
    return _BYTE if version == "1.0" and kind == "Boolean" else 0


def _stand_in_order(places: Sequence[int | Held]) -> bool:
    """Whether values are read as they stand side by side."""
    return list(places) == sorted(k for k in places if not isinstance(k, Held))


def can_exchange(exchange: Exchange) -> bool:
    """Whether the kernel can: all but Binary, arrays that are read as a whole, wide numbers that no event changes."""
    given = [parts_of(feed.channel) for feeds in exchange.feeds.values() for feed in feeds]
    read = [parts_of(part.channel) for parts in exchange.yields.values() for part in parts]
    wide = Wide(exchange)
    compared = (
        abs(link.threshold or 0.0) >= _WIDEST and wide.form(exchange.places[link.source]) in _BITS
        for link in exchange.every_link
    )
    return (
        None not in [*given, *read]
        and all(_stand_in_order(places) for parts in read for _, places in parts or ())
        and not any(wide.form(place) in _BITS for place in exchange.output_changes)
        and not any(compared)
    )
