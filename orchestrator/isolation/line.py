"""The line of a process of isolated instances to the master, as they see it."""

from __future__ import annotations

import errno
import os

from .. import world
from .messages import NOTE_CALL, NOTE_LINE, Door

_NO_LINE = (errno.EBADF, errno.ENOTSOCK)
"""What the system says of a line that was closed on this side, and of a file that has its number since."""


class Line:
    """The way to the master, and back, of all instances of this process.

    Args:
        door: to the master.
        notes: of the process, at the head of the memory that is shared with the master.
    """

    def __init__(self, door: Door, notes: memoryview) -> None:
        self._door, self._notes = door, notes
        self._process = os.getpid()

    def receive(self) -> tuple[int, bytes]:
        """The next frame."""
        try:
            return self._door.receive()
        except OSError as error:
            self._note(error)
            raise

    def answer(self, frame: bytes, notes: memoryview) -> None:
        """Tell the master what came of a call, which is over; the notes are those of the instance."""
        if os.getpid() != self._process:  # a process that an FMU has forked, and that came back from the call
            world.exit_at_once(0)
        call, notes[NOTE_CALL] = notes[NOTE_CALL], 0
        try:
            self._door.send(frame)
        except OSError as error:
            notes[NOTE_CALL] = call
            self._note(error)
            raise

    def _note(self, error: OSError) -> None:
        """Tell the master why it will not hear any more, where the FMU has closed the line."""
        if error.errno in _NO_LINE:
            self._notes[NOTE_LINE] = 1
