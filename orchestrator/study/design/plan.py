"""`Plan`: what is to be run, and nothing of how."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .dimensions import Dimension
from .laws import Law
from .sampling import noise_seeds, random_numbers, table

SEED = "simulation.seed"
_BLOCK = 4096
"""Runs whose values are computed at once, always the same ones: so no value depends on who asks for how many."""


@dataclass(frozen=True)
class Plan:
    """The runs of a study: which keys are varied, by which design, how many runs there are, and the study's seed.

    A run's values depend on these alone, not on how many are asked for at a time, in which order, or by whom. In every
    design but the grid a run has its own seed of noise as well, unless the seed is itself varied.

    Attributes:
        dimensions: what is varied. design: one of `DESIGNS`. count: of runs. seed: the study's.
    """

    dimensions: tuple[Dimension, ...]
    design: str
    count: int
    seed: int = 0

    @property
    def names(self) -> list[str]:
        """The keys of the dimensions."""
        return [dimension.name for dimension in self.dimensions]

    @property
    def draws_seeds(self) -> bool:
        """Whether each run has its own seed of noise."""
        return self.design != "grid" and SEED not in self.names

    def changes(self, number: int) -> dict[str, Any]:
        """What one run changes, by key.

        Args:
            number: of the run, from 0.

        Raises:
            IndexError: there is no such run.
        """
        return self.block(number, number + 1)[0]

    def block(self, first: int, last: int) -> list[dict[str, Any]]:
        """What the runs from `first` to before `last` change.

        Raises:
            IndexError: there are no such runs.
        """
        if not 0 <= first <= last <= self.count:
            raise IndexError(f"runs {first} to {last - 1} of a plan of {self.count}")
        names = [*self.names, SEED] if self.draws_seeds else self.names
        found: list[dict[str, Any]] = []
        for k in range(first // _BLOCK, -(-last // _BLOCK)):
            rows = self._rows(k)[max(first - k * _BLOCK, 0) : last - k * _BLOCK]
            found += [dict(zip(names, row, strict=True)) for row in rows]
        return found

    def _rows(self, k: int) -> list[tuple[Any, ...]]:
        """The runs of one block, of which the last is held: runs are asked for one after the other."""
        if k not in self._held:
            self._held.clear()
            self._held[k] = self._drawn(k * _BLOCK, min((k + 1) * _BLOCK, self.count))
        return self._held[k]

    def _drawn(self, first: int, last: int) -> list[tuple[Any, ...]]:
        columns = self._grid(first, last) if self.design == "grid" else self._sampled(first, last)
        if self.draws_seeds:
            columns = [*columns, self._seeds(first, last)]
        return list(zip(*columns, strict=True))

    def _grid(self, first: int, last: int) -> list[list[Any]]:
        """Every value with every other; the last dimension changes from run to run."""
        numbers = range(first, last)
        columns, below = [], self.count
        for dimension in self.dimensions:
            size = len(dimension.values)
            below //= size
            columns.append([dimension.values[number // below % size] for number in numbers])
        return columns

    def _sampled(self, first: int, last: int) -> list[list[Any]]:
        if self.design == "random":
            shares = random_numbers(self.seed, first, last, len(self.dimensions))
        else:
            shares = self._table[first:last]
        return [one.at(np.ascontiguousarray(shares[:, k])) for k, one in enumerate(self.dimensions)]

    def _seeds(self, first: int, last: int) -> list[int]:
        if self.design != "saltelli":
            return noise_seeds(self.seed, first, last)
        # Noise is one more input that nobody looks at: what differs from A in one column has A's, and B its own.
        rows = len(self.dimensions) + 2
        block = first // rows
        own = noise_seeds(self.seed, 2 * block, 2 * (last // rows + 1))
        return [own[2 * (number // rows - block) + (number % rows == rows - 1)] for number in range(first, last)]

    @cached_property
    def _table(self) -> NDArray[np.float64]:
        return table(self.design, self.seed, self.count, len(self.dimensions))

    @cached_property
    def _held(self) -> dict[int, list[tuple[Any, ...]]]:
        return {}

    def to_json(self) -> str:
        """As a text from which `from_json` makes the same plan, to the bit."""
        dimensions = [
            {"name": one.name, "law": str(one.law)} if one.law else {"name": one.name, "values": list(one.values)}
            for one in self.dimensions
        ]
        return json.dumps({"design": self.design, "count": self.count, "seed": self.seed, "dimensions": dimensions})

    @classmethod
    def from_json(cls, text: str) -> Plan:
        """The plan of a text that `to_json` wrote."""
        data = json.loads(text)
        dimensions = tuple(
            Dimension(one["name"], tuple(one.get("values", ())), Law.read(one["law"]) if "law" in one else None)
            for one in data["dimensions"]
        )
        return cls(dimensions, data["design"], data["count"], data["seed"])


def grid_size(dimensions: tuple[Dimension, ...]) -> int:
    """How many runs a grid has."""
    return math.prod(len(dimension.values) for dimension in dimensions)
