"""Texts among the values of the compiled loop, which are numbers: each text has one."""

from __future__ import annotations

from typing import Any

try:
    from .. import kernel
except ImportError:  # nobody asks for texts then
    kernel = None  # type: ignore[assignment]

_MANY = 50_000
"""Texts that are kept although no value is one of them any more."""


class Texts:
    """The texts of a run by number, as ``native/types/texts.c`` has them.

    Attributes:
        table: what the kernel takes.
    """

    def __init__(self) -> None:
        self.table: Any = kernel.texts()

    def number(self, text: str) -> float:
        """The number of a text, of which C sees what comes before a NUL."""
        return float(kernel.number(self.table, text.encode().partition(b"\0")[0]))

    def text(self, number: float) -> str:
        """The text of a number."""
        return kernel.text(self.table, number).decode()

    @property
    def are_many(self) -> bool:
        """Whether it is time to `begin_anew`."""
        return kernel.count(self.table) > _MANY

    def begin_anew(self) -> None:
        """Forget all of them: values that are texts have to be packed once more."""
        self.table = kernel.texts()
