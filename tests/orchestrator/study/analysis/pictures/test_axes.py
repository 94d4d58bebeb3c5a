"""Parameters as axes."""

import numpy as np
import pytest
from railcosim.orchestrator.study.analysis.pictures.axes import Axis, fences, folded


def axis(studied, what, count=20, design="random"):
    frame, plan = studied({"a.x": what}, {}, count, design)
    return Axis(frame, plan.dimensions[0])


def test_cells_lie_around_the_points(studied):
    assert axis(studied, "1:3:3").edges().tolist() == [0.5, 1.5, 2.5, 3.5]
    assert axis(studied, [1, 10, 4]).edges().tolist() == [-0.5, 2.5, 7.0, 13.0]
    assert axis(studied, [7]).edges().tolist() == [6.5, 7.5]
    assert axis(studied, ["P", "Q"]).edges().tolist() == [-0.5, 0.5, 1.5]


def test_words_are_drawn_a_little_apart(studied):
    words = axis(studied, ["P", "Q"], 50)
    moved = words.spread(np.random.default_rng(1)) - words.values
    assert 0 < np.abs(moved).max() < 0.3
    numbers = axis(studied, "0:1")
    assert np.array_equal(numbers.spread(np.random.default_rng(1)), numbers.values)


@pytest.mark.parametrize("side", ["x", "y"])
def test_ticks(studied, axes, side):
    ax = axes()
    axis(studied, ["ComfortCruise", "TunablePotentialCruise"]).put_on(ax, side)
    ticks = getattr(ax, f"{side}axis")
    assert [text.get_text() for text in ticks.get_ticklabels()] == ["ComfortCruise", "TunablePotential\nCruise"]
    assert getattr(ax, f"get_{side}label")() == "a.x"
    ax = axes()
    axis(studied, "loguniform(1e-3, 1)").put_on(ax, side, label=False)
    assert getattr(ax, f"get_{side}scale")() == "log"
    assert getattr(ax, f"{side}axis").get_major_formatter()(0.005, 0) == "0.005"
    assert getattr(ax, f"get_{side}label")() == ""


def test_many_words_are_not_all_written(studied, axes):
    ax = axes()
    axis(studied, [f"w{k}" for k in range(50)]).put_on(ax, "x", small=True)
    texts = ax.get_xticklabels()
    assert [text.get_text() for text in texts[:2]] == ["w0", "w3"]
    assert texts[0].get_rotation() == 90


@pytest.mark.parametrize(
    ("text", "letters", "lines"),
    [
        ("cruise.alpha", 18, "cruise.alpha"),
        ("cruise.a_long_name_of_something", 14, "cruise.a_long_\nname_of_\nsomething"),
        ("TunablePotentialCruise", 16, "TunablePotential\nCruise"),
        ("abcdefghijklmnop", 5, "abcde\nfghij\nklmn…"),
        ("my file.py:MyClass", 12, "my file.\npy:MyClass"),
        ("", 5, ""),
    ],
)
def test_names_are_folded_where_they_part(text, letters, lines):
    assert folded(text, letters) == lines


def test_outliers_lie_beyond_the_fences():
    assert fences(np.arange(101.0)) == (0, 100)
    assert fences(np.append(np.arange(101.0), 1e9)) == pytest.approx((0, 95.95 + 1.5 * 90.9))
    assert fences(np.array([3.0])) == (3, 3)
