"""Scenarios: TOML to `System` and back.

The format is described in `docs/scenarios.md`. `toml_source` reads the text, `reader` makes a draft of it, `changes`
applies presets and options, and `loading` makes the draft a `System`.
"""

from .loading import load, shipped
from .patterns import NAME
from .toml_source import parse_value

__all__ = [
    "NAME",
    "load",
    "parse_value",
    "shipped",
]
