"""The errors of this package: one small family, each also the builtin a caller would catch."""

from collections.abc import Sequence
from itertools import groupby

from ..components.spelling import did_you_mean

__all__ = [
    "CouplingError",
    "ExpressionError",
    "FmuError",
    "FmuFileError",
    "LostError",
    "RailcosimError",
    "RunError",
    "ScenarioError",
    "StoppedError",
    "WindowError",
    "did_you_mean",
]


class RailcosimError(Exception):
    """Root of every error this project raises on purpose."""


class ScenarioError(RailcosimError, ValueError):
    """The user's input is wrong. `problems` holds one sentence per mistake; `str()` lists them all."""

    def __init__(self, problems: str | Sequence[str]) -> None:
        self.problems: list[str] = [problems] if isinstance(problems, str) else list(problems)
        super().__init__(self.problems)

    def __str__(self) -> str:
        return "\n".join(self.problems)


class ExpressionError(ScenarioError):
    """An expression cannot be read, or not be evaluated with the signals at hand."""


class WindowError(ExpressionError):
    """A time window that the recorded points do not cover: a value for it would be a guess."""


class FmuFileError(RailcosimError, ValueError):
    """An archive that cannot be used as an FMU."""


class RunError(RailcosimError, RuntimeError):
    """A run that had begun could not go on; what was computed until then is kept."""

    def explain(self, cause: str) -> None:
        """Add what is known of the cause to the message."""
        self.args = (f"{self.args[0]}; {cause}", *self.args[1:])


class CouplingError(RunError):
    """The values that instances exchange do not settle: a coupling diverges, or a loop has no solution."""


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
        where += [f"t = {self.time:g} s"] if self.time is not None else []
        where += [f"status {self.status}"] if self.status else []
        head = f"{', '.join(where)}: " if where else ""
        said = ((line, len(list(same))) for line, same in groupby(self.log))
        lines = (f"    {line}" + (f" ({count} times)" if count > 1 else "") for line, count in said)
        return "\n".join([f"{head}{super().__str__()}", *lines])


class LostError(FmuError):
    """The process of an isolated FMU is gone: it crashed, hung or used too much memory."""


class StoppedError(FmuError):
    """An FMU asks for the end of the simulation: no failure, but the end."""
