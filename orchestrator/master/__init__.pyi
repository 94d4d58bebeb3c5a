from .algebraic_loops import find_loops
from .algorithms import ALGORITHMS, Explicit, Operation
from .checking import check_coupling, check_threads, describe_coupling
from .compiled import Sieve
from .event_check import check_events
from .initialization import settle
from .loop import Master
from .observer import Rows, Table
from .settings import Settings

__all__ = [
    "ALGORITHMS",
    "Explicit",
    "Master",
    "Operation",
    "Rows",
    "Settings",
    "Sieve",
    "Table",
    "check_coupling",
    "check_events",
    "check_threads",
    "describe_coupling",
    "find_loops",
    "settle",
]
