from .bars import progress_bar
from .errors import CouplingError, FmuError, FmuFileError, RailcosimError, RunError, ScenarioError
from .evaluation import robustness
from .run import Results, Run, resume, run
from .scenario import load
from .study import Batch, Study
from .system import Connection, Event, Instance, System

__all__ = [
    "Batch",
    "Connection",
    "CouplingError",
    "Event",
    "FmuError",
    "FmuFileError",
    "Instance",
    "RailcosimError",
    "Results",
    "Run",
    "RunError",
    "ScenarioError",
    "Study",
    "System",
    "load",
    "progress_bar",
    "resume",
    "robustness",
    "run",
]
