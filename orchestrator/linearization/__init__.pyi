from .closed_loop import Linearization, linearize
from .figures import draw_linear
from .modes import Mode, Stability, stability
from .record import write_linear
from .responses import Passing, default_input, string_stability

__all__ = [
    "Linearization",
    "Mode",
    "Passing",
    "Stability",
    "default_input",
    "draw_linear",
    "linearize",
    "stability",
    "string_stability",
    "write_linear",
]
