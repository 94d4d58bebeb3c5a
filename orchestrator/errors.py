"""The errors of this package: one small family, each also the builtin a caller would catch."""

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from itertools import groupby
from pathlib import Path

from .names import SignalName
from .problems import Problem
from .times import digits


class RailcosimError(Exception):
    """Root of every error this project raises on purpose."""


class ScenarioError(RailcosimError, ValueError):
    """The user's input is wrong. `problems` holds all mistakes; `str()` lists them, a line each."""

    def __init__(self, problems: str | Problem | Iterable[Problem]) -> None:
        match problems:
            case str():
                self.problems = [Problem("", problems)]
            case Problem():
                self.problems = [problems]
            case _:
                self.problems = list(problems)
        super().__init__(self.problems)

    def __str__(self) -> str:
        return "\n".join(map(str, self.problems))

    def at(self, place: str, *names: SignalName) -> list[Problem]:
        """Its problems, seen from further out."""
        return [problem.at(place, *names) for problem in self.problems]


class ExpressionError(ScenarioError):
    """An expression cannot be read, or not be evaluated with the signals at hand."""


class WindowError(ExpressionError):
    """A time window that the recorded points do not cover: a value for it would be a guess."""


class SignalError(RailcosimError, KeyError):
    """There is no such signal; the message names those there are."""

    def __str__(self) -> str:
        return str(self.args[0])  # not its repr, as a KeyError has it


class FigureError(ScenarioError):
    """Some figures cannot be drawn; `drawn` are the files of the others."""

    def __init__(self, problems: Sequence[Problem], drawn: Sequence[Path]) -> None:
        super().__init__(problems)
        self.drawn = list(drawn)


class FmuFileError(RailcosimError, ValueError):
    """An archive that cannot be used as an FMU."""


class RunError(RailcosimError, RuntimeError):
    """A run that had begun could not go on; what was computed until then is kept."""

    def explain(self, cause: str) -> None:
        """Add what is known of the cause to the message."""
        self.args = (f"{self.args[0]}; {cause}", *self.args[1:])


class CouplingError(RunError):
    """The values that instances exchange do not settle: a coupling diverges, or a loop has no solution."""


class RecordError(RunError):
    """What a run records cannot be written: a disk is full, or a directory is gone."""


class LateError(RunError):
    """A run that is to keep pace with the clock came too late."""


class FmuError(RunError):
    """An FMU failed while it ran.

    Attributes: `instance` (its name in the scenario), `time` [s] or None when before the start, `status`
    (the FMI status in words), `log` (what it said, oldest line first).
    """

    def __init__(
        self, message: str, *, instance: str = "", time: float | None = None, status: str = "", log: Sequence[str] = ()
    ) -> None:
        super().__init__(message)
        self.instance, self.time, self.status, self.log = instance, time, status, list(log)

    def __str__(self) -> str:
        where = [self.instance] if self.instance else []
        where += [f"t = {digits(self.time)} s"] if self.time is not None else []
        where += [f"status {self.status}"] if self.status else []
        head = f"{', '.join(where)}: " if where else ""
        said = ((line, len(list(same))) for line, same in groupby(self.log))
        lines = (f"    {line}" + (f" ({count} times)" if count > 1 else "") for line, count in said)
        return "\n".join([f"{head}{super().__str__()}", *lines])


@contextmanager
def naming(path: Path) -> Iterator[None]:
    """Let an error of the system's name the file: those of writing to one that is open do not."""
    try:
        yield
    except OSError as error:
        error.filename = error.filename or str(path)
        raise


def cut(line: str, length: int = 500) -> str:
    """A line of an FMU's log at no more than some length, with a count of what was left out."""
    return line if len(line) <= length else f"{line[:length]}... ({len(line) - length} more characters)"


class RollbackError(FmuError):
    """An FMU that discarded a step does not go on from where it is: it may if it is restored first."""


class LostError(FmuError):
    """An FMU must not be called any more: its process is gone (a crash, a hang, too much memory), or it left a call."""


class StoppedError(FmuError):
    """An FMU asks for the end of the simulation: no failure, but the end."""
