"""What makes an FMU the one it is: a hash of everything it is made from, the values it was given included."""

from __future__ import annotations

import functools
import hashlib
import importlib.metadata
import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ..components.component import Component
from ..components.errors import ComponentError
from .annotation import TOOL
from .description import arguments
from .embed import embedded_files
from .kinds import FmiVersion, FmuKind, Profile

_FOLDER = Path(__file__).parent
_MAKERS: dict[FmuKind, tuple[str, ...]] = {"python": (TOOL, "pythonfmu"), "native": (TOOL, "casadi")}
_MADE_BY = (
    *("*.py", "description/*.py", "documentation/*.py", "host/*.py", "native/*.py"),
    *("host/*.c", "host/*.txt", "host/*.xml", "resources/*.png", "resources/*.txt", "runtime/**/*.[ch]"),
)


def source_digest(component: Component, kind: FmuKind, profile: Profile = "standard", fmi: FmiVersion = "2") -> str:
    """Hash of what an FMU is made from, without making it: sources, values, and everything that packages them.

    Raises:
        ComponentError: the component cannot be embedded, or a package that makes this kind of FMU is not installed.
    """
    files, module = embedded_files(type(component))
    parts = {name: text.encode() for name, text in files.items()}
    how = f"{kind} {profile} FMI {fmi}"
    parts["/"] = f"{how} {module} {type(component).__qualname__} {given_values(component)}".encode()
    parts["/packaging"] = _packaging(kind)
    return digest_of(parts)


@functools.cache
def _packaging(kind: FmuKind) -> bytes:
    """The part that is the same for every component: this package, and the versions of those it calls."""
    files = sorted(path for pattern in _MADE_BY for path in _FOLDER.glob(pattern))
    parts = {path.relative_to(_FOLDER).as_posix(): path.read_bytes() for path in files}
    for name in _MAKERS[kind]:
        try:
            parts[f"/{name}"] = importlib.metadata.version(name).encode()
        except importlib.metadata.PackageNotFoundError:
            raise ComponentError(
                f"a {kind} FMU needs {name}, which is not installed: pip install 'railcosim[{kind}]'"
            ) from None
    return digest_of(parts).encode()


def given_values(component: Component) -> str:
    """Build arguments and the values that differ from the declared start values, as JSON."""
    values = component.present_values
    kept = (slot for slot in component.slots.values() if slot.name in values)
    changed = {s.name: np.asarray(values[s.name]).tolist() for s in kept if not np.array_equal(values[s.name], s.start)}
    return json.dumps(json.loads(arguments(component)) | changed, sort_keys=True)


def digest_of(files: Mapping[str, bytes]) -> str:
    """SHA-256 over names and contents."""
    digest = hashlib.sha256()
    for name, content in sorted(files.items()):
        digest.update(f"{len(name)}:{name}{len(content)}:".encode() + content)
    return digest.hexdigest()
