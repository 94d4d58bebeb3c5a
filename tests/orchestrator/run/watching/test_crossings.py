"""Rules that are broken are seen at every point of a block, however few, and across blocks."""

import numpy as np
import pytest
from railcosim.orchestrator.names import SignalName
from railcosim.orchestrator.run.watching.crossings import Crossings
from railcosim.orchestrator.run.watching.rules import Rule
from railcosim.orchestrator.wiring import Quantity

A, B, C = (SignalName("train", name) for name in "abc")
PLACES = {"train.a": 0, "train.b": 1, "train.c": 2}


def watch(*quantities):
    return Crossings([Rule(quantity, lambda seen: seen) for quantity in quantities], PLACES)


def see(crossings, values, begin=0.0):
    values = np.asarray(values, dtype=float)
    crossings.see(begin + np.arange(len(values)), values)
    return list(crossings.findings())


def table(count, **of):
    values = np.ones((count, 3))
    for name, column in of.items():
        values[:, "abc".index(name)] = column
    return values


@pytest.mark.parametrize("count", [1, 2, 3, 7, 100, 1001])
def test_the_very_last_point_counts(count):
    """Of blocks of every length, as they are folded."""
    for point in {0, count // 2, count - 1}:
        values = table(count)
        values[point, 0] = -2.0
        (seen,) = see(watch(Quantity(((A, 1.0),))), values)
        assert seen == (point, point, -2.0, point)


def test_a_difference_of_two_that_are_never_alike_at_one_time():
    """Extremes alone would say that they meet: 0..99 and 50..149."""
    values = table(100, a=np.arange(100.0) + 50.0, b=np.arange(100.0))
    assert see(watch(Quantity(((A, 1.0), (B, -1.0)))), values) == []
    values[60, 0] = 50.0
    assert see(watch(Quantity(((A, 1.0), (B, -1.0)))), values) == [(60.0, 60.0, -10.0, 60.0)]


def test_weights_and_offset():
    """(a + b + c) / 3 - 2."""
    third = Quantity(tuple((signal, 1.0 / 3.0) for signal in (A, B, C)), -2.0)
    (seen,) = see(watch(third), table(5, a=[9.0, 9.0, 3.0, 1.0, 9.0]))
    assert seen == (2.0, 3.0, pytest.approx(-1.0), 3.0)


def test_nought_is_broken_and_what_is_no_number_is_not():
    crossings = watch(Quantity(((A, 1.0),)), Quantity(((B, 1.0),)))
    assert see(crossings, table(4, a=np.nan, b=[1.0, np.nan, 0.0, 1.0])) == [(2.0, 2.0, 0.0, 2.0)]


def test_blocks_are_one_run():
    """First from the first, last from the last, the worst from where it was."""
    crossings = watch(Quantity(((A, 1.0),)))
    see(crossings, table(4, a=[1.0, -1.0, 1.0, 1.0]))
    see(crossings, table(4, a=[1.0, -5.0, 1.0, 1.0]), begin=4.0)
    assert see(crossings, table(4, a=[-2.0, 1.0, 1.0, 1.0]), begin=8.0) == [(1.0, 8.0, -5.0, 5.0)]
    assert see(crossings, np.empty((0, 3))) == [(1.0, 8.0, -5.0, 5.0)]


def test_what_was_seen_is_kept():
    first, second = (watch(Quantity(((A, 1.0),)), Quantity(((B, 1.0),))) for _ in range(2))
    see(first, table(3, b=[1.0, -3.0, 1.0]))
    second.restore(first.save())
    assert see(second, table(2, b=[-1.0, 1.0]), begin=3.0) == [(1.0, 3.0, -3.0, 1.0)]


def test_without_rules_nothing_is_looked_at():
    assert see(watch(), table(4)) == []
