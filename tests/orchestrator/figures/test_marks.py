"""Numbers of a source, drawn on a figure."""

import pytest
from railcosim.orchestrator.errors import ScenarioError
from railcosim.orchestrator.figures import check_figures


def test_marks_are_lines_and_points_with_their_labels(drawn):
    marks = [
        {"x": 4.0, "label": "about 4 s (stated)"},
        {"y": "cruise[1].gap_min", "label": "least gap"},
        {"x": 0, "y": 16e3},
    ]
    (ax,) = drawn(y=["train[1].position - train[2].position"], scale=1e-3, y_label="gap [km]", marks=marks)
    upright, level, point = ax.lines[1:]
    assert list(upright.get_xdata()) == [4.0, 4.0]
    assert list(level.get_ydata()) == [15.0, 15.0]
    assert (list(point.get_xdata()), list(point.get_ydata())) == ([0.0], [16.0])
    assert [text.get_text() for text in ax.texts] == ["about 4 s (stated)", "least gap", ""]
    assert ax.get_legend() is None


def test_a_mark_that_varies_is_no_mark(drawn):
    with pytest.raises(ScenarioError, match=r"'train\[1\].speed' varies over time; draw it as an entry of y"):
        drawn(y=["target.value"], marks=[{"y": "train[1].speed"}])


@pytest.mark.parametrize(
    ("marks", "message"),
    [
        (3, "marks must be a list of tables"),
        ([3], "marks must be a list of tables"),
        ([{"label": "nowhere"}], "a mark needs x, y or both"),
        ([{"z": 1, "x": 1}], "unknown key 'z' in a mark; there are x, y, label"),
        ([{"lable": "a", "x": 1}], "unknown key 'lable' in a mark; did you mean 'label'?"),
        ([{"x": True}], "x of a mark must be a number or an expression"),
        ([{"x": 1, "label": 3}], "label of a mark must be text"),
        ([{"y": "cruise[1].gap_mn"}], "did you mean 'cruise[1].gap_min'?"),
    ],
)
def test_a_mark_that_means_nothing_is_told(names, marks, message):
    (problem,) = check_figures([{"title": "F", "y": ["target.value"], "marks": marks}], names)
    assert message in str(problem)
