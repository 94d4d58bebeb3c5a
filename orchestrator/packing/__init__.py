"""A whole scenario as one FMU."""

from .container import pack

__all__ = [
    "pack",
]
