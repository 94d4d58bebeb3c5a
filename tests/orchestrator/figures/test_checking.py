"""Every problem of a figure that can be told before a run."""

import re
import tomllib
from pathlib import Path

import pytest
from railcosim.orchestrator.figures import check_figures

GAP = "train[i-1].position - train[i].position"
X = {"name": "d", "from": 0, "to": 1}


def test_right_figures_have_no_problems(names):
    figures = [
        {"title": "A", "y": ["train[:].speed", "target.value"], "label": ["v", "v_r"], "y_range": [0, 90]},
        {
            "title": "B",
            "panels": [{"y": [GAP], "scale": 1e-3, "y_label": "km", "bands": [1, [2, "cruise[1].gap_min"]]}],
        },
        {"title": "C", "x": {"name": "d", "from": 0.0, "to": 1}, "y": ["tanh(d) * cruise[1].gap_min"], "x_label": "d"},
        {"title": "D", "x": "train[i].position", "y": "at_sample(train[i].speed)", "x_range": [0, 3]},
    ]
    assert check_figures(figures, names) == []


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
        ({"title": "F", "y": ["time"], "format": "jpg"}, "format must be one of png, svg, pdf, not 'jpg'"),
        ({"title": "F", "y": ["time"], "remark": 5}, "remark must be text"),
        ({"title": "F", "y": ["time"], "dpi": 5}, "dpi must be a number from 20 to 1200, not 5"),
        ({"title": "F", "y": ["time"], "y_log": 1}, "y_log must be true or false"),
        ({"title": "F", "y": ["time"], "x_log": True, "x_range": [0, 1]}, "x_range must be positive on a logarithmic"),
        ({"title": "F", "panels": [{"title": "{tim}", "y": ["time"]}]}, "unknown name 'tim'"),
        ({"title": "F", "panels": []}, "panels must be a list of tables, each with y"),
        ({"title": "F", "panels": [{"y": ["time"]}], "scale": 3}, "'scale' belongs into the panels"),
        ({"title": "F", "panels": [{"y": ["time"]}, {"y": ["tim"]}]}, "panel 2: 'tim', column 1: unknown name 'tim'"),
    ],
)
def test_problems_name_the_figure_and_the_remedy(figure, message, names):
    problems = check_figures([figure], names, every_step=False)
    assert len(problems) == 1, problems
    assert message in str(problems[0])
    assert problems[0].place.startswith("[[figures]] entry 1 (")


def test_the_figures_of_the_documentation_are_right(names):
    page = (Path(__file__).parents[3] / "docs" / "metrics.md").read_text(encoding="utf-8")
    example = next(block for block in re.findall(r"```toml\n(.*?)```", page, re.DOTALL) if "[[figures]]" in block)
    names = [*names, "cruise[1].gap_max"]
    assert check_figures(tomllib.loads(example)["figures"], names) == []
