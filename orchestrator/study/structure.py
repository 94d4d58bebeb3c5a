"""`Runner`: runs of one scenario whose changes may reach its structure: presets, models, counts, build arguments."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from os import PathLike
from types import TracebackType
from typing import Any

from ..errors import ScenarioError
from ..fmi import Kind
from ..run import Checked
from ..scenario import assignment, is_structural, load
from ..system import System
from .batch import Batch
from .rows import Row

_KEPT = 4
"""So many structures are held loaded at a time."""


class Runner:
    """Runs a scenario with changes of any kind: a batch for each structure, of which a few are held.

    Args:
        scenario: a path, or the name of a shipped scenario.
        preset, settings, builds, swaps, stop_time, step, algorithm: as `load` has them; changes come after them.
        kind, record, evaluate: as `Batch` has them.
        keep: how many structures are held loaded.
    """

    def __init__(
        self,
        scenario: str | PathLike[str],
        *,
        preset: str | None = None,
        settings: Sequence[str] = (),
        builds: Sequence[str] = (),
        swaps: Sequence[str] = (),
        stop_time: float | None = None,
        step: float | None = None,
        algorithm: str | None = None,
        kind: Kind = "auto",
        record: Sequence[str] = (),
        evaluate: bool = True,
        keep: int = _KEPT,
    ) -> None:
        self._scenario, self._preset = scenario, preset
        self._settings, self._builds, self._swaps = list(settings), list(builds), list(swaps)
        self._others: dict[str, Any] = {"stop_time": stop_time, "step": step, "algorithm": algorithm}
        self._options: dict[str, Any] = {"kind": kind, "record": record, "evaluate": evaluate}
        self._keep = keep
        self._batches: dict[str, Batch] = {}

    def __enter__(self) -> Runner:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Give everything back."""
        while self._batches:
            self._batches.popitem()[1].close()

    def load(self, changes: Mapping[str, Any]) -> System:
        """The system of the changes that are structural, or of all: what `load` makes of them.

        Raises:
            ScenarioError: with every problem.
        """
        preset, settings, builds, swaps = self._preset, list(self._settings), list(self._builds), list(self._swaps)
        for key, value in changes.items():
            if key == "preset":
                preset = str(value)
            elif "." not in key:
                swaps.append(f"{key}={value}")
            else:
                settings.append(assignment(key, value))
        return load(self._scenario, preset=preset, settings=settings, builds=builds, swaps=swaps, **self._others)

    def batch(self, changes: Mapping[str, Any]) -> Batch:
        """The batch of structural changes, held or made now.

        Raises:
            ScenarioError: the system of it cannot be loaded, or cannot run.
        """
        key = repr(list(changes.items()))
        if key not in self._batches:
            made = Batch(self.load(changes), **self._options)
            while len(self._batches) >= self._keep:
                self._batches.pop(next(iter(self._batches))).close()
            self._batches[key] = made
        self._batches[key] = self._batches.pop(key)  # the last is the one used last
        return self._batches[key]

    def checked(self, changes: Mapping[str, Any]) -> Checked:
        """The system with changes of any kind, found fit to run.

        Raises:
            ScenarioError: it is not.
        """
        structure, values = _parted(changes)
        try:
            return self.batch(structure).checked(values)
        except ScenarioError:  # as in `run`; with everything alone, what is wrong is said
            with Batch(self.load(changes), **self._options) as batch:
                return batch.checked({})

    def run(self, changes: Mapping[str, Any] | None = None) -> Row:
        """One run. What fails in it is told by its status, and never raised.

        Args:
            changes: by key, as `--set` has them; and ``"preset"``, and instances alone that another model is swapped
                for: ``{"preset": "as-stated", "cruise": "TunablePotentialCruise", "train.count": 6}``.

        Raises:
            KeyboardInterrupt: the user stops it.
        """
        changes = changes or {}
        structure, values = _parted(changes)
        try:
            batch = self.batch(structure)
        except ScenarioError:  # a structure may fit the values alone that are changed with it: a list for each train
            return self._alone(changes)
        return batch.run(values)

    def _alone(self, changes: Mapping[str, Any]) -> Row:
        try:
            with Batch(self.load(changes), **self._options) as batch:
                return batch.run()
        except ScenarioError as error:
            return Row("refused", str(error))


def _parted(changes: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """The changes that are structural, and those of values."""
    structure = {key: value for key, value in changes.items() if is_structural(key)}
    return structure, {key: value for key, value in changes.items() if key not in structure}
