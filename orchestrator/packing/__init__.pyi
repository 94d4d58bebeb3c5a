from .container import Packed, pack

__all__ = [
    "Packed",
    "pack",
]
