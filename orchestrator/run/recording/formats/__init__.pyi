from .endings import ENDINGS, check_ending, read_file, write_file
from .table import Table

__all__ = [
    "ENDINGS",
    "Table",
    "check_ending",
    "read_file",
    "write_file",
]
