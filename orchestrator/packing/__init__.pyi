from .container import Packed, pack
from .exchange import Exported, export

__all__ = [
    "Exported",
    "Packed",
    "export",
    "pack",
]
