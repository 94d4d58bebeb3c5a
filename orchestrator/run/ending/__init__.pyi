from .conclusion import conclude
from .interruption import Interruption

__all__ = ["Interruption", "conclude"]
