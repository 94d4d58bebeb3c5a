"""`SignalName`: the name of one signal, taken apart in one place."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterable, Iterator
from fnmatch import fnmatchcase
from typing import NamedTuple

INDEX = r"(-?\d{1,9})(?!\d)"
"""The number in an index as a pattern; Python does not convert numbers of thousands of digits."""
_NUMBERED = re.compile(r"(.*)\[(\d{1,9})\]", re.DOTALL)
_INDICES = re.compile(r"\[( *-?\d{1,9} *(?:, *-?\d{1,9} *)*)\]")
_NAME_OR_INDICES = re.compile(rf"'(?:[^'\\]|\\.)*'|{_INDICES.pattern}", re.DOTALL)

_PARTS = re.compile(r"(?:'(?:[^'\\]|\\.)*'|\[[^\]]*\]|[^,])+")
_SPAN = re.compile(r"(-?\d{1,9})?:(-?\d{1,9})?")
_BRACKETS = re.compile(r"\[[^\[\]]*\]")


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
        groups = _at_end(self.variable)
        return self.variable[: groups[0].start()] if groups else self.variable

    @property
    def element(self) -> tuple[int, ...]:
        """``(3,)``: the indices at the variable's end; empty where there are none."""
        return _numbers(_at_end(self.variable))

    @property
    def indices(self) -> tuple[int, ...]:
        """``(2, 3)``: all indices in the name, wherever they stand, the instance's first."""
        return _numbers(_INDICES.finditer(f"{self.instance}.{self.variable}"))

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


class Slice(NamedTuple):
    """Elements chosen by ranges of indices, both ends included: ``a[2:4]``, ``m[1,:]``, ``cell[2:].t``.

    Attributes:
        pattern: of the elements' names as `plainly` writes them, a group for each range.
        ends: the first and the last index of each range; None where it is open.
    """

    pattern: re.Pattern[str]
    ends: tuple[tuple[int | None, int | None], ...]

    @classmethod
    def parse(cls, variable: str) -> Slice | None:
        """The slice that a variable's name stands for; None where it has no range."""
        ends: list[tuple[int | None, int | None]] = []

        def read(item: str) -> str:
            match = _SPAN.fullmatch(item)
            if match is None:
                return re.escape(item)
            ends.append((int(match[1]) if match[1] else None, int(match[2]) if match[2] else None))
            return INDEX

        text, pattern, done = plainly(variable), "", 0
        for group in _BRACKETS.finditer(text):
            items = ",".join(map(read, group[0][1:-1].split(",")))
            pattern += f"{re.escape(text[done : group.start()])}\\[{items}\\]"
            done = group.end()
        return cls(re.compile(pattern + re.escape(text[done:])), tuple(ends)) if ends else None

    def among(self, names: Iterable[str]) -> list[tuple[tuple[int, ...], str]]:
        """Those of some names that it chooses, with their indices in the ranges and in their order.

        None are chosen where one of the ends is not among them: a range says which elements there are.
        """
        matches = ((match, name) for name in names if (match := self.pattern.fullmatch(name)))
        found = sorted((tuple(map(int, match.groups())), name) for match, name in matches)
        chosen = [(place, name) for place, name in found if self._covers(place)]
        there = [{place[k] for place, _ in chosen} for k in range(len(self.ends))]
        missing = (
            end not in own for ends, own in zip(self.ends, there, strict=True) for end in ends if end is not None
        )
        return [] if any(missing) else chosen

    def _covers(self, place: tuple[int, ...]) -> bool:
        return all(
            (low is None or low <= index) and (high is None or index <= high)
            for index, (low, high) in zip(place, self.ends, strict=True)
        )


def shape_of(elements: Iterable[str]) -> tuple[int, ...]:
    """How many elements stand side by side in each direction; a direction that has one does not count.

    Elements that fill no rectangle, and what has no indices, are one row.
    """
    indices = [SignalName("", element).indices for element in elements]
    if len({len(place) for place in indices}) != 1:
        return (len(indices),)
    sizes = (len(set(direction)) for direction in zip(*indices, strict=True))
    shape = tuple(size for size in sizes if size > 1)
    return shape if math.prod(shape) == len(indices) else (len(indices),)


def arrays_of(variable: str) -> Iterator[tuple[str, tuple[int, ...]]]:
    """The arrays that a variable belongs to, by its name without the last of its indices, and its place in them.

    ``n[1][2]`` belongs to ``n`` at (1, 2) and to ``n[1]`` at (2,); ``cell[3].t`` to ``cell.t`` at (3,). What stands in
    a quoted name of Modelica (``'a[1]'``) is no index.
    """
    if "[" not in variable:
        return
    groups = [match for match in _NAME_OR_INDICES.finditer(variable) if match[1] is not None]
    for k, first in enumerate(groups):
        ends = [*(group.start() for group in groups[k + 1 :]), len(variable)]
        rest = (variable[group.end() : end] for group, end in zip(groups[k:], ends, strict=True))
        yield variable[: first.start()] + "".join(rest), _numbers(groups[k:])


def parted(texts: Iterable[str]) -> Iterator[str]:
    """Names that commas part in texts; a comma in an index or in a quoted name is part of the name."""
    return (part.strip() for text in texts for part in _PARTS.findall(text) if part.strip())


def plainly(variable: str) -> str:
    """A name without blanks around it and in its indices, and with those of one array in one pair of brackets."""
    return re.sub(r"\[[^\[\]]*\]", lambda match: match[0].replace(" ", ""), variable.strip()).replace("][", ",")


def _at_end(variable: str) -> list[re.Match[str]]:
    """The groups of indices that a name ends with."""
    groups: list[re.Match[str]] = []
    if variable.endswith("]"):
        for match in reversed(list(_INDICES.finditer(variable))):
            if match.end() != (groups[0].start() if groups else len(variable)):
                break
            groups.insert(0, match)
    return groups


def _numbers(groups: Iterable[re.Match[str]]) -> tuple[int, ...]:
    return tuple(int(number) for group in groups for number in group[1].split(","))


def matching(names: Iterable[str], patterns: Collection[str]) -> list[str]:
    """The names that any of some patterns fits: ``*`` and ``?`` stand for letters, and brackets for themselves.

    Args:
        names: of signals, in whose order they are given back.
        patterns: such as ``train*.speed``.
    """
    plain = [pattern.replace("[", "[[]") for pattern in patterns]
    return [name for name in names if any(fnmatchcase(name, pattern) for pattern in plain)]
