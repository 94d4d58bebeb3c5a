"""How a search moves: towards what is worth less, the same way each time."""

import math

import numpy as np
import pytest
from railcosim.orchestrator.study.design import Dimension
from railcosim.orchestrator.study.search.methods import METHODS
from railcosim.orchestrator.study.search.space import Space

LINE = Space((Dimension.parse("it.x=0:1"),), (), {})
PLANE = Space((Dimension.parse("it.x=0:1"), Dimension.parse("it.y=0:1")), (), {})
MIXED = Space((Dimension.parse("it.x=0:1"), Dimension.parse("it=A,B,C")), (), {})


def least(name, space, worth, groups, *, seed=1, score=math.nan):
    """The least that a method finds, and all points that it has asked for."""
    method = METHODS[name](space, seed, np.full(space.size, 0.5), score)
    points, best = [], math.inf
    for _ in range(groups):
        asked = method.ask()
        scores = [worth(point) for point in asked]
        method.tell(scores)
        points += asked
        best = np.nanmin([best, *scores])
    return best, np.array(points)


@pytest.mark.parametrize("name", METHODS)
@pytest.mark.parametrize("space", [LINE, PLANE, MIXED])
def test_a_method_asks_for_points_of_the_cube_the_same_each_time(name, space):
    _, once = least(name, space, lambda point: float(point.sum()), 6)
    _, again = least(name, space, lambda point: float(point.sum()), 6)
    _, other = least(name, space, lambda point: float(point.sum()), 6, seed=2)
    assert once.shape[1] == space.size
    assert ((once >= 0.0) & (once <= 1.0)).all()
    assert np.array_equal(once, again)
    assert not np.array_equal(once[: len(other)], other[: len(once)])


@pytest.mark.parametrize(("name", "groups"), [("cma-es", 20), ("tpe", 20)])
def test_a_method_comes_nearer_than_chance(name, groups):
    """The worth is the distance to a corner region: 120 points by chance come within 0.03 of it, on average 0.046."""

    def worth(point):
        return float(np.hypot(*(point - 0.8)))

    best, points = least(name, PLANE, worth, groups, score=worth(np.full(2, 0.5)))
    assert len(points) <= 160
    assert best < 0.02


@pytest.mark.parametrize("name", METHODS)
def test_runs_that_failed_do_not_stop_a_method(name):
    best, _ = least(name, PLANE, lambda point: math.nan if point[0] < 0.5 else float(point[1]), 8)
    assert best < 0.5
    least(name, PLANE, lambda _: math.nan, 2)


def test_cma_es_starts_anew_where_it_is_stuck():
    """On a plateau it gives up, and begins elsewhere with twice the population."""
    _, points = least("cma-es", PLANE, lambda _: 1.0, 40)
    assert 40 * 6 < len(points) < 40 * 64


def descent(worth, slope, first, groups, *, space=PLANE):
    """The points that a descent asks for."""
    method = METHODS["gradient"](space, 3, np.array(first), worth(np.array(first)), slope)
    points = []
    for _ in range(groups):
        points += method.ask()
        method.tell([worth(points[-1])])
    return np.array(points)


def test_a_descent_goes_down_along_the_sides_of_the_cube():
    """Least at x = 0 and y = 0.9: x stops at its side, and y goes on."""
    points = descent(
        lambda p: 3.0 * p[0] + (p[1] - 0.9) ** 2, lambda p: np.array([3.0, 2.0 * (p[1] - 0.9)]), [0.5, 0.1], 8
    )
    assert points[:2].tolist() == pytest.approx(np.array([[0.2, 0.4], [0.0, 1.0]]))
    assert np.abs(points - [0.0, 0.9]).max(axis=1).min() < 0.06


def test_a_descent_begins_anew_where_it_is_stuck_or_runs_fail():
    """A slope that misleads: steps are quartered until they are small, then a start is drawn."""
    points = descent(lambda p: float(p[0]), lambda p: np.array([-1.0, 0.0]), [0.5, 0.5], 4)
    assert np.abs(points[:3, 0] - 0.5) == pytest.approx([0.3, 0.075, 0.01875])
    assert points[3, 1] != 0.5
    failing = descent(lambda _: math.nan, lambda p: np.ones(2), [0.5, 0.5], 3)
    assert len(np.unique(failing[:, 0])) == 3
    cornered = descent(lambda p: float(p.sum()), lambda p: np.array([1.0, -1.0]), [0.0, 1.0], 1)
    assert ((cornered > 0.0) & (cornered < 1.0)).all()
