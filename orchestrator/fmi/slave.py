"""The face of one model instance, whatever it is made of: set, step, get; save and restore."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

from .interface import Interface, Type

STATUS = ("ok", "warning", "discard", "error", "fatal", "pending")
"""The standard's names of what a call may return, by number."""


class Channel(Protocol):
    """Some variables of one type of one instance, prepared for being set or read together."""

    def set(self, values: Sequence[Any]) -> None:
        """Set all of them."""

    def get(self) -> list[Any]:
        """Read all of them."""


class Slave(Protocol):
    """One instance. Every method raises `FmuError` with instance, time, status and log when the model fails.

    ``time`` is how far it has got, in s; ``log`` what it said, oldest line first; ``disturbed`` what it has done to the
    process that it shares with others.
    """

    name: str
    interface: Interface
    time: float
    disturbed: dict[str, None]

    def setup(self, start_time: float, stop_time: float) -> None:
        """Announce the experiment, whose stop time may be infinite, and enter nothing yet."""

    def enter_initialization(self) -> None:
        """Enter initialization mode."""

    def exit_initialization(self) -> None:
        """Leave initialization mode: the first step may follow."""

    def channel(self, kind: Type, names: Sequence[str]) -> Channel:
        """Prepare variables of one type for being set or read together."""

    def step(self, time: float, length: float, *, final: bool = True) -> None:
        """Advance from ``time`` by ``length``, both in s; not ``final`` where an older state may be restored."""

    def save(self) -> Any:
        """The present state, to be given to `restore`, `serialize` and, in the end, to `forget`."""

    def restore(self, state: Any) -> None:
        """Come back to a saved state; it stays saved."""

    def forget(self, state: Any) -> None:
        """Give a saved state back."""

    def serialize(self, state: Any) -> bytes:
        """A saved state as bytes that another process can restore."""

    def deserialize(self, content: bytes) -> Any:
        """A saved state, out of its bytes; they are not trusted to fit."""

    def directional_derivatives(
        self, unknowns: Sequence[str], knowns: Sequence[str], seed: Sequence[float]
    ) -> list[float]:
        """How the unknowns change when the knowns change by ``seed``; all are Real variables."""

    def interpolate(self, names: Sequence[str], orders: Sequence[int], values: Sequence[float]) -> None:
        """Time derivatives of inputs over the coming step: one name, order (from 1) and value each."""

    def terminate(self) -> None:
        """End the run."""

    def reset(self) -> None:
        """Come back to where it was when it was instantiated: another run may follow."""

    def free(self) -> None:
        """Give everything back; nothing may follow. Never raises."""
