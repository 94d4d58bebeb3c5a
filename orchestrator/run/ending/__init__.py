"""How a run ends before its time: signals that ask for it, and processes that are gone."""

from .conclusion import conclude
from .interruption import Interruption

__all__ = ["Interruption", "conclude"]
