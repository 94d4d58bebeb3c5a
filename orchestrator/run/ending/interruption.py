"""Signals that ask a run to end: in order at the first, at once at the second, whatever its FMUs are doing."""

from __future__ import annotations

import contextlib
import logging
import signal
import socket
import threading
from collections.abc import Callable, Iterator
from types import FrameType

from ... import world
from ...fmi.guard import NOTES, described, end_streams

_LOG = logging.getLogger(__name__)
_ASKING = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
_TOGETHER = 0.1
"""Signals that come within so many s are one: a terminal, a shell and a parent may each pass it on."""
_PATIENCE = 0.5
"""How long, in s, a second signal leaves Python to end the run by itself, before the process is ended."""


class Interruption:
    """Ends a run when signals ask for that, while it is entered in the main thread; elsewhere it does nothing.

    Ctrl-C, SIGTERM and SIGHUP ask for the end after the present step; a signal that is ignored stays ignored. A second
    one raises KeyboardInterrupt. Where that has no effect, because an FMU does not return, a thread that watches over
    it ends the process, after what was computed has been saved.

    Args:
        abandon: saves what can be saved, and is told why; it is called in another thread.

    Attributes:
        number: the signal that asked first, 0 where none did.
    """

    def __init__(self, abandon: Callable[[str], None]) -> None:
        self.number = 0
        self._abandon = abandon
        self._asked = self._answered = 0
        self._last, self._is_over = -_TOGETHER, False

    @property
    def is_asked_for(self) -> bool:
        """Whether the run is to end after the present step."""
        return self.number != 0

    @contextlib.contextmanager
    def listening(self) -> Iterator[None]:
        """Listen to signals meanwhile; afterwards they are again for whom they were before."""
        if threading.current_thread() is not threading.main_thread():
            yield
            return
        # None is a handler that Python has not installed, and could not put back.
        before = {number: signal.getsignal(number) for number in _ASKING}
        before = {number: handler for number, handler in before.items() if handler not in (None, signal.SIG_IGN)}
        near, far = socket.socketpair()  # from this process to itself
        near.setblocking(False)
        with near, far:
            woken = signal.set_wakeup_fd(near.fileno(), warn_on_full_buffer=False)
            watch = threading.Thread(target=self._watch, args=(far, woken), name="interruption", daemon=True)
            watch.start()
            try:
                for number in before:
                    signal.signal(number, self._answer)
                yield
            finally:
                self._is_over = True
                for number, handler in before.items():
                    signal.signal(number, handler)
                signal.set_wakeup_fd(woken)
                near.send(b"\0")
                watch.join()

    def pass_on(self) -> None:
        """Tell a handler of the application's, which the run has kept from the signal that ended it."""
        handler = signal.getsignal(self.number) if self.number else None
        if callable(handler) and handler is not signal.default_int_handler:
            signal.raise_signal(self.number)

    def _answer(self, number: int, _: FrameType | None) -> None:
        """In the main thread, as soon as it is back in Python."""
        self.number = self.number or number
        self._answered = max(self._asked, 1)
        if self._asked > 1 and not self._is_over:
            raise KeyboardInterrupt

    def _watch(self, far: socket.socket, woken: int) -> None:
        """In a thread of its own: hear signals as they come, also while the main thread is in an FMU."""
        while (numbers := far.recv(1)) not in (b"", b"\0"):
            if woken >= 0:  # of an event loop, which hears of them after the run
                with contextlib.suppress(OSError):
                    world.write(woken, numbers)
            now = world.monotonic()
            is_same, self._last = now - self._last < _TOGETHER, now
            if is_same or numbers[0] not in _ASKING:
                continue
            self._asked += 1
            if self._asked > 1:
                self._insist(numbers[0])
                self._last = world.monotonic()  # what comes at once is an echo of that

    def _insist(self, number: int) -> None:
        """See to it that the main thread answers, or end the process."""
        main, until = threading.main_thread().ident, world.monotonic() + _PATIENCE
        if hasattr(signal, "pthread_kill") and main is not None:
            signal.pthread_kill(main, number)  # which may wait for a message
        while self._answered < self._asked and not self._is_over:
            if world.monotonic() > until:
                self._end(number)
            world.sleep(0.01)

    def _end(self, number: int) -> None:
        seen = described(NOTES.under_way())
        why = f"{seen} does not return" if seen else "what goes on does not end"
        message = f"interrupted: {why}"
        try:
            self._abandon(message)
        except Exception:
            _LOG.exception("what was computed could not be saved")
        _LOG.error("%s; isolate what hangs to keep that to itself", message)
        end_streams()
        NOTES.decide(128 + number)
        world.exit_at_once(128 + number)
