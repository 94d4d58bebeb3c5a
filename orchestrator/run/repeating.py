"""`Repeater`: a system run again and again with other values, on instances that stay loaded."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import world
from ..errors import RunError
from ..evaluation import Part
from ..names import SignalName
from .checking import Checked, signal_names
from .crew import Crew
from .ending import Interruption
from .outcome import Status
from .recording.columns import Columns, InMemory
from .recording.seen import Seen
from .session import Job, Session
from .watching.divergence import explain_divergence, sources_in_cycles
from .watching.tail import POINTS


@dataclass(frozen=True)
class Flown:
    """How a run went.

    Attributes:
        status, error: as `Run` has them. recorded: what is kept of the points that are results.
        seen: the same of every communication point. steps: communication steps taken. stepping: wall time of
            them, s.
    """

    status: Status
    error: RunError | None
    recorded: Columns
    seen: Seen
    steps: int
    stepping: float


@contextmanager
def listening() -> Iterator[Interruption]:
    """Hear Ctrl-C and its like while many runs go on: they end the present one after its step.

    Raises:
        KeyboardInterrupt: afterwards, where one has come.
    """
    interruption = Interruption(lambda _: None)
    with interruption.listening():
        yield interruption
    interruption.pass_on()
    if interruption.is_asked_for:
        raise KeyboardInterrupt


class Repeater:
    """Runs a system of one structure: the same models and connections, with other values.

    The first run of instances that another maker's reset has brought back is done twice, on new ones as well: an
    instance that is not the same to the bit is not reset any more.

    Args:
        checked: the system.
        wanted: signals that are kept beside what metrics and requirements look at.

    Attributes:
        crew: the instances.
    """

    def __init__(self, checked: Checked, wanted: Collection[str]) -> None:
        interfaces = {name: model.interface for name, model in checked.models.items()}
        coupled = map(str, sources_in_cycles(checked.system, interfaces, checked.wiring.links))
        self.crew = Crew({*wanted, *checked.judge.needed_signals, *coupled})
        self._interfaces, self._links = interfaces, checked.wiring.links
        fixed = {f"{name}.{v.name}": v.start for name, face in interfaces.items() for v in face.of("parameter")}
        self._fixed: dict[str, Any] = fixed
        constant = fixed.keys() | checked.wiring.left.keys()
        self._names = dict.fromkeys(x for x in signal_names(interfaces, checked.wiring) if x not in constant)
        self._units = checked.units

    def fly(self, checked: Checked, interruption: Interruption) -> Flown | None:
        """One run; None where it was interrupted.

        Args:
            checked: the system with the values of the run.
            interruption: hears signals meanwhile.

        Raises:
            ScenarioError: initial values do not settle.
        """
        crew = self.crew
        crew.interruption = interruption
        crew.is_trial = crew.is_doubtful
        session = self._run(checked)
        if crew.is_trial and crew.untried and session.status != "interrupted":
            tried = set(crew.untried)
            crew.dismiss()
            reset, session = session, self._run(checked)
            if session.status != "interrupted":
                crew.find(tried, _strange(reset, session, tried))
        return None if session.status == "interrupted" else self._flown(session)

    def _run(self, checked: Checked) -> Session:
        session = Session(checked, Job("auto"), crew=self.crew)
        try:
            session.run(world.perf_counter(), lambda: None)
        finally:
            self.crew.settle(fit=session.status == "completed")
        return session

    def _flown(self, session: Session) -> Flown:
        checked, recording = session.checked, session.recording
        recorded = InMemory({"time": np.empty(0)}) if recording is None else recording.columns()
        columns = recorded if recording is None else recording.every_point(recorded)
        parameters = {**checked.wiring.left, **self._fixed}
        for instance, starts in checked.wiring.starts.items():
            for variable, value in starts.items():
                if (name := f"{instance}.{variable}") in self._fixed:
                    parameters[name] = value
        stepping, completed = checked.system.stepping, session.status == "completed"
        seen = Seen(columns, self._names, stepping.step, completed, stepping.stop_time, self._units, parameters)
        if session.status == "failed" and session.error is not None and recorded.points:
            last = Part(seen, recorded, 0, 0)
            points = (last,) if columns is recorded else (last, Part(seen, _last(columns), 0, 0))
            found = explain_divergence(checked.system, self._interfaces, self._links, points, session.error)
            if found is not None:
                session.error.explain(found.message)
        return Flown(
            session.status, session.error, recorded, seen, int(session.seconds["steps"]), session.seconds["stepping"]
        )


def _last(columns: Columns) -> Mapping[str, NDArray[Any]]:
    """As many of the last points as a single run remembers."""
    return columns.part(max(0, columns.points - POINTS), columns.points)


def _strange(reset: Session, new: Session, tried: Collection[str]) -> set[str]:
    """Which of the instances that were reset are not what new ones are, by all that two runs recorded of them.

    Those are meant whose outputs differ first; where others' do, it may be any.
    """
    if reset.recording is None or new.recording is None:
        return set() if str(reset.error) == str(new.error) else set(tried)
    one, other = reset.recording.columns(), new.recording.columns()
    count = min(one.points, other.points)
    first = {name: _first_difference(one[name][:count], other[name][:count]) for name in one}
    earliest = min(first.values())
    if earliest == count:
        return set() if str(reset.error) == str(new.error) and one.points == other.points else set(tried)
    owners = {SignalName.parse(name).instance for name, place in first.items() if place == earliest}
    return owners & set(tried) or set(tried)


def _first_difference(one: NDArray[Any], other: NDArray[Any]) -> int:
    """The first place at which two arrays of one length differ in a bit; their length where there is none."""
    differs = one != other if one.dtype.kind not in "f" else one.view(np.int64) != other.view(np.int64)
    return int(np.argmax(differs)) if differs.any() else len(one)
