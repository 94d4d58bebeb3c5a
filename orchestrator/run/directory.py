"""The directory of a run: one run at a time owns it, from before its first file until after its last."""

from __future__ import annotations

import os
import socket
from pathlib import Path
from types import TracebackType
from typing import Any

from filelock import Timeout

from .. import world
from ..errors import RailcosimError
from .recording import read_json

LOCK_FILE = ".lock"


class RunDirectory:
    """A directory, locked while this is entered.

    Args:
        path: of the directory; where a relative one leads is settled here, whatever an FMU does to the process.
        identity: of the run, where it is known: all its files carry it.
        record: the file that tells which run, or study, has it.

    Attributes:
        given: the directory as it was named, for messages. path: where it is.
    """

    def __init__(self, path: Path, identity: str = "", record: str = "run.json") -> None:
        self.given = path
        self.path = path.absolute()
        self.identity = identity
        self._record = record
        self._lock = world.lock(self.path / LOCK_FILE)

    @property
    def marks(self) -> dict[str, Any]:
        """What ``run.json`` says of the run and of the process that it goes on in."""
        return {"run": self.identity, "process": {"pid": os.getpid(), "host": socket.gethostname()}}

    def __enter__(self) -> RunDirectory:
        """Take the directory.

        Raises:
            RailcosimError: another run has it, or it cannot be used.
        """
        try:
            world.mkdir(self.path, parents=True, exist_ok=True)
            self._lock.acquire(timeout=0)
        except Timeout:
            raise RailcosimError(
                f"{self.given} is in use by another run{self._holder()}; name another directory by -o, or wait for it"
            ) from None
        except OSError as error:
            raise RailcosimError(
                f"the output directory {self.given} cannot be used: {error.strerror or error}"
            ) from error
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._lock.release()

    def _holder(self) -> str:
        """Which run has it, as far as its record says."""
        try:
            record = read_json(self.path / self._record)
            process = record["process"]
            return f" ({record['scenario'] or 'of Python'}, process {process['pid']} on {process['host']})"
        except (OSError, ValueError, LookupError, TypeError):
            return ""
