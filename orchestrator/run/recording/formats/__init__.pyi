from .endings import ENDINGS, read_file
from .table import Table

__all__ = [
    "ENDINGS",
    "Table",
    "read_file",
]
