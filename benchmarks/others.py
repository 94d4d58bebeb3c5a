"""What the tables of other people's tools share: their tests, how signals are compared, the page between its marks."""

import functools
import importlib
import importlib.metadata
import sys
from collections.abc import Mapping, Set
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

TESTS = Path(__file__).parents[1] / "tests" / "interop"
SAME = 1e-9
"""Largest deviation of a signal that fits, relative to its largest value where that is above one unit."""


@functools.cache
def shared(name: str) -> Any:
    """A file of the tests with other tools."""
    sys.path.insert(0, str(TESTS))
    return importlib.import_module(name)


@dataclass(frozen=True)
class Fit:
    """How a tool's signals fit ours: how many do as they stand, one point early, and not; the largest deviation.

    ``mixed`` are those that fit neither and depend on states and inputs directly: read after the inputs were set, they
    are of the states of this point and the inputs of the next, a row that none of ours is.
    """

    plain: int
    early: int
    mixed: int
    off: Mapping[str, float]
    largest: float

    def __str__(self) -> str:
        parts = [f"{self.largest:.0e}", f"{self.plain + self.early} signals"]
        parts += [f"{self.early} of them early"] if self.early else []
        parts += [f"{self.mixed} more mixed"] if self.mixed else []
        if self.off:
            worst = max(self.off, key=self.off.__getitem__)
            parts += [f"**{len(self.off)} more depart**, `{worst}` most: {self.off[worst]:.0e}"]
        return ", ".join(parts)


def fit(ours: Mapping[str, Any], found: Mapping[str, Any], direct: Set[str] = frozenset()) -> Fit:
    """Compare a tool's signals with ours.

    Args:
        ours: signals by name, shape (points,).
        found: those of the tool, by the same names.
        direct: the signals that depend directly on an input and on a state that moves on with the point.
    """
    plain, early, mixed, largest = 0, 0, 0, 0.0
    off = {}
    for name, values in found.items():
        own, got = (np.asarray(each, dtype=float) for each in (ours[name], values))
        if own.shape != got.shape:
            raise ValueError(f"{name}: {len(got)} points, not {len(own)}")
        stands, ahead = _deviation(own, got), _deviation(own[1:], got[:-1])
        if not min(stands, ahead) <= SAME:
            mixed += name in direct
            if name not in direct:
                off[name] = stands
        elif stands <= SAME:
            plain, largest = plain + 1, max(largest, stands)
        else:
            early, largest = early + 1, max(largest, ahead)
    return Fit(plain, early, mixed, off, largest)


def _deviation(own: Any, got: Any) -> float:
    """The largest, relative to the largest value above one unit; infinite where either holds no finite number."""
    if not (np.isfinite(own).all() and np.isfinite(got).all()):
        return np.inf
    return float(np.max(np.abs(got - own))) / max(1.0, float(np.max(np.abs(own))))


def version(package: str) -> str:
    """Of an installed distribution."""
    return importlib.metadata.version(package.replace("_", "-"))


def written(page: str, tables: str, marks: tuple[str, str]) -> str:
    """The page with the tables between its marks.

    Raises:
        ValueError: it has none.
    """
    before, begin, rest = page.partition(marks[0])
    _, end, after = rest.partition(marks[1])
    if not (begin and end):
        raise ValueError(f"the page has no {marks[0]} or no {marks[1]}")
    return f"{before}{begin}\n\n{tables}\n\n{end}{after}"


def put(page: Path | None, tables: str, marks: tuple[str, str]) -> None:
    """Write the tables into a page, or print them."""
    if page is None:
        print(tables)
    else:
        page.write_text(written(page.read_text(encoding="utf-8"), tables, marks), encoding="utf-8")
