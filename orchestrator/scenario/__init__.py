"""Scenarios: TOML to `System` and back.

The format is described in `docs/scenarios.md`. `toml_source` reads the text, `reader` makes a draft of it, `changes`
applies presets and options, and `loading` makes the draft a `System`.
`trust` tells which Python files a scenario imports. `values` changes values in a system that is loaded.
"""

from ...components.doors import hang_door

hang_door(__name__)
