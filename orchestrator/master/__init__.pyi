from .algebraic import find_loops
from .algorithms import ALGORITHMS, Explicit, Operation
from .checking import check_coupling, check_threads, describe_coupling
from .compiled import HAS_KERNEL, note_swings
from .event_check import check_events
from .initialization import settle
from .loop import Master
from .observer import Rows, Table
from .plans import SWING
from .settings import Settings

__all__ = [
    "ALGORITHMS",
    "HAS_KERNEL",
    "SWING",
    "Explicit",
    "Master",
    "Operation",
    "Rows",
    "Settings",
    "Table",
    "check_coupling",
    "check_events",
    "check_threads",
    "describe_coupling",
    "find_loops",
    "note_swings",
    "settle",
]
