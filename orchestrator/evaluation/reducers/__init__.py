"""How one number is made of a whole run: the points that count, and what remembers what was seen of them."""

from . import folds
from .folds import Fold
from .platoon import PLATOON
from .windows import Selection, Span, Window, at, ends_of, nothing_in_window, scalar, span_of, time_windows, window_of

__all__ = [
    "PLATOON",
    "Fold",
    "Selection",
    "Span",
    "Window",
    "at",
    "ends_of",
    "folds",
    "nothing_in_window",
    "scalar",
    "span_of",
    "time_windows",
    "window_of",
]
