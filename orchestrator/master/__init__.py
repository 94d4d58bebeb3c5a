"""How time advances: initialization, then communication steps by one of the `algorithms`.

`loop` is the loop over communication points, `exchange` the values between instances; `events`, `extrapolation` and
`algebraic_loops` are what may happen at a point, in a step and within an instant. `compiled` hands steps to the C
kernel.
"""

from .algebraic_loops import find_loops
from .algorithms import ALGORITHMS, Explicit, Operation
from .checking import check_coupling, check_threads, describe_coupling
from .event_check import check_events
from .initialization import settle
from .loop import Master
from .observer import Rows
from .settings import Settings

__all__ = [
    "ALGORITHMS",
    "Explicit",
    "Master",
    "Operation",
    "Rows",
    "Settings",
    "check_coupling",
    "check_events",
    "check_threads",
    "describe_coupling",
    "find_loops",
    "settle",
]
