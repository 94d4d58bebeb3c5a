"""How many runs a chunk has: so many that what a chunk costs beside them vanishes, and no worker is idle at the end."""

from __future__ import annotations

_CHUNK = 1.0
"""What a chunk should take, in s."""
_LEAST = 0.05
"""What a chunk should take at least, in s, however few runs are left: twenty times what it costs to send."""
_SHARES = 4
"""Chunks that each worker gets of what is left, at least."""


class Pace:
    """Sizes of chunks, from how long runs took.

    Attributes:
        seconds: of a run, as the latest chunk had it; 0 before the first.
    """

    def __init__(self) -> None:
        self.seconds = 0.0

    def took(self, runs: int, seconds: float) -> None:
        """A chunk of so many runs took so many s."""
        self.seconds = max(seconds, 1e-9) / runs

    def size(self, left: int, workers: int) -> int:
        """How many runs the next chunk has, of those that are left; the first ones have one, to be measured."""
        if not self.seconds:
            return 1
        wanted = min(_CHUNK / self.seconds, max(left / (_SHARES * workers), _LEAST / self.seconds))
        return max(1, min(left, int(wanted)))
