from .finding import find_feeders, find_loops
from .roots import SOLVED
from .solver import NUMBERS, LoopSolver

__all__ = ["NUMBERS", "SOLVED", "LoopSolver", "find_feeders", "find_loops"]
