"""`Problem`: one thing that is wrong with what a user wrote, and where it stands."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace

from ..components.errors import did_you_mean
from .names import SignalName


@dataclass(frozen=True)
class Problem:
    """One mistake. As text: ``"place: message; remedy"``.

    Attributes:
        place: where it was written and what it is called there, the outermost first (``"file.toml:12: train.mass"``,
            ``"[[figures]] entry 2 (Speeds), panel 1"``, ``"--set x=1"``); empty where the message says it all.
        message: what is wrong.
        remedy: what to do, or the nearest right name; may be empty.
        names: the signals and instances that it is about, so that the same mistake of siblings can be told once.
    """

    place: str
    message: str
    remedy: str = ""
    names: tuple[SignalName, ...] = field(default=(), compare=False)

    def __str__(self) -> str:
        head = f"{self.place}: " if self.place else ""
        return f"{head}{self.message}; {self.remedy}" if self.remedy else f"{head}{self.message}"

    def at(self, place: str, *names: SignalName) -> Problem:
        """The same problem, seen from further out; an empty place adds nothing.

        Args:
            place: what is around `self.place`.
            names: what it is about as well.
        """
        outer = f"{place}: {self.place}" if place and self.place else place or self.place
        return replace(self, place=outer, names=self.names + names)

    @property
    def kind(self) -> str:
        """Its text without the numbers of what it is about: the same for the same mistake of siblings."""
        text = str(self)
        for name in self.names:
            text = text.replace(str(name), str(name.family))
            text = text.replace(name.instance, name.family.instance)
        return text


def suggestion(word: str, valid: Iterable[str]) -> str:
    """A remedy that names the nearest valid word: `"did you mean 'x'?"`; empty where none is near."""
    return did_you_mean(word, valid).removeprefix("; ")
