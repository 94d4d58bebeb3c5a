"""The names that expressions may speak of, and which of them a reference stands for."""

import re
from collections.abc import Collection, Hashable, Iterable, Iterator, Sequence
from functools import cached_property
from typing import Any, TypeAlias

from ..names import INDEX, plainly
from ..problems import Problem, suggestion
from .syntax import Reference

Bounds: TypeAlias = tuple[float, float]
"""Of the indices of a slice, both included."""
Address: TypeAlias = Sequence[tuple[str, Sequence[int | Bounds]]]
"""The parts of a reference with the values of their indices."""
_INDICES = re.compile(rf"\[ *{INDEX}(?:, *{INDEX})* *\]")


class Names(Collection[str]):
    """Signals and parameters by full name. What is found out about them is kept.

    Args:
        names: all of them.
    """

    def __init__(self, names: Iterable[str]) -> None:
        self._names = frozenset(names)
        self._counts: dict[str, int] = {}
        self._sorted: dict[str, dict[str, list[tuple[list[str], str]]]] = {}
        self.known: dict[Hashable, Any] = {}
        """What others found out about them."""

    @classmethod
    def of(cls, names: Collection[str]) -> "Names":
        """The same, made ready unless it is."""
        return names if isinstance(names, cls) else cls(names)

    def __contains__(self, name: object) -> bool:
        return name in self._names

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)

    @cached_property
    def largest(self) -> int:
        """The greatest number in brackets; 0 where there is none."""
        return max(numbers_of(self._names), default=0)

    def count(self, array: str) -> int:
        """The greatest first index of an array of instances, or of elements; 0 where it has none."""
        if array not in self._counts:
            matches = (re.match(rf"{re.escape(array)}\[ *{INDEX}", name) for name in self._names)
            self._counts[array] = max((int(match[1]) for match in matches if match), default=0)
        return self._counts[array]

    def find(self, address: Address) -> list[str]:
        """The full names of what stands there, in the order of the indices in slices; empty where there is nothing."""
        wanted = [index for _, indices in address for index in indices]
        if not any(isinstance(index, tuple) for index in wanted):
            full = _joined((name, [str(index) for index in indices]) for name, indices in address)
            name = full if full in self._names else self._otherwise_written.get(plainly(full), "")
            return [name] if name else []
        family = _joined((name, ":" * len(indices)) for name, indices in address)
        return [
            name
            for indices, name in self._families(family.partition("[")[0]).get(family, ())
            if all(
                want[0] <= int(index) <= want[1] if isinstance(want, tuple) else index == str(want)
                for index, want in zip(indices, wanted, strict=True)
            )
        ]

    @cached_property
    def _otherwise_written(self) -> dict[str, str]:
        """Names of elements with blanks or with several pairs of brackets, by how else they may be written."""
        return {plainly(name): name for name in self._names if "[" in name and (" " in name or "][" in name)}

    def _families(self, array: str) -> dict[str, list[tuple[list[str], str]]]:
        """Names that begin with an array, in the order of their indices, by what they are without these."""
        if array in self._sorted:
            return self._sorted[array]
        families: dict[str, list[tuple[list[str], str]]] = {}
        for name in self._arrays.get(array, ()):
            groups = [re.findall(INDEX, match[0]) for match in _INDICES.finditer(name)]
            written = iter([f"[{','.join(':' * len(group))}]" for group in groups])
            family = _INDICES.sub(lambda _, rest=written: next(rest), name)  # type: ignore[misc]
            families.setdefault(family, []).append(([index for group in groups for index in group], name))
        for members in families.values():
            members.sort(key=lambda member: ([int(index) for index in member[0]], member[1]))
        self._sorted[array] = families
        return families

    @cached_property
    def _arrays(self) -> dict[str, list[str]]:
        """Names with indices, by what stands before the first of them."""
        arrays: dict[str, list[str]] = {}
        for name in self._names:
            array, bracket, _ = name.partition("[")
            if bracket:
                arrays.setdefault(array, []).append(name)
        return arrays


def _joined(parts: Iterable[tuple[str, Sequence[str]]]) -> str:
    """A full name of its parts and their indices."""
    full = ""
    for name, indices in parts:
        full += ("." if full and name else "") + name + (f"[{','.join(indices)}]" if indices else "")
    return full


def numbers_of(names: Iterable[str]) -> Iterator[int]:
    """The numbers in brackets."""
    return (int(number) for name in names for number in re.findall(rf"[\[,] *{INDEX}", name))


def unknown_signal(reference: Reference, names: Collection[str]) -> Problem:
    """What to say about a reference that stands for nothing."""
    family = re.escape(re.sub(r"\[[^\]]*\]", "[:]", reference.text)).replace(r":\]", r"[-\d, ]+\]")
    near = [name for name in names if re.fullmatch(family, name)]
    if near:
        near.sort(key=lambda name: [(len(k), k) for k in re.findall(r"-?\d+", name)])
        return Problem("", f"there is no '{reference.text}'", f"there are '{near[0]}' to '{near[-1]}'")
    written = re.findall(r"\[[^\]]*\]", reference.text)

    def as_written(name: str) -> str:
        indices = iter(written)
        return re.sub(r"\[[^\]]*\]", lambda _: next(indices, "[i]"), name)

    nearest = suggestion(reference.text, {as_written(name) for name in names}) or "'describe' lists an instance"
    return Problem("", f"there is no signal or parameter '{reference.text}'", nearest)
