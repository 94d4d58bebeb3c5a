"""What FMUs say while they run, kept by instance."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

from fmpy import fmi2
from fmpy.fmi1 import printLogMessage

from ...errors import FmuError, cut
from ..slave import STATUS

LOGS: dict[int | bytes, deque[str]] = {}
"""What living FMUs said, by the keys that each may hand back with its messages."""


def keep_message(keys: Sequence[int | bytes | None], status: int, message: bytes | None) -> bool:
    """Put a message into the log of the first key that is known; False if none is."""
    for key in keys:
        log = None if key is None else LOGS.get(key)
        if log is not None:
            label = STATUS[status] if 0 <= status < len(STATUS) else str(status)
            lines = (message or b"").decode(errors="replace").splitlines()
            log.extend(cut(f"[{label}] {line}") for line in lines)
            return True
    return False


def _log(environment: int | None, instance: bytes | None, status: int, category: bytes, message: bytes) -> None:
    if not keep_message((environment, instance), status, message):  # an FMU that FMPy runs beside us
        printLogMessage(environment, instance, status, category, message)  # type: ignore[arg-type]


LOGGER = fmi2.fmi2CallbackLoggerTYPE(_log)
"""One for all FMUs of FMI 1.0 and 2.0: FMPy's proxy, which fills a message's arguments in, knows only the logger it was
given last. They pass the same arguments, but for the first: the environment in 2.0, the instance's address in 1.0."""


def without_head(error: Exception) -> str:
    """What went wrong; of an error of ours without instance and time, which are said once."""
    return Exception.__str__(error) if isinstance(error, FmuError) else str(error)
