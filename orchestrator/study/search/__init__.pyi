from .falsification import Falsification
from .methods import METHODS
from .preparation import InterruptedSearch
from .running import Falsified, Optimized, falsify, optimize

__all__ = [
    "METHODS",
    "Falsification",
    "Falsified",
    "InterruptedSearch",
    "Optimized",
    "falsify",
    "optimize",
]
