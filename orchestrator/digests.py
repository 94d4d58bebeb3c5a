"""What a file holds, as a number: by it caches and studies know FMUs and archives, whatever they are called."""

import hashlib
from collections.abc import Callable
from pathlib import Path

from . import world
from .errors import ScenarioError


def digest_of(path: Path, error: Callable[[str], Exception] = ScenarioError) -> str:
    """SHA-256 of a file.

    Args:
        path: of the file.
        error: made of a sentence where it cannot be read.

    Raises:
        ScenarioError: or the other error: it cannot be read.
    """
    try:
        with world.open(path, "rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except OSError as cause:
        raise error(f"{path} cannot be read: {cause.strerror or cause}") from cause
