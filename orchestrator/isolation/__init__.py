"""An FMU in a process of its own: its crash, hang or leak is an error of that instance, not our end."""

from .choice import check_isolation, check_once_per_process, instantiate, is_isolated, isolate, isolation_notes
from .process import starting

__all__ = [
    "check_isolation",
    "check_once_per_process",
    "instantiate",
    "is_isolated",
    "isolate",
    "isolation_notes",
    "starting",
]
