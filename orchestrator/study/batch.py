"""`Batch`: one system run many times, to the same bits as that many single runs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from types import TracebackType
from typing import Any

from .. import world
from ..errors import ScenarioError
from ..evaluation import value_name
from ..fmi import Kind, Workspace
from ..names import SignalName
from ..problems import Problem, suggestion
from ..run import Run, check, execute, signal_names
from ..scenario import changed
from ..system import System
from .rows import Outcomes, Row, margins


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
        notes: what a user should know of how runs are made.

    Raises:
        ScenarioError: the system cannot run, or a signal that is to be recorded does not exist.
    """

    def __init__(
        self, system: System, *, kind: Kind = "auto", record: Sequence[str] = (), evaluate: bool = True
    ) -> None:
        self.system, self._kind, self._evaluate = system, kind, evaluate
        with Workspace() as workspace:
            checked = check(system, workspace, kind)
            interfaces = {name: model.interface for name, model in checked.models.items()}
            names = signal_names(interfaces, checked.wiring)
        self.metrics = checked.judge.value_names if evaluate else ()
        self.requirements = checked.judge.requirement_names if evaluate else ()
        self.notes: list[str] = list(checked.notes)
        self._record = _recorded(record, names)

    def __enter__(self) -> Batch:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Give everything back; no run may follow."""

    def run(self, changes: Mapping[str, Any] | None = None) -> Row:
        """One run. What fails in it is told by its status, and never raised.

        Args:
            changes: values by key, as `changed` takes them.

        Raises:
            KeyboardInterrupt: the user stops it.
        """
        begin = world.perf_counter()
        try:
            made = changed(self.system, changes or {})
            outcome = execute(made, kind=self._kind)
        except ScenarioError as error:
            return Row("refused", str(error), seconds=world.perf_counter() - begin)
        if outcome.status == "interrupted":
            raise KeyboardInterrupt
        return self._row(outcome, world.perf_counter() - begin)

    def run_all(self, runs: Iterable[Mapping[str, Any]]) -> Outcomes:
        """Many runs, one after another.

        Args:
            runs: the changes of each.

        Raises:
            KeyboardInterrupt: the user stops it.
        """
        return Outcomes.of(map(self.run, runs), self.metrics, self.requirements)

    def _row(self, outcome: Run, seconds: float) -> Row:
        recorded = {name: outcome[name] for name in self._record}
        series = {"time": outcome.time, **recorded} if self._record else None
        metrics = {value_name(one.name, k): x for one in outcome.metrics for k, x in one.values.items()}
        verdicts = outcome.requirements if self._evaluate else []
        return Row(
            outcome.status,
            str(outcome.error or ""),
            metrics if self._evaluate else {},
            {verdict.name: verdict.verdict for verdict in verdicts},
            margins(verdicts),
            series=series,
            steps=int(outcome.seconds["steps"]),
            seconds=seconds,
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
