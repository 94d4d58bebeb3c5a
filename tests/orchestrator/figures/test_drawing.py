"""Figures as files: what was recorded is in them, and one that cannot be drawn costs no other."""

import copy
import re

import matplotlib.image
import numpy as np
import pytest
from matplotlib.figure import Figure
from railcosim.orchestrator.errors import ScenarioError
from railcosim.orchestrator.figures import draw, draw_curves, remove_drawn, written_as

GAP = "train[i-1].position - train[i].position"


def test_what_is_drawn_is_what_was_recorded(drawn, recorded):
    (ax,) = drawn(y=["train[:].speed", "target.value"])
    for i in (1, 2, 3):
        np.testing.assert_array_equal(ax.lines[i - 1].get_data(), [recorded.time, i * recorded.time])
    assert ax.get_xlabel() == "time [s]"
    assert ax.get_ylabel() == "speed [m/s]"
    assert len({line.get_color() for line in ax.lines}) == 4
    assert ax.lines[3].get_linestyle() == "--"  # one line beside a family


def test_scale_applies_to_curves_and_bands(drawn):
    (ax,) = drawn(y=[GAP], scale=1e-3, y_label="gap [km]", bands=["cruise[1].gap_min", [16e3, 18e3]])
    assert ax.lines[0].get_ydata()[0] == pytest.approx(17.0)
    levels = [line.get_ydata()[0] for line in ax.lines[2:]]
    assert levels == pytest.approx([15.0, 16.0, 18.0])
    assert ax.get_ylabel() == "gap [km]"


def test_panels_share_x_and_do_not_repeat_the_legend(drawn):
    axes = drawn(
        x_range=[0, 8],
        panels=[
            {"title": "(a) speed", "y": ["train[:].speed"]},
            {"title": "(b) force", "y": ["cruise[:].force"]},
            {"title": "(c) speed again", "y": ["cruise[:].force"]},
        ],
    )
    assert [ax.get_title(loc="left") for ax in axes] == ["(a) speed", "(b) force", "(c) speed again"]
    assert [ax.get_xlabel() for ax in axes] == ["", "", "time [s]"]
    assert {ax.get_xlim() for ax in axes} == {(0.0, 8.0)}
    assert [ax.get_legend() is not None for ax in axes] == [True, True, False]


def test_y_follows_what_x_range_shows(drawn):
    (ax,) = drawn(y=["train[3].speed"], x_range=[0, 2])
    assert ax.get_ylim()[1] == pytest.approx(6.3)
    (ax,) = drawn(y=["train[3].speed"], x_range=[0, 2], y_range=[-1, 1])
    assert ax.get_ylim() == (-1, 1)


def test_dashes_tell_families_apart_and_colours_the_trains(drawn):
    (ax,) = drawn(y=["train[:].speed", "cruise[:].force"])
    assert [line.get_linestyle() for line in ax.lines] == ["-"] * 3 + ["--"] * 3
    assert ax.lines[0].get_color() == ax.lines[3].get_color()


def test_files_are_named_after_their_titles(tmp_path, recorded):
    titles = ["Speed", "Speed", "Gap d(1–2), Übersicht!", "???"]
    paths = draw([{"title": title, "y": ["target.value"]} for title in titles], recorded, tmp_path, prefix="fig-")
    names = ["fig-speed.png", "fig-speed-2.png", "fig-gap-d-12-ubersicht.png", "fig-figure.png"]
    assert [path.name for path in paths] == names
    image = matplotlib.image.imread(paths[0])
    assert image.shape == (400, 850, 4)
    assert image.std() > 0.01


def test_drawing_twice_gives_the_same_file(tmp_path, recorded):
    first, second = (draw([{"title": "S", "y": ["train[:].speed"]}], recorded, tmp_path)[0].read_bytes() for _ in "ab")
    assert first == second


def test_nan_and_single_points_do_not_stop_a_figure(recorded, tmp_path):
    recorded.columns["target.value"] = np.full(21, np.nan)
    recorded.columns["train[1].speed"] = np.full(21, np.inf)
    figure = {"title": "F", "y": ["target.value", "train[1].speed"], "x_range": [0, 1]}
    assert len(draw([figure], recorded, tmp_path)) == 1
    recorded.time = recorded.time[:1]
    recorded.columns = {name: values[:1] for name, values in recorded.columns.items()}
    assert len(draw([{"title": "F", "y": ["train[:].speed"], "x_range": [0, 1]}], recorded, tmp_path)) == 1


def test_one_bad_figure_does_not_cost_the_others(tmp_path, recorded):
    figures = [
        {"title": "Bad", "y": ["target.valu"]},
        {"title": "Mathematics", "y": ["target.value"], "y_label": r"$\nonsense{$"},
        {"title": "Varies", "y": ["target.value"], "bands": ["train[1].speed"]},
        {"title": "Stands", "y": ["target.value"], "x": "max(train[1].speed)"},
        {"title": "Rows", "y": ["target.value"], "x": "train[:].speed"},
        {"title": "Good", "y": ["target.value"]},
    ]
    with pytest.raises(ScenarioError) as caught:
        draw(figures, recorded, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["good.png"]
    first, second, third, fourth, fifth = map(str, caught.value.problems)
    assert re.search(r"x = 'train\[:\].speed' has \d+ rows and y = 'target.value' has 1; draw over one signal", fifth)
    assert "x = 'max(train[1].speed)' is a single number; draw over a signal" in fourth
    assert "figure 'Bad' was not drawn: " in first
    assert "did you mean 'target.value'?" in first
    assert "figure 'Mathematics' was not drawn: " in second
    assert "'train[1].speed' varies over time; draw it as an entry of y" in third


def test_a_figure_is_written_in_the_format_and_resolution_it_asks_for(tmp_path, recorded):
    figures = [{"title": "S", "y": ["train[:].speed"], "format": format, "dpi": 50} for format in ("png", "svg", "pdf")]
    paths = draw(figures, recorded, tmp_path)
    assert [path.suffix for path in paths] == [".png", ".svg", ".pdf"]
    assert matplotlib.image.imread(paths[0]).shape == (200, 425, 4)
    assert paths[1].read_text(encoding="utf-8").startswith("<?xml")
    assert paths[2].read_bytes().startswith(b"%PDF")
    first = [path.read_bytes() for path in paths]
    assert [path.read_bytes() for path in draw(figures, recorded, tmp_path)] == first


def test_options_take_the_place_of_what_figures_ask_for():
    figures = [{"title": "A", "format": "pdf"}, {"title": "B"}]
    assert written_as(figures, None, None) == figures
    assert written_as(figures, "svg", 200.0) == [{"title": name, "format": "svg", "dpi": 200.0} for name in "AB"]


def test_a_logarithmic_axis_shows_what_is_positive(drawn):
    (ax,) = drawn(y=["train[1].speed"], y_log=True, x_range=[0, 5])
    assert (ax.get_xscale(), ax.get_yscale()) == ("linear", "log")
    (ax,) = drawn(y=["train[1].speed"], x_log=True)
    assert ax.get_xscale() == "log"


def test_lines_that_hide_each_other_get_dashes_and_widths(drawn, recorded):
    recorded.columns["target.value"] = recorded.time * 1.001
    (ax,) = drawn(y=["train[1].speed", "target.value", "train[3].speed"], label=["a", "b", "c"])
    assert [line.get_linestyle() for line in ax.lines] == ["-", "--", ":"]
    widths = [line.get_linewidth() for line in ax.lines]
    assert widths == sorted(widths, reverse=True)
    assert widths[0] > 2 * widths[2]
    (ax,) = drawn(y=["train[1].speed", "train[3].speed"], label=["a", "c"])
    assert {line.get_linestyle() for line in ax.lines} == {"-"}


def test_a_title_says_the_numbers_of_the_run(drawn):
    (ax,) = drawn(panels=[{"title": "gap over {cruise[1].gap_min / 1000} km", "y": ["target.value"]}])
    assert ax.get_title(loc="left") == "gap over 15 km"
    (ax,) = drawn(panels=[{"title": "$x_{1}$", "y": ["target.value"]}])
    assert ax.get_title(loc="left") == "$x_{1}$"


def test_a_remark_stands_below_the_title(drawn):
    axes = drawn(title="Speed", remark="of a law of ours", y=["target.value"])
    assert axes[0].figure._suptitle.get_text() == "Speed\nof a law of ours"


@pytest.mark.parametrize(
    "record",
    [
        '{"figures": ["speed.png", "gap.svg", "../other.png", "sub/in.png", ".png"]}',
        "{",
        '{"figures": [1]}',
        "[]",
        None,
    ],
)
def test_figures_of_earlier_results_go_in_every_format(tmp_path, record):
    folder = tmp_path / "out"
    (folder / "sub").mkdir(parents=True)
    files = [folder / name for name in ("speed.png", "speed.pdf", "gap.svg", "mine.png", "../other.png", "sub/in.png")]
    for file in files:
        file.touch()
    if record is not None:
        (folder / "run.json").write_text(record)
    remove_drawn(folder / "run.json")
    gone = files[:3] if record and "speed" in record else []
    assert [file for file in files if not file.exists()] == gone


def test_numbers_in_a_title_are_those_of_all_runs(recorded):
    other = copy.deepcopy(recorded)
    other.columns["target.value"] = recorded.columns["target.value"] + 1.0
    lacking = copy.deepcopy(recorded)
    lacking.columns = {}
    panel = {"title": "to {final(target.value)} m/s, {final(train[1].speed)}", "y": ["target.value"]}
    ax = Figure().subplots()
    draw_curves(ax, panel, [], recorded, x_label=True, others=[other, recorded, lacking])
    first = recorded["target.value"][-1]
    assert ax.get_title().startswith(f"to {first:.4g} / {first + 1.0:.4g} m/s, ")
    assert "/" not in ax.get_title().partition("m/s, ")[2]
