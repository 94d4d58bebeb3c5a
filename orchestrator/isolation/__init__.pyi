from .choice import ALL, check_isolation, check_once_per_process, instantiate, is_isolated, isolate, isolation_notes
from .launch import CRASHES, end_process, end_with_parent, signal_name, starting
from .proxy import IsolatedSlave

__all__ = [
    "ALL",
    "CRASHES",
    "IsolatedSlave",
    "check_isolation",
    "check_once_per_process",
    "end_process",
    "end_with_parent",
    "instantiate",
    "is_isolated",
    "isolate",
    "isolation_notes",
    "signal_name",
    "starting",
]
