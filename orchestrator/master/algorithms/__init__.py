"""The master algorithms, one file each: what each needs, what it can, and how it takes a step.

A file that stands here is found; nothing else needs to know of it.
"""

from importlib import import_module
from pkgutil import iter_modules

from .algorithm import (
    ALGORITHMS,
    Algorithm,
    Batch,
    Explicit,
    Fit,
    FixedStep,
    Operation,
    Programmed,
    Repeated,
    VariableStep,
)
from .iteration import HEAD, Iteration

for _module in iter_modules(__path__):
    import_module(f"{__name__}.{_module.name}")

__all__ = [
    "ALGORITHMS",
    "HEAD",
    "Algorithm",
    "Batch",
    "Explicit",
    "Fit",
    "FixedStep",
    "Iteration",
    "Operation",
    "Programmed",
    "Repeated",
    "VariableStep",
]
