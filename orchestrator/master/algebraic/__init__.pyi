from .finding import find_feeders, find_loops
from .solver import LoopSolver

__all__ = ["LoopSolver", "find_feeders", "find_loops"]
