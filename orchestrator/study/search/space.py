"""`Space`: all that is varied as one cube of numbers from 0 to 1, which every method of search can move in."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import ScenarioError
from ...names import SignalName
from ...problems import Problem
from ...run import Checked, Results
from ...system import System
from ..design import Dimension
from .signals import Placed, Signal, place_signals

Array = NDArray[np.float64]
Changes = Mapping[str, Any]

_LEAST = 1e-9
_RARE = 1e-3
"""Which part of a distribution without an end is left out at that end."""


@dataclass(frozen=True)
class Space:
    """What is varied: dimensions, then signals, each a stretch of the cube.

    Attributes:
        dimensions: single values. signals: values over time.
        nominal: what the scenario has of each key that is a number there and the same for all it means.
    """

    dimensions: tuple[Dimension, ...]
    signals: tuple[Placed, ...]
    nominal: Mapping[str, float]

    @property
    def keys(self) -> list[str]:
        """What changes are called, in the order of the cube's axes."""
        return [*(one.name for one in self.dimensions), *(key for one in self.signals for key in one.keys)]

    @property
    def size(self) -> int:
        """How many axes the cube has."""
        return len(self.keys)

    @property
    def choices(self) -> list[int]:
        """Of each axis among how many things without an order it chooses; 0 where it is a number."""
        listed = [0 if one.law is not None or one.is_numeric else len(one.values) for one in self.dimensions]
        return listed + [0] * (self.size - len(listed))

    def changes(self, point: Array) -> dict[str, Any]:
        """The changes that a point of the cube, (size,), stands for."""
        found: dict[str, Any] = {}
        for one, share in zip(self.dimensions, point, strict=False):
            low, high = _ends(one)
            found[one.name] = one.at(np.array([min(max(float(share), low), high)]))[0]
        first = len(self.dimensions)
        for signal in self.signals:
            values = signal.values(point[first : first + signal.signal.size])
            found |= dict(zip(signal.keys, values, strict=True))
            first += signal.signal.size
        return found

    def origin(self) -> Array:
        """The point of the cube that is nearest to the scenario as it stands."""
        found = [_share(one, self.nominal.get(one.name)) for one in self.dimensions]
        for signal in self.signals:
            width = signal.signal.high - signal.signal.low
            found += np.clip((signal.nominal - signal.signal.low) / width, 0.0, 1.0).tolist()
        return np.array(found)

    def allows(self, changes: Changes) -> bool:
        """Whether the signals keep their rate limits; a value that is not changed is the nominal one."""
        return all(
            signal.keeps_rate([changes.get(key, value) for key, value in zip(signal.keys, signal.nominal, strict=True)])
            for signal in self.signals
        )


def _ends(dimension: Dimension) -> tuple[float, float]:
    """Between which shares of a dimension its values are finite."""
    if dimension.law is None:
        return 0.0, 1.0
    if dimension.law.name == "integers":  # of whole numbers the quantile of 0 is one below the first
        return _LEAST, 1.0
    first, last = dimension.at(np.array([0.0, 1.0]))
    return (0.0 if np.isfinite(first) else _RARE), (1.0 if np.isfinite(last) else 1.0 - _RARE)


def _share(dimension: Dimension, nominal: float | None) -> float:
    """Where the nominal value of a dimension lies in it; in the middle where it has none."""
    if nominal is None:
        return 0.5
    shares = np.linspace(*_ends(dimension), 1001)
    return float(shares[np.argmin(np.abs(np.array(dimension.at(shares), dtype=np.float64) - nominal))])


def read_space(texts: Sequence[str]) -> tuple[list[Dimension], list[Signal]]:
    """What `--vary` says, in the order it is written.

    Raises:
        ScenarioError: with everything that cannot be read, and what is varied twice.
    """
    dimensions: list[Dimension] = []
    signals: list[Signal] = []
    problems: list[Problem] = []
    for text in texts:
        try:
            signal = Signal.parse(text)
            if signal is not None:
                signals.append(signal)
            else:
                dimensions.append(Dimension.parse(text))
        except ScenarioError as error:
            problems += error.problems
    names = [*(one.name for one in dimensions), *(one.name for one in signals)]
    twice = [name for k, name in enumerate(names) if name in names[:k]]
    problems += [Problem(f"--vary {name}", "it is varied twice", "keep one") for name in dict.fromkeys(twice)]
    if not texts:
        problems.append(Problem("", "nothing is varied", "say what is, as in --vary cruise.alpha=0.005:0.05"))
    if problems:
        raise ScenarioError(problems)
    return dimensions, signals


def make_space(
    system: System, checked: Checked, results: Results, dimensions: Sequence[Dimension], signals: Sequence[Signal]
) -> tuple[System, Space]:
    """The system with its signals in place, and the space of what is varied of it.

    Args:
        system: the scenario.
        checked: the same, checked.
        results: of its nominal run.
        dimensions: single values that are varied.
        signals: values over time that are.

    Raises:
        ScenarioError: a signal cannot be placed.
    """
    placed_system, placed = place_signals(system, checked, results, signals)
    nominal: dict[str, float] = {}
    for one in dimensions:
        value = _nominal(one.name, system, checked, results)
        if value is not None and (one.law is not None or one.is_numeric):
            nominal[one.name] = value
    for signal in placed:
        nominal |= dict(zip(signal.keys, map(float, signal.nominal), strict=True))
    return placed_system, Space(tuple(dimensions), tuple(placed), nominal)


def _nominal(key: str, system: System, checked: Checked, results: Results) -> float | None:
    """What the scenario has of a key: one number, or None. A start value may stand in a parameter of its own."""
    instance, _, word = key.partition(".")
    if instance == "simulation":
        found = [getattr(system, word, None) if word == "seed" else getattr(system.stepping, word, None)]
    elif instance.startswith("events["):
        number = SignalName(instance).number or 0
        found = [getattr(event, word, None) for event in system.events[number - 1 : number]]
    else:
        words = {word, *(model.interface.start_name(word) for model in checked.models.values())}
        wanted = [SignalName(instance, each) for each in words]
        parameters = ((SignalName.parse(name), value) for name, value in results.parameters.items())
        found = [value for name, value in parameters if any(each.covers(name) for each in wanted)]
    plain = [value for value in found if isinstance(value, int | float) and not isinstance(value, bool)]
    return float(plain[0]) if len(set(plain)) == 1 and len(plain) == len(found) else None
