"""Scenarios: TOML to `System` and back.

The format is described in `docs/scenarios.md`. `toml_source` reads the text, `reader` makes a draft of it, `changes`
applies presets and options, and `loading` makes the draft a `System`.
`trust` tells which Python files a scenario imports.
"""

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
