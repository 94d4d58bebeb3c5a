from .methods import METHODS
from .running import Falsified, Optimized, falsify, optimize

__all__ = [
    "METHODS",
    "Falsified",
    "Optimized",
    "falsify",
    "optimize",
]
