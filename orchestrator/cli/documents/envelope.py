"""What stands around the document of a command."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Mistake:
    """One thing that is wrong with the input: where, what, and what to do; each may be empty but the second."""

    place: str
    message: str
    remedy: str


@dataclass(frozen=True)
class Failure:
    """Why a command failed: the message as stderr has it, and its parts.

    Attributes:
        message: for people. problems: one for each mistake in the input.
        instance: the FMU that failed, by its name in the scenario. time: of the run, in s.
    """

    message: str
    problems: list[Mistake] = field(default_factory=list)
    instance: str = ""
    time: float | None = None


@dataclass(frozen=True)
class Document:
    """What every command prints with ``--json``.

    Attributes:
        command: its name. exit_code: with which it ends.
        error: why it failed; null where it did not. A requirement that is not kept is no error, but exit code 1.
        result: what it found; null where it failed before there was anything. A run that fails on its way has both.
        version: of this form; it grows when a name is taken away or gets another meaning.
    """

    command: str
    exit_code: int
    error: Failure | None
    result: Any
    version: int = 1
