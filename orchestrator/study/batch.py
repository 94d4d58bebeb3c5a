"""`Batch`: one system run many times, to the same bits as that many single runs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from contextlib import ExitStack
from types import TracebackType
from typing import Any

from .. import world
from ..errors import ScenarioError
from ..evaluation import Verdict
from ..fmi import Kind, Workspace
from ..fmi.binding import forget_paths
from ..names import SignalName
from ..problems import Problem, suggestion
from ..run import Checked, Flown, Interruption, Repeater, Revision, listening, signal_names
from ..system import System
from .rows import Outcomes, Row, margins, scaled


class Batch:
    """One system, run many times with other values; nothing is recorded but what is asked for.

    A run gives what the single run of the changed system gives, to the bit, whatever was run before it.

    Args:
        system: from `load`, or built by hand.
        kind: how components become models, as `run` has it.
        record: signals whose values over time are wanted, by full name; a group or an array without its index stands
            for all of it.
        evaluate: whether metrics and requirements are evaluated.

    Attributes:
        metrics: the flat names of the metrics: ``"settling"``, ``"gap_min[2]"``. requirements: those of requirements.

    Raises:
        ScenarioError: the system cannot run, or a signal that is to be recorded does not exist.
    """

    def __init__(
        self, system: System, *, kind: Kind = "auto", record: Sequence[str] = (), evaluate: bool = True
    ) -> None:
        self._evaluate, self._held = evaluate, ExitStack()
        self._workspace = self._held.enter_context(Workspace())
        try:
            self._held.callback(forget_paths, self._workspace.folder)
            self._revision = Revision(system, self._workspace, kind)
            checked = self._revision.checked
            interfaces = {name: model.interface for name, model in checked.models.items()}
            self._record = _recorded(record, signal_names(interfaces, checked.wiring))
        except BaseException:
            self._held.close()
            raise
        self.metrics = checked.judge.value_names if evaluate else ()
        self.requirements = checked.judge.requirement_names if evaluate else ()
        self._repeaters: list[tuple[Checked, Repeater]] = []

    @property
    def notes(self) -> list[str]:
        """What a user should know of the system, and of how its runs are made."""
        crews = [repeater.crew.notes for _, repeater in self._repeaters]
        return list(dict.fromkeys([*self._revision.checked.notes, *(note for notes in crews for note in notes)]))

    def __enter__(self) -> Batch:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Give everything back; no run may follow."""
        self._held.close()

    def checked(self, changes: Mapping[str, Any]) -> Checked:
        """The system with changes, found fit to run.

        Raises:
            ScenarioError: it is not.
        """
        return self._revision.of(changes)

    def run(self, changes: Mapping[str, Any] | None = None) -> Row:
        """One run. What fails in it is told by its status, and never raised.

        Args:
            changes: values by key, as `changed` takes them.

        Raises:
            KeyboardInterrupt: the user stops it.
        """
        return self.run_all([changes or {}]).rows[0]

    def run_all(self, runs: Iterable[Mapping[str, Any]]) -> Outcomes:
        """Many runs, one after another.

        Args:
            runs: the changes of each.

        Raises:
            KeyboardInterrupt: the user stops it.
        """
        rows = []
        with listening() as interruption:
            for changes in runs:
                row = self._run(changes, interruption)
                if row is None:
                    break
                rows.append(row)
        return Outcomes.of(rows, self.metrics, self.requirements)

    def _run(self, changes: Mapping[str, Any], interruption: Interruption) -> Row | None:
        """One run; None where it was interrupted."""
        begin = world.perf_counter()
        try:
            checked = self._revision.of(changes)
            flown = self._repeater(checked).fly(checked, interruption)
        except ScenarioError as error:
            return Row("refused", str(error), seconds=world.perf_counter() - begin)
        return None if flown is None else self._row(checked, flown, begin)

    def _repeater(self, checked: Checked) -> Repeater:
        """What runs systems of this structure: nearly always that of the first run."""
        for known, repeater in self._repeaters:
            if known.wiring.every_link == checked.wiring.every_link and known.order == checked.order:
                return repeater
        made = Repeater(checked, self._record)
        self._held.callback(made.crew.dismiss)
        self._repeaters.append((checked, made))
        return made

    def _row(self, checked: Checked, flown: Flown, begin: float) -> Row:
        metrics: dict[str, float] = {}
        verdicts: list[Verdict] = []
        if self._evaluate and flown.seen.points:
            seen = checked.judge.prepared(flown.seen)
            metrics, verdicts = checked.judge.values(seen), checked.judge.verdicts(seen)
        columns = flown.recorded
        return Row(
            flown.status,
            str(flown.error or ""),
            metrics,
            {verdict.name: verdict.verdict for verdict in verdicts},
            margins(verdicts),
            scaled(verdicts),
            series={name: columns[name] for name in ("time", *self._record)} if self._record else None,
            steps=flown.steps,
            seconds=world.perf_counter() - begin,
        )


def _recorded(wanted: Sequence[str], names: Sequence[str]) -> list[str]:
    """The signals that are to be recorded, each once."""
    found: dict[str, None] = {}
    problems = []
    for text in wanted:
        ones = [name for name in names if SignalName.parse(text).covers(SignalName.parse(name))]
        found |= dict.fromkeys(ones)
        if not ones:
            problems.append(Problem("record", f"there is no signal {text!r}", suggestion(text, names)))
    if problems:
        raise ScenarioError(problems)
    return list(found)
