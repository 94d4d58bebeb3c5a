"""What a probe has done and found, line by line in a file that outlives its process."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

from .. import world


class Record:
    """Lines of a file, each a JSON object, written at once.

    An FMU that corrupts memory may end its process at any later moment: what had been found by then stays.

    Args:
        path: the file; it need not be there yet.
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    def add(self, **entry: Any) -> None:
        """Write a line."""
        number = world.open_descriptor(self.path, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o600)
        try:
            world.write(number, f"{json.dumps(entry)}\n".encode())
        finally:
            world.close(number)

    def trying(self, what: str) -> None:
        """Say what comes next, in case it is the last thing."""
        self.add(trying=what)

    def entries(self) -> list[dict[str, Any]]:
        """All lines; what was cut short or damaged is left out."""
        if not self.path.is_file():
            return []
        found = []
        for line in world.read_bytes(self.path).splitlines():
            try:
                entry = json.loads(line)
            except ValueError:
                continue
            if isinstance(entry, dict):
                found.append(entry)
        return found

    def last(self, key: str) -> Any:
        """The last value that was written under a key; None if there is none."""
        return next((entry[key] for entry in reversed(self.entries()) if key in entry), None)

    def deaths(self) -> dict[str, str]:
        """What took a process of this probe down, and how."""
        found, tried = {}, ""
        for entry in self.entries():
            tried = entry.get("trying", tried)
            if "died" in entry:
                found[tried] = str(entry["died"])
        return found
