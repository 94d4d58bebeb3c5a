"""The look of a page: colours, legends, and matplotlib only where it is needed."""

import itertools
import subprocess
import sys
from pathlib import Path

import pytest
from matplotlib.figure import Figure
from railcosim.orchestrator.figures.style import _folded, page, wrapped


def test_many_curves_are_coloured_by_order(drawn):
    (ax,) = drawn(y=["car[:].speed"])
    assert len({str(line.get_color()) for line in ax.lines}) == 12


def test_the_legend_stands_beside_the_data(drawn):
    (ax,) = drawn(y=["train[:].speed"])
    assert ax.get_legend().get_window_extent().x0 >= ax.get_window_extent().x1


def extent(ax):
    return ax.get_legend().get_window_extent()


@pytest.mark.parametrize("panels", [1, 3, 5])
def test_a_legend_keeps_to_the_height_of_its_panel_and_to_the_page(drawn, panels):
    """Twelve cars in panels of their own names, each with a legend."""
    axes = drawn(panels=[{"y": ["car[:].speed"], "label": [f"car of panel {k}"]} for k in range(panels)])
    boxes = [extent(ax) for ax in axes]
    assert all(upper.y0 > lower.y1 for upper, lower in itertools.pairwise(boxes))
    width, height = axes[0].figure.bbox.size
    assert all(box.x0 >= 0 and box.y0 >= 0 and box.x1 <= width and box.y1 <= height for box in boxes)


def test_a_panel_with_too_many_families_tells_the_families(drawn):
    """Five families of three: more lines than a legend beside five panels has room for."""
    y = [f"train[:].speed + {k}" for k in range(5)]
    axes = drawn(panels=[{"y": y, "label": [f"start {k}: {{i}}" for k in range(5)]}] * 5)
    assert [text.get_text() for text in axes[0].get_legend().get_texts()] == [f"start {k}" for k in range(5)]
    assert [ax.get_legend() is None for ax in axes[1:]] == [True] * 4
    colours = [line.get_color() for line in axes[0].lines]
    assert [len(set(colours[k : k + 3])) for k in range(0, 15, 3)] == [1] * 5
    assert len(set(colours)) == 5


def test_a_long_title_is_broken_before_the_edge(drawn):
    axes = drawn(title="What is drawn here is of no interest but for its name, which is long " * 2, y=["target.value"])
    figure = axes[0].figure
    assert figure._suptitle.get_window_extent().x1 <= figure.bbox.x1


def test_matplotlib_is_imported_only_to_draw():
    code = "import sys, railcosim.orchestrator.figures; print('matplotlib' in sys.modules)"
    said = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=Path(__file__).parent
    )
    assert said.stdout.strip() == "False"


def test_long_names_do_not_take_the_page_from_the_panel():
    assert _folded("comfort_cruise_bottom_layer cruise=FixedDistanceCruise,train=Tram") == (
        "comfort_cruise_bottom_\nlayer cruise=\nFixedDistanceCruise,\ntrain=Tram"
    )
    assert _folded("train 1") == "train 1"
    assert _folded("$a = b$ and more than there is room for") == "$a = b$ and more than there is room for"


def test_a_title_is_no_wider_than_its_panel():
    text = "a title of a panel " * 12
    assert max(map(len, wrapped(text, 7.8).splitlines())) <= 94
    assert wrapped(text + "$x = 1$", 7.8) == text + "$x = 1$"


@pytest.mark.parametrize("ending", ["png", "svg"])
def test_panels_beside_one_another_leave_no_empty_one(tmp_path, ending):
    with page("Three", 3, tmp_path / f"three.{ending}", size=(6.0, 4.0), columns=2) as axes:
        assert len(axes) == len(axes[0].figure.axes) == 3
    assert (tmp_path / f"three.{ending}").stat().st_size > 1000


def test_a_png_is_drawn_once(tmp_path, monkeypatch):
    drawings = []
    draw = Figure.draw
    monkeypatch.setattr(Figure, "draw", lambda self, renderer: drawings.append(draw(self, renderer)))
    with page("Once", 2, tmp_path / "once.png", size=(4.0, 3.0)):
        pass
    assert len(drawings) == 1
