from .container import pack

__all__ = [
    "pack",
]
