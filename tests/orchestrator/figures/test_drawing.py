"""Figures: what is drawn (curves, labels, units, files), and every problem that can be told before a run."""

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest
from railcosim.orchestrator.errors import ScenarioError
from railcosim.orchestrator.figures import drawing
from railcosim.orchestrator.figures.drawing import check_figures, draw


class Run:
    """Three trains with a controller each, twelve cars and a target, over 10 s."""

    step, completed, stop_time = 0.5, True, 10.0
    time = np.arange(21) * 0.5
    parameters = {"cruise[1].gap_min": 15e3, "cruise[1].mode": "comfort"}  # noqa: RUF012

    def __init__(self):
        self.columns = {"target.value": np.full(21, 20.0)}
        self.units = {"target.value": "m/s"}
        for i in range(1, 4):
            self.columns[f"train[{i}].speed"] = i * self.time
            self.columns[f"train[{i}].position"] = -17e3 * i + i * self.time**2 / 2
            self.columns[f"cruise[{i}].force"] = np.full(21, 1e5 * i)
            self.units |= {f"train[{i}].speed": "m/s", f"train[{i}].position": "m", f"cruise[{i}].force": "N"}
        for i in range(1, 13):
            self.columns[f"car[{i}].speed"] = self.time / i
        self.columns |= {f"consist[{i}].force[{k}]": self.time * k for i in (1, 2) for k in (1, 2)}
        self.columns |= {f"lone.{name}": self.time for name in ("force[1]", "force[2]", "map[1,1]", "map[1,2]")}

    def names(self):
        return self.columns.keys()

    def __getitem__(self, name):
        return self.columns[name]


RUN = Run()
NAMES = [*RUN.names(), *RUN.parameters]
GAP = "train[i-1].position - train[i].position"


def labels(**panel):
    return [curve.label for curve in drawing.curves_of(panel, RUN)]


def drawn(tmp_path, **figure):
    """The figure as matplotlib objects, by catching it on its way to the file."""
    from matplotlib.figure import Figure

    kept = []
    original = Figure.savefig
    Figure.savefig = lambda self, *args, **kwargs: (kept.append(self), original(self, *args, **kwargs))
    try:
        draw([{"title": "Figure", **figure}], RUN, tmp_path)
    finally:
        Figure.savefig = original
    return kept[0].axes


@pytest.mark.parametrize(
    ("y", "expected"),
    [
        (["train[:].speed", "target.value"], ["train 1", "train 2", "train 3", "target"]),
        (["train[i].speed"], ["train 1", "train 2", "train 3"]),
        (["train[2:].speed"], ["train 2", "train 3"]),
        ([GAP], ["train 1–2", "train 2–3"]),
        (["train[:].speed - target.value"], ["train 1", "train 2", "train 3"]),
        (["consist[2].force[:]"], ["consist 2 1", "consist 2 2"]),
        (["consist[i].force[1]"], ["consist 1 1", "consist 2 1"]),
        (["lone.force[:]"], ["lone force 1", "lone force 2"]),
        (["lone.force[i] - lone.force[i-1]", "lone.force[i]"],
         ["lone force 1–2", "lone force 1", "lone force 2"]),
        (["lone.map[1,:]"], ["lone map 1,1", "lone map 1,2"]),
        (["abs(train[1].speed)"], ["abs(train[1].speed)"]),
        (["train[:].speed", "train[:].position"],
         [f"train {i} {what}" for what in ("speed", "position") for i in (1, 2, 3)]),
        (["train[:].speed", "train[:].speed * 2"],
         [*(f"train {i} speed" for i in (1, 2, 3)), *(f"train {i} (train[:].speed * 2)" for i in (1, 2, 3))]),
    ],
)  # fmt: skip
def test_labels_name_the_train(y, expected):
    assert labels(y=y) == expected


def test_own_labels():
    assert labels(y=["target.value", "train[1].speed"], label=["v_r", "first"]) == ["v_r", "first"]
    assert labels(y=["train[:].speed"], label=["v"]) == ["v 1", "v 2", "v 3"]
    assert labels(y=[GAP], label=["gap {i} (ahead)"]) == ["gap 1–2 (ahead)", "gap 2–3 (ahead)"]


def test_what_is_drawn_is_what_was_recorded(tmp_path):
    (ax,) = drawn(tmp_path, y=["train[:].speed", "target.value"])
    for i in (1, 2, 3):
        np.testing.assert_array_equal(ax.lines[i - 1].get_data(), [RUN.time, i * RUN.time])
    assert ax.get_xlabel() == "time [s]"
    assert ax.get_ylabel() == "speed [m/s]"
    assert len({line.get_color() for line in ax.lines}) == 4
    assert ax.lines[3].get_linestyle() == "--"  # one line beside a family


def test_scale_applies_to_curves_and_bands(tmp_path):
    (ax,) = drawn(tmp_path, y=[GAP], scale=1e-3, y_label="gap [km]", bands=["cruise[1].gap_min", [16e3, 18e3]])
    assert ax.lines[0].get_ydata()[0] == pytest.approx(17.0)
    levels = [line.get_ydata()[0] for line in ax.lines[2:]]
    assert levels == pytest.approx([15.0, 16.0, 18.0])
    assert ax.get_ylabel() == "gap [km]"


def test_a_function_plot_draws_expressions_in_a_plain_variable(tmp_path):
    x = {"name": "d", "from": 15.5, "to": 19.5, "points": 101}
    (ax,) = drawn(tmp_path, x=x, y=["1 / (d**2 - 15**2) + 1 / (20**2 - d**2)"], x_label="gap d [km]", y_label="U")
    d, u = ax.lines[0].get_data()
    assert (d[0], d[-1], d.size) == (15.5, 19.5, 101)
    np.testing.assert_allclose(u, 1 / (d**2 - 225) + 1 / (400 - d**2))
    assert ax.get_xlabel() == "gap d [km]"


def test_x_may_be_another_signal(tmp_path):
    (ax,) = drawn(tmp_path, x="train[i].position", y=["train[i].speed"])
    np.testing.assert_array_equal(ax.lines[1].get_data(), [RUN["train[2].position"], RUN["train[2].speed"]])
    assert ax.get_xlabel() == "position [m]"
    (ax,) = drawn(tmp_path, x="train[:].position", y=["train[:].speed"])
    np.testing.assert_array_equal(ax.lines[1].get_xdata(), RUN["train[2].position"])


def test_panels_share_x_and_do_not_repeat_the_legend(tmp_path):
    axes = drawn(
        tmp_path,
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


def test_y_follows_what_x_range_shows(tmp_path):
    (ax,) = drawn(tmp_path, y=["train[3].speed"], x_range=[0, 2])
    assert ax.get_ylim()[1] == pytest.approx(6.3)
    (ax,) = drawn(tmp_path, y=["train[3].speed"], x_range=[0, 2], y_range=[-1, 1])
    assert ax.get_ylim() == (-1, 1)


def test_units_stand_on_the_axis_only_when_all_share_one(tmp_path):
    (ax,) = drawn(tmp_path, y=["train[1].speed", "cruise[1].force"])
    assert ax.get_ylabel() == ""
    (ax,) = drawn(tmp_path, y=["train[1].speed - target.value"])
    assert ax.get_ylabel() == "[m/s]"
    assert drawing._bracketed("m/s2") == "[m/s²]"
    assert drawing._bracketed("1/s") == "[1/s]"


def test_many_curves_are_coloured_by_order(tmp_path):
    (ax,) = drawn(tmp_path, y=["car[:].speed"])
    assert len({str(line.get_color()) for line in ax.lines}) == 12


def test_dashes_tell_families_apart_and_colours_the_trains(tmp_path):
    (ax,) = drawn(tmp_path, y=["train[:].speed", "cruise[:].force"])
    assert [line.get_linestyle() for line in ax.lines] == ["-"] * 3 + ["--"] * 3
    assert ax.lines[0].get_color() == ax.lines[3].get_color()


def test_the_legend_stands_beside_the_data(tmp_path):
    (ax,) = drawn(tmp_path, y=["train[:].speed"])
    assert ax.get_legend().get_window_extent().x0 >= ax.get_window_extent().x1


def test_files_are_named_after_their_titles(tmp_path):
    titles = ["Speed", "Speed", "Gap d(1–2), Übersicht!", "???"]
    paths = draw([{"title": title, "y": ["target.value"]} for title in titles], RUN, tmp_path, prefix="fig-")
    names = ["fig-speed.png", "fig-speed-2.png", "fig-gap-d-12-ubersicht.png", "fig-figure.png"]
    assert [path.name for path in paths] == names
    image = matplotlib.image.imread(paths[0])
    assert image.shape == (400, 850, 4)
    assert image.std() > 0.01


def test_drawing_twice_gives_the_same_file(tmp_path):
    first, second = (draw([{"title": "S", "y": ["train[:].speed"]}], RUN, tmp_path)[0].read_bytes() for _ in "ab")
    assert first == second


def test_nan_and_single_points_do_not_stop_a_figure(tmp_path):
    broken = Run()
    broken.columns["target.value"] = np.full(21, np.nan)
    broken.columns["train[1].speed"] = np.full(21, np.inf)
    figure = {"title": "F", "y": ["target.value", "train[1].speed"], "x_range": [0, 1]}
    assert len(draw([figure], broken, tmp_path)) == 1
    short = Run()
    short.time = short.time[:1]
    short.columns = {name: values[:1] for name, values in short.columns.items()}
    assert len(draw([{"title": "F", "y": ["train[:].speed"], "x_range": [0, 1]}], short, tmp_path)) == 1


def test_one_bad_figure_does_not_cost_the_others(tmp_path):
    figures = [
        {"title": "Bad", "y": ["target.valu"]},
        {"title": "Mathematics", "y": ["target.value"], "y_label": r"$\nonsense{$"},
        {"title": "Varies", "y": ["target.value"], "bands": ["train[1].speed"]},
        {"title": "Stands", "y": ["target.value"], "x": "max(train[1].speed)"},
        {"title": "Good", "y": ["target.value"]},
    ]
    with pytest.raises(ScenarioError) as caught:
        draw(figures, RUN, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["good.png"]
    first, second, third, fourth = map(str, caught.value.problems)
    assert "x = 'max(train[1].speed)' is a single number; draw over a signal" in fourth
    assert "figure 'Bad' was not drawn: " in first
    assert "did you mean 'target.value'?" in first
    assert "figure 'Mathematics' was not drawn: " in second
    assert "the band 'train[1].speed' varies over time; draw it as an entry of y" in third


def test_right_figures_have_no_problems():
    figures = [
        {"title": "A", "y": ["train[:].speed", "target.value"], "label": ["v", "v_r"], "y_range": [0, 90]},
        {
            "title": "B",
            "panels": [{"y": [GAP], "scale": 1e-3, "y_label": "km", "bands": [1, [2, "cruise[1].gap_min"]]}],
        },
        {"title": "C", "x": {"name": "d", "from": 0.0, "to": 1}, "y": ["tanh(d) * cruise[1].gap_min"], "x_label": "d"},
        {"title": "D", "x": "train[i].position", "y": "at_sample(train[i].speed)", "x_range": [0, 3]},
    ]
    assert check_figures(figures, NAMES) == []


X = {"name": "d", "from": 0, "to": 1}


@pytest.mark.parametrize(
    ("figure", "message"),
    [
        ({"y": ["target.value"]}, "entry 1 (no title): title is missing; it also names the file"),
        ({"title": "F"}, 'y is missing; give the expressions to draw, as in y = ["train[:].speed", "target.value"]'),
        ({"title": "F", "y": [3]}, "y is missing"),
        (
            {"title": "F", "y": ["train[:].sped"]},
            "no signal or parameter 'train[:].sped'; did you mean 'train[:].speed'?",
        ),
        ({"title": "F", "y": ["1 +"]}, "invalid syntax"),
        ({"title": "F", "y": ["maxx(time)"]}, "unknown function 'maxx'; did you mean 'max'?"),
        ({"title": "F", "y": ["at_sample(target.value)"]}, "at_sample needs every communication step recorded"),
        ({"title": "F", "y": ["target.value"], "lable": []}, "unknown key 'lable'; did you mean 'label'?"),
        ({"title": "F", "y": ["target.value"], "zzz": 1}, "unknown key 'zzz'; there are title, y, x"),
        (
            {"title": "F", "y": ["target.value"], "label": ["a", "b"]},
            "label must be a list of texts, one for each entry",
        ),
        ({"title": "F", "y": ["target.value"], "x_label": 3}, "x_label must be text"),
        ({"title": "F", "y": ["target.value"], "y_range": [3, 1]}, "y_range must be two rising numbers"),
        ({"title": "F", "y": ["target.value"], "x_range": 3}, "x_range must be two rising numbers"),
        ({"title": "F", "y": ["target.value"], "scale": 0, "y_label": "y"}, "scale must be a number other than 0"),
        ({"title": "F", "y": ["target.value"], "scale": 2}, "scale needs y_label, which says the unit that is drawn"),
        ({"title": "F", "y": ["target.value"], "bands": [[1, 2, 3]]}, "bands must be a list of levels and [low, high]"),
        ({"title": "F", "y": ["target.value"], "bands": 3}, "bands must be a list of levels and [low, high]"),
        ({"title": "F", "y": ["target.value"], "bands": ["cruise[1].gap_mn"]}, "did you mean 'cruise[1].gap_min'?"),
        ({"title": "F", "y": ["target.value"], "x": 3}, "x must be an expression, or { name ="),
        ({"title": "F", "y": ["target.value"], "x": "train[1].positon"}, "did you mean 'train[1].position'?"),
        ({"title": "F", "y": ["e"], "x": X}, "unknown name 'e'"),
        ({"title": "F", "y": ["d"], "x": {**X, "form": 1}}, "unknown key 'form' in x; did you mean 'from'?"),
        ({"title": "F", "y": ["d"], "x": {**X, "to": 0}}, "x.from and x.to must be two rising numbers"),
        ({"title": "F", "y": ["1"], "x": {**X, "name": "time"}}, "x.name must be a plain word that is not taken"),
        ({"title": "F", "y": ["d"], "x": {**X, "points": 1}}, "x.points must be a whole number from 2 to 100000"),
        ({"title": "F", "panels": []}, "panels must be a list of tables, each with y"),
        ({"title": "F", "panels": [{"y": ["time"]}], "scale": 3}, "'scale' belongs into the panels"),
        ({"title": "F", "panels": [{"y": ["time"]}, {"y": ["tim"]}]}, "panel 2: 'tim', column 1: unknown name 'tim'"),
    ],
)
def test_problems_name_the_figure_and_the_remedy(figure, message):
    problems = check_figures([figure], NAMES, every_step=False)
    assert len(problems) == 1, problems
    assert message in str(problems[0])
    assert problems[0].place.startswith("[[figures]] entry 1 (")


def test_matplotlib_is_imported_only_to_draw():
    code = "import sys, railcosim.orchestrator.figures.drawing; print('matplotlib' in sys.modules)"
    said = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=Path(__file__).parent
    )
    assert said.stdout.strip() == "False"


def test_the_figures_of_the_documentation_are_right():
    page = (Path(__file__).parents[3] / "docs" / "metrics.md").read_text(encoding="utf-8")
    example = next(block for block in re.findall(r"```toml\n(.*?)```", page, re.DOTALL) if "[[figures]]" in block)
    names = [*NAMES, "cruise[1].gap_max"]
    assert check_figures(tomllib.loads(example)["figures"], names) == []
