from .changes import split_assignment
from .loading import load, shipped
from .patterns import NAME
from .toml_source import parse_value
from .trust import import_notes, untrusted_code

__all__ = [
    "NAME",
    "import_notes",
    "load",
    "parse_value",
    "shipped",
    "split_assignment",
    "untrusted_code",
]
