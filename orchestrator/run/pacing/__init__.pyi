from .pacer import LATE, Late, Pacer, RealTime

__all__ = [
    "LATE",
    "Late",
    "Pacer",
    "RealTime",
]
