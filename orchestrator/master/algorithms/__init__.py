"""The master algorithms, one file each."""

from .iterative import find_blocks

__all__ = [
    "find_blocks",
]
