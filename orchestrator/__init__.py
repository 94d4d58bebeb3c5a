"""The master orchestrator: `System`, `load` and `run` are what a script needs."""

from .errors import FmuError, FmuFileError, RailcosimError, ScenarioError
from .results import Results
from .run import Run, run
from .scenario import load
from .system import Connection, Instance, System

__all__ = [
    "Connection",
    "FmuError",
    "FmuFileError",
    "Instance",
    "RailcosimError",
    "Results",
    "Run",
    "ScenarioError",
    "System",
    "load",
    "run",
]
