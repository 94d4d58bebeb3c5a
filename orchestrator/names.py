"""`SignalName`: the name of one signal, taken apart in one place."""

from __future__ import annotations

import re
from typing import NamedTuple

_NUMBERED = re.compile(r"(.*)\[(\d{1,9})\]", re.DOTALL)
_INDICES = re.compile(r"\[(\d{1,9}(?:,\s*\d{1,9})*)\]")
_ELEMENT = re.compile(r"(.*)\[(\d{1,9}(?:,\s*\d{1,9})*)\]", re.DOTALL)


class SignalName(NamedTuple):
    """A scalar variable, or a whole array, of one instance: ``train[2].force[3]``.

    The instance ends at the first dot. What follows is the FMU's own name for it and may hold anything: dots, blanks,
    several indices.

    Attributes:
        instance: ``"train[2]"``. variable: ``"force[3]"``; empty where only an instance is named.
    """

    instance: str
    variable: str = ""

    @classmethod
    def parse(cls, text: str) -> SignalName:
        """The name a text stands for."""
        instance, _, variable = text.partition(".")
        return cls(instance, variable)

    def __str__(self) -> str:
        return f"{self.instance}.{self.variable}" if self.variable else self.instance

    @property
    def group(self) -> str:
        """``"train"``: what the instances of one count have in common."""
        match = _NUMBERED.fullmatch(self.instance)
        return match[1] if match else self.instance

    @property
    def number(self) -> int | None:
        """``2``: which of its group the instance is; None where it has no number."""
        match = _NUMBERED.fullmatch(self.instance)
        return int(match[2]) if match else None

    @property
    def array(self) -> str:
        """``"force"``: the variable without the indices at its end."""
        match = _ELEMENT.fullmatch(self.variable)
        return match[1] if match else self.variable

    @property
    def element(self) -> tuple[int, ...]:
        """``(3,)``: the indices at the variable's end; empty where there are none."""
        match = _ELEMENT.fullmatch(self.variable)
        return tuple(map(int, match[2].split(","))) if match else ()

    @property
    def indices(self) -> tuple[int, ...]:
        """``(2, 3)``: all indices in the name, wherever they stand, the instance's first."""
        groups = _INDICES.findall(f"{self.instance}.{self.variable}")
        return tuple(int(number) for group in groups for number in group.split(","))

    @property
    def family(self) -> SignalName:
        """``train[i].force[i]``: what it shares with the same signal of its siblings."""
        instance = self.instance if self.number is None else f"{self.group}[i]"
        return SignalName(instance, f"{self.array}[i]" if self.element else self.variable)

    def covers(self, other: SignalName) -> bool:
        """Whether it stands for all that the other stands for: a group for its members, an array for its elements."""
        return self.instance in (other.instance, other.group) and (
            other.variable == self.variable or other.variable.startswith(f"{self.variable}[")
        )
