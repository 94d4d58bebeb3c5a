"""How an FMU that is loaded takes a communication step: at once, or in parts where it discards it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, ClassVar

from ...errors import FmuError, RollbackError, StoppedError
from ...times import digits, slack
from ..interface import Interface
from .surroundings import ONE, SMALL, TINY, are_floats_disturbed

OK, WARNING, DISCARD, FATAL, PENDING = 0, 1, 2, 4, 5
_MOST_PARTS = 10_000


class Stepping(ABC):
    """One FMU's steps.

    Attributes:
        rolls_back: whether it is restored after a step that it discarded, for which its state is saved before each.
    """

    name: str
    interface: Interface
    time: float
    rolls_back: bool
    DO_STEP: ClassVar[str]

    @abstractmethod
    def mend(self) -> None:
        """Put the floating-point environment back."""

    @abstractmethod
    def check(self, call: str, status: int) -> None:
        """Raise unless the status of a call is ok or warning."""

    @abstractmethod
    def save(self) -> Any:
        """The present state."""

    @abstractmethod
    def restore(self, state: Any) -> None:
        """Come back to a saved state."""

    @abstractmethod
    def forget(self, state: Any) -> None:
        """Give a saved state back."""

    @abstractmethod
    def _failure(self, what: str, status: int) -> FmuError:
        """An error of a call."""

    def step(self, time: float, length: float, *, final: bool = True) -> None:
        """Advance from ``time`` by ``length``, both in s; not ``final`` where an older state may be restored."""
        if self.rolls_back:
            self._step_restoring(time, length)
            return
        self.time = time
        status = self._attempt(time, length, final, again=False)
        if ONE + SMALL != ONE or ONE - SMALL != ONE or TINY * ONE == 0.0:
            self.mend()
        if status or self._is_cut_short():
            self.resume(time, length, status, final)
        self.time = time + length

    def roll_back(self) -> None:
        """From now on be restored after steps that it discards."""
        self.rolls_back = True

    def resume(self, time: float, length: float, status: int, final: bool) -> None:
        """Go on after a step returned something else than ok: an FMU that discarded it may take it in parts.

        The standard (FMI 2.0, 4.2.2) lets an FMU stop early, at its last successful time, or refuse a step that is too
        long for it. The rest, or half of it, is then tried with the inputs held.

        Raises:
            StoppedError: it asks for the end of the simulation.
            RollbackError: it does not get on, but may if it is restored after a step that it discarded.
            FmuError: it failed, or does not get on.
        """
        try:
            self._go_on(time, length, status, final)
        except StoppedError:
            raise
        except FmuError as error:
            if status == DISCARD and error.status != "fatal" and self._may_roll_back():
                raise RollbackError(
                    Exception.__str__(error), instance=self.name, time=error.time, status=error.status, log=error.log
                ) from error
            raise

    def _may_roll_back(self) -> bool:
        face = self.interface
        return face.can_save_state and face.variable_step and not face.annotation and not self.rolls_back

    def _step_restoring(self, time: float, length: float) -> None:
        """Take a step in parts; the state before one that is discarded is restored, and a shorter one tried.

        A part ends where the FMU says that it got, or at half the length where it does not say.
        """
        end, part = time + length, length
        shortest = slack(length, time, end)
        for _ in range(_MOST_PARTS):
            self.time = time
            state = self.save()
            try:
                reached = self._try(time, part, state)
            finally:
                self.forget(state)
            if reached[0]:
                time, part = reached[1], end - reached[1]
            else:
                part = reached[1] - time
            if time >= end - shortest:
                self.time = end
                return
            if part < shortest:
                break
        raise self._failure(f"discarded the step{self._why(time, part)}", DISCARD)

    def _try(self, time: float, part: float, state: Any) -> tuple[bool, float]:
        """Whether a part of a step was taken, and where it ended; of one that is discarded, where to end instead."""
        status = self._attempt(time, part, False, again=False)
        if are_floats_disturbed():
            self.mend()
        reached = self._reached(time + part, status)
        if self._stops(status):
            when = time if reached is None else reached
            raise StoppedError("asks for the end of the simulation", instance=self.name, time=when)
        if status != DISCARD:
            self.check(self.DO_STEP, status)
            return True, time + part if reached is None else reached
        self.restore(state)
        on = reached is not None and time < reached < time + part - slack(part, time)
        return False, reached if on and reached is not None else time + 0.5 * part

    def _go_on(self, time: float, length: float, status: int, final: bool) -> None:
        self.time, end, part = time, time + length, length
        shortest = slack(length, time, end)
        for _ in range(_MOST_PARTS):
            reached = self._reached(time + part, status)
            if self._stops(status):
                when = time if reached is None else reached
                raise StoppedError("asks for the end of the simulation", instance=self.name, time=when)
            if reached is None:
                break
            if reached > end + shortest:
                what = f"says that it got to t = {digits(reached)} s in the step to t = {digits(end)} s"
                raise self._failure(what, status)
            on = reached > time + shortest
            time, part = (reached, end - reached) if on else (time, 0.5 * part)
            self.time = time
            if time >= end - shortest:
                return
            if part < shortest or not self.interface.variable_step:
                break
            status = self._attempt(time, part, final, again=not on)
            if are_floats_disturbed():
                self.mend()
        if status in (OK, WARNING, DISCARD):
            raise self._failure(f"discarded the step{self._why(reached, part)}", DISCARD)
        self.check(self.DO_STEP, status)

    def _why(self, reached: float | None, part: float) -> str:
        """Why what is left of a discarded step is not taken in parts, and what a user can do."""
        if reached is None:
            return " and does not say how far it got, so that nothing else can be tried"
        if not self.interface.variable_step:
            return ", and takes steps of one length only: choose another step"
        return f", and takes none from there on, not even one of {part:.2g} s"

    def _reached(self, end: float, status: int) -> float | None:
        """How far a step that was to reach ``end`` came; None if it failed."""
        if status in (OK, WARNING):
            reached = self._last_successful_time() if self._is_cut_short() else None
            return end if reached is None else reached
        return self._last_successful_time() if status == DISCARD else None

    @abstractmethod
    def _attempt(self, time: float, part: float, final: bool, *, again: bool) -> int:
        """Try a step or a part of one; ``again`` where a longer one from the same point was discarded."""

    @abstractmethod
    def _is_cut_short(self) -> bool:
        """Whether the last step, though it succeeded, ended before its end."""

    @abstractmethod
    def _last_successful_time(self) -> float | None:
        """How far a step came that was discarded or cut short; None if the FMU does not say."""

    @abstractmethod
    def _stops(self, status: int) -> bool:
        """Whether the FMU asks for the end of the simulation."""
