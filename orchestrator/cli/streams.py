"""Standard output and error that cannot break a simulation: closed, full, or with a reader that is gone."""

from __future__ import annotations

import errno
import io
import os
import select
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, BinaryIO, TextIO, cast

from .. import world

_STANDARD = (0, 1, 2)


def secure_streams() -> None:
    """Make ``sys.stdout`` and ``sys.stderr`` take everything, whatever becomes of it.

    Where one of the standard descriptors is closed it leads to nowhere from now on: the next file to be opened would
    get its number, and all that an FMU prints with it.
    """
    for descriptor in _STANDARD:
        try:
            os.fstat(descriptor)
        except OSError:
            world.open_descriptor(os.devnull, os.O_RDWR)  # takes the lowest free number, which is this one
    sys.stdout = _secured(sys.stdout, 1)
    sys.stderr = _secured(sys.stderr, 2)


@contextmanager
def aside() -> Iterator[None]:
    """Keep standard output free for what is printed afterwards: until then all goes to standard error.

    In the process of a command that is for good what an FMU prints, too: its C library may print it late.
    """
    kept, raw = sys.stdout, _raw(sys.stdout)
    if isinstance(raw, _Tolerant) and raw.fileno() == 1:
        kept.flush()
        kept = _secured(kept, os.dup(1))
        os.dup2(2, 1)
    sys.stdout = sys.stderr
    try:
        yield
    finally:
        sys.stdout = kept


def _raw(stream: TextIO) -> object:
    return getattr(getattr(stream, "buffer", None), "raw", None)


def flush_streams() -> None:
    """See to it that nothing stays behind; say what was lost, if anybody hears."""
    sys.stdout.flush()
    raw = _raw(sys.stdout)
    if isinstance(raw, _Tolerant) and raw.trouble not in (None, errno.EPIPE):
        print(f"warning: what was printed is lost: {os.strerror(raw.trouble or 0)}", file=sys.stderr)
    sys.stderr.flush()


class _Tolerant(io.FileIO):
    """A descriptor that is always written to with success; `trouble` is the number of the error that began a loss."""

    trouble: int | None = None

    def write(self, content: Any) -> int:
        view, done = memoryview(content).cast("B"), 0
        while self.trouble is None and done < len(view):
            try:
                written = super().write(view[done:])
            except OSError as error:
                self.trouble = error.errno
                break
            if written is None:  # a pipe that somebody else has told not to wait
                select.select([], [self], [])
            done += written or 0
        return len(view)


def _secured(stream: TextIO | None, descriptor: int) -> TextIO:
    """The same stream, tolerant. The console of Windows is no file, and left alone."""
    if stream is not None and sys.platform == "win32" and stream.isatty():
        return stream
    encoding = stream.encoding if stream is not None else "utf-8"
    raw = cast(BinaryIO, _Tolerant(descriptor, "w", closefd=False))
    lines = descriptor == 2 or raw.isatty()
    # A terminal or pipe may lack letters that a title or a file name has.
    return io.TextIOWrapper(
        io.BufferedWriter(cast(Any, raw)), encoding=encoding, errors="backslashreplace", line_buffering=lines
    )
