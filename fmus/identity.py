"""What makes an FMU the one it is: a hash of everything in it, the values it was given included."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping

import numpy as np

from ..components.component import Component


def given_values(component: Component) -> str:
    """Build arguments and the values that differ from the declared start values, as JSON."""
    values = component.__dict__
    kept = (slot for slot in component.slots.values() if slot.name in values)
    changed = {s.name: np.asarray(values[s.name]).tolist() for s in kept if not np.array_equal(values[s.name], s.start)}
    return json.dumps(component.build_arguments | changed, sort_keys=True)


def digest_of(files: Mapping[str, bytes]) -> str:
    """SHA-256 over names and contents."""
    digest = hashlib.sha256()
    for name, content in sorted(files.items()):
        digest.update(f"{len(name)}:{name}{len(content)}:".encode() + content)
    return digest.hexdigest()
