"""The tape: memory along one trip that the next trip reads at the same sample (what iterative learning needs).

Two buffers, one read and one recorded, exchanged when the trip number changes. The file format is plain text, so that
the same file serves every tool and language: a header line that names the component, the grid and the columns, one
line per sample with numbers that survive the round trip, and a last line ``end``.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .component import Slot, pack
from .errors import ComponentError

Rows = NDArray[np.float64]
_HEADER = "railcosim tape 1"


class TapeDeck:
    """The two buffers of one instance.

    Args:
        owner: the component's name, for messages and the file's header.
        slots: the declared tapes; a row is all their elements in order.
        start: a row before anything was learned, by name.
        sample_time: distance of the samples in s.
        duration: longest trip in s.
        cutoff: corner frequency of the low-pass between trips in Hz; 0 is off.
    """

    def __init__(
        self,
        owner: str,
        slots: tuple[Slot, ...],
        start: Mapping[str, Any],
        *,
        sample_time: float,
        duration: float,
        cutoff: float,
    ) -> None:
        if sample_time <= 0.0:
            raise ComponentError(f"{owner}.sample_time must be set: a tape is recorded on a fixed grid")
        self.owner = owner
        self.slots = slots
        self.start = self._row(start)
        self.sample_time = sample_time
        self.cutoff = cutoff
        self.length = round(duration / sample_time) + 1
        self.committed: Rows = np.tile(self.start, (self.length, 1))
        self.recording: Rows = self.committed.copy()
        self.span: tuple[int, int] | None = None
        """First and last sample recorded on the present trip."""
        self.trip: int | None = None

    def waiting(self, trip_time: float) -> bool:
        """Whether the train has not yet departed; a departure at zero may be told with a rounding error."""
        return trip_time < -0.01 * self.sample_time

    def index(self, trip_time: float, *, at_sample: bool = True) -> int | None:
        """The sample along the trip, between samples the last one; None while waiting (negative trip time).

        Raises:
            ComponentError: at a sample, but off the grid by more than 1 % of one; or past the end of the tape.
        """
        if self.waiting(trip_time):
            return None
        place = trip_time / self.sample_time
        n = round(place) if at_sample else math.floor(place + 0.01)
        if at_sample and abs(trip_time - n * self.sample_time) > 0.01 * self.sample_time:
            raise ComponentError(
                f"{self.owner}: trip_time = {trip_time!r} s is not a multiple of sample_time = {self.sample_time!r} s"
            )
        if n >= self.length:
            raise ComponentError(
                f"{self.owner}: trip_time = {trip_time!r} s is past the end of the tape; raise tape_duration"
            )
        return n

    def read(self, trip_time: float, *, at_sample: bool = True) -> dict[str, Any]:
        """What the last committed trip recorded here, by name; the start row while waiting."""
        n = self.index(trip_time, at_sample=at_sample)
        row = self.start if n is None else self.committed[n]
        values, at = {}, 0
        for slot in self.slots:
            cells = row[at : at + len(slot.scalars)]
            values[slot.name] = pack(slot, cells if slot.shape else float(cells[0]))
            at += len(cells)
        return values

    def record(self, trip_time: float, row: Mapping[str, Any]) -> None:
        """Store this trip's row; nothing is recorded while waiting."""
        n = self.index(trip_time)
        if n is not None:
            self.recording[n] = self._row(row)
            first, last = self.span or (n, n)
            self.span = min(first, n), max(last, n)

    def follow(self, trip: int, trip_time: float, keep: Callable[[], Any]) -> None:
        """Notice a new trip: commit what was recorded if it is to be kept, drop it otherwise.

        Raises:
            ComponentError: the trip number changed while the train was under way.
        """
        if self.trip is None:
            self.trip = trip
        if trip == self.trip:
            return
        if not self.waiting(trip_time):
            raise ComponentError(
                f"{self.owner}: the trip number changed from {self.trip} to {trip} at trip_time = {trip_time!r} s; "
                "it may change only while trip_time is negative (the wait before a departure)"
            )
        self.trip = trip
        self.commit(keep)

    def commit(self, keep: Callable[[], Any]) -> None:
        """End a trip: if anything was recorded and is to be kept, the filtered rows become the ones that are read.

        Only the samples of this trip are filtered: what lies past its end is not part of the signal.

        Raises:
            ComponentError: filtered, they are no finite numbers.
        """
        if self.span is not None and keep():
            trip = slice(self.span[0], self.span[1] + 1)
            self.committed = self.recording.copy()
            self.committed[trip] = smooth(self.recording[trip], self.cutoff, self.sample_time)
        self.recording = self.committed.copy()
        self.span = None
        if not np.isfinite(self.committed).all():
            raise ComponentError(f"{self.owner}.tape_cutoff: the filter takes what was recorded beyond all numbers")

    def state(self) -> dict[str, Any]:
        """Everything a restore needs, as JSON-ready values."""
        return {
            "trip": self.trip,
            "span": None if self.span is None else list(self.span),
            "committed": self.committed.tolist(),
            "recording": self.recording.tolist(),
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Take back what `state` gave."""
        self.trip = state["trip"]
        self.span = None if state["span"] is None else (state["span"][0], state["span"][1])
        self.committed = np.array(state["committed"], dtype=np.float64).reshape(self.committed.shape)
        self.recording = np.array(state["recording"], dtype=np.float64).reshape(self.committed.shape)

    def load(self, path: Path) -> None:
        """Read a tape file.

        Raises:
            ComponentError: corrupt, or recorded by another component or on another grid; the message says which.
        """
        try:
            lines = path.read_text(encoding="utf-8").splitlines()
        except (OSError, UnicodeDecodeError) as error:
            raise ComponentError(f"{self.owner}.tape_file: {path} cannot be read: {error}") from error
        expected = self._header()
        if not lines or not lines[0].startswith(_HEADER):
            raise ComponentError(f"{self.owner}.tape_file: {path} is not a tape file; remove it to start anew")
        if lines[0] != expected:
            raise ComponentError(
                f"{self.owner}.tape_file: {path} does not fit this instance: it says '{lines[0]}', "
                f"expected '{expected}'"
            )
        try:
            if lines[-1] != "end" or len(lines) != self.length + 2:
                raise ValueError("it is cut short")
            numbers = [[float(word) for word in line.split()] for line in lines[1:-1]]
            for number, row in enumerate(numbers, 2):
                if len(row) != self.start.size or not all(map(math.isfinite, row)):
                    raise ValueError(f"line {number} is incomplete or not finite")
        except ValueError as error:
            raise ComponentError(
                f"{self.owner}.tape_file: {path} is corrupt: {error}; remove it to start anew"
            ) from error
        self.committed = np.array(numbers, dtype=np.float64).reshape(self.committed.shape)
        self.recording = self.committed.copy()

    def save(self, path: Path) -> None:
        """Write the tape file, whole or not at all."""
        rows = (" ".join(map(repr, row)) for row in self.committed.tolist())
        text = "\n".join([self._header(), *rows, "end", ""])
        part = path.with_name(path.name + ".part")
        try:
            part.write_text(text, encoding="utf-8", newline="\n")
            os.replace(part, path)
        except OSError as error:
            raise ComponentError(f"{self.owner}.tape_file: {path} cannot be written: {error}") from error

    def _row(self, values: Mapping[str, Any]) -> Rows:
        return np.concatenate([np.ravel(values[slot.name]) for slot in self.slots]).astype(np.float64)

    def _header(self) -> str:
        return (
            f"{_HEADER} component={self.owner} sample_time={self.sample_time!r} "
            f"rows={self.length} columns={self.start.size}"
        )


def smooth(rows: Rows, cutoff: float, sample_time: float) -> Rows:
    """First-order low-pass run forward and backward over each column, the ends mirrored (odd reflection).

    Args:
        rows: shape (samples, columns).
        cutoff: corner frequency in Hz; 0 returns a copy.
        sample_time: distance of the samples in s.
    """
    if cutoff <= 0.0 or len(rows) < 2:
        return rows.copy()
    gain = 1.0 - math.exp(-2.0 * math.pi * cutoff * sample_time)
    # Ten time constants of run-in leave less than 5e-5 of the start value in the result.
    pad = math.ceil(10.0 / gain)
    with np.errstate(over="ignore", invalid="ignore"):  # what comes of that is looked at
        padded = _continued(rows, pad)
        for direction in (1, -1):
            padded = _low_pass(padded[::direction], gain)[::direction]
    return np.array(padded[pad : pad + len(rows)])


def _continued(rows: Rows, pad: int) -> Rows:
    """Rows with ``pad`` more on either side, by odd reflection at the ends as often as it takes.

    Written out because NumPy's own has changed for pads longer than the rows, and fmus/runtime/tape.c does the same.
    """
    period = len(rows) - 1
    turn, place = np.divmod(np.arange(-pad, len(rows) + pad), period)
    rise = rows[-1] - rows[0]
    straight = rows[place] + turn[:, None] * rise
    mirrored = (2.0 * rows[-1] - rows[period - place]) + (turn[:, None] - 1) * rise
    continued: Rows = np.where(turn[:, None] % 2 == 0, straight, mirrored)
    return continued


def _low_pass(rows: Rows, gain: float) -> Rows:
    smoothed = np.empty_like(rows)
    value = rows[0]
    for k, row in enumerate(rows):
        value = value + gain * (row - value)
        smoothed[k] = value
    return smoothed
