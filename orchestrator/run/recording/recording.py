"""`Recording`: what is kept of a run: its results, and what is judged of points that are no results."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import ScenarioError
from ...evaluation import Signals
from ...master import Rows, Table
from .columns import Columns
from .recorder import ROWS_FILE, SEEN_FILE, Recorder, checksum_of
from .results import Results
from .seen import Seen
from .spacing import Spacing
from .stored import open_stored

_FILES = (ROWS_FILE, SEEN_FILE)


class Recording:
    """Takes the points of a run in.

    Args:
        names: of the signals, as they stand behind the time in a row.
        kinds: their FMI types.
        judged: those that metrics and requirements look at, if they see points that are no results.
        directory: where the files are; None keeps everything in memory.
        only: signals that are kept at all; None for every one.
        identity: of the run.
        before: how many rows the run's files have, if it goes on, in the order of the files.
        expected: how many points there will be, as far as that is known.
        apart: by signal, in each of how many results it has a value; those that are not named, in every one.
    """

    def __init__(
        self,
        names: Sequence[str],
        kinds: Sequence[str],
        judged: Collection[str] | None,
        directory: Path | None,
        *,
        identity: str = "",
        before: Sequence[int] = (0, 0),
        expected: int = 0,
        only: Collection[str] | None = None,
        apart: Mapping[str, int] | None = None,
    ) -> None:
        paths = (None, None) if directory is None else tuple(directory / name for name in _FILES)
        self._picks: list[list[int] | None] = []
        self._recorders: list[Recorder] = []
        for k, chosen in enumerate((only,) if judged is None else (only, judged)):
            picked = [n for n, name in enumerate(names) if chosen is None or name in chosen]
            columns, of = [names[n] for n in picked], [kinds[n] for n in picked]
            every = judged is None or k == 1  # point is there
            recorder = Recorder(
                columns,
                of,
                paths[k],
                places=picked,
                expected=expected if every else 0,
                there=before[k],
                identity=identity,
            )
            self._recorders.append(recorder)
            self._picks.append(None if chosen is None else [0, *(n + 1 for n in picked)])
        self._is_lent, self._names = False, names
        kept = [n for n, name in enumerate(names) if only is None or name in only]
        self._spacing = Spacing([names[n] for n in kept], [kinds[n] for n in kept], apart) if apart else None

    def lend(self) -> Table | None:
        """Where every point can be written at once, if one place does: then arrays that are seen are of there."""
        alike = all(places == self._picks[0] for places in self._picks)
        table = self._recorders[-1].lend() if alike else None
        self._is_lent = table is not None
        return table

    def see(self, points: Rows, results: Rows, *, whole: bool = False) -> None:
        """Take in points, and those of them that are results; of the last of these all values, where it is `whole`."""
        for recorder, places, rows in zip(self._recorders, self._picks, (results, points), strict=False):
            if self._is_lent and isinstance(rows, np.ndarray):
                if recorder is self._recorders[-1]:
                    recorder.grown(len(rows))
                else:
                    recorder.extend(rows)
            elif places is None:
                recorder.extend(rows)
            else:
                taken: Any
                if isinstance(rows, np.ndarray):
                    taken = rows.take(places, axis=1)
                else:
                    taken = [[row[k] for k in places] for row in rows]
                if self._spacing is not None and recorder is self._recorders[0]:
                    taken = self._spacing.blank(recorder.count, taken, whole=whole)
                recorder.extend(taken)

    def go_on(self, directory: Path, record: Mapping[str, Any], marks: Sequence[Sequence[int]]) -> None:
        """Begin with the rows up to a checkpoint.

        Args:
            directory: of the run.
            record: its run.json.
            marks: of the checkpoint.
        """
        try:
            for recorder, name, (rows, _) in zip(self._recorders, _FILES, marks, strict=False):
                stored = open_stored(directory, record, name)
                recorder.go_on(stored.blocks, stored.words, rows)
        except BaseException:  # the other one would stay open
            for recorder in self._recorders:
                recorder.give_back()
            raise

    @property
    def marks(self) -> list[list[int]]:
        """Of each file how many rows it has, and their checksum."""
        return [[recorder.count, recorder.checksum] for recorder in self._recorders]

    def flush(self, *, sync: bool = False) -> None:
        """Bring everything to the files, and wait until it is there where ``sync`` asks for that."""
        for recorder in self._recorders:
            recorder.flush(sync=sync)

    def close(self) -> None:
        """End the files: what was recorded can be read from then on."""
        for recorder in self._recorders:
            recorder.close()

    def columns(self) -> Columns:
        """The results, the time among them."""
        return self._recorders[0].columns()

    def every_point(self, results: Columns) -> Columns:
        """What was kept of every point, the time among it; the results where these are all points."""
        return results if len(self._recorders) == 1 else self._recorders[1].columns()

    def judged(self, results: Results) -> Signals:
        """What metrics and requirements look at: every point."""
        if len(self._recorders) == 1:
            return results
        told = (results.step, results.completed, results.stop_time, results.units, results.parameters)
        return Seen(self._recorders[1].columns(), self._names, *told)


def check_stored(directory: Path, record: Mapping[str, Any], marks: Sequence[Sequence[int]]) -> list[int]:
    """How many rows each file has of a run that is to go on, which may be more than its checkpoint tells of.

    Raises:
        ScenarioError: they are not those of the checkpoint.
    """
    counts = [0] * len(_FILES)
    for k, (name, (rows, checksum)) in enumerate(zip(_FILES, marks, strict=False)):
        try:
            found, counts[k] = checksum_of(open_stored(directory, record, name).blocks, rows)
        except (OSError, ValueError, LookupError, TypeError) as error:
            raise ScenarioError(f"{directory} cannot be resumed: its results cannot be read: {error}") from error
        if counts[k] < rows:
            raise ScenarioError(
                f"{directory} cannot be resumed: its results have {counts[k]} rows, fewer than the {rows} of its "
                "checkpoint"
            )
        if found != checksum:
            raise ScenarioError(f"{directory} cannot be resumed: its results and its checkpoint are of different runs")
    return counts
