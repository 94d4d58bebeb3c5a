"""What is drawn of an expression: curves, their labels, and those of the axes."""

import numpy as np
import pytest
from railcosim.orchestrator.errors import ExpressionError
from railcosim.orchestrator.figures.curves import bracketed, curves_of

GAP = "train[i-1].position - train[i].position"


@pytest.fixture
def labels(recorded):
    return lambda **panel: [curve.label for curve in curves_of(panel, recorded)]


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
        (["lone.x[:]"], ["lone x -1", "lone x 0"]),
        (["lone.n[1][:]"], ["lone n 1 1", "lone n 1 2"]),
        (['signal("lone.$a")'], [r'signal("lone.\$a")']),
        (["abs(train[1].speed)"], ["abs(train[1].speed)"]),
        (["train[:].speed", "train[:].position"],
         [f"train {i} {what}" for what in ("speed", "position") for i in (1, 2, 3)]),
        (["train[:].speed", "train[:].speed * 2"],
         [*(f"train {i} speed" for i in (1, 2, 3)), *(f"train {i} (train[:].speed * 2)" for i in (1, 2, 3))]),
    ],
)  # fmt: skip
def test_labels_name_the_train(labels, y, expected):
    assert labels(y=y) == expected


def test_own_labels(labels):
    assert labels(y=["target.value", "train[1].speed"], label=["v_r", "first"]) == ["v_r", "first"]
    assert labels(y=["train[:].speed"], label=["v"]) == ["v 1", "v 2", "v 3"]
    assert labels(y=[GAP], label=["gap {i} (ahead)"]) == ["gap 1–2 (ahead)", "gap 2–3 (ahead)"]


@pytest.mark.parametrize("more", [-1, 0, 1])
def test_a_signal_is_no_function_however_many_points_it_has(recorded, more):
    x = {"name": "d", "from": 0.0, "to": 1.0, "points": recorded.points + more}
    for y in ("target.value", "abs(train[1].speed)"):
        with pytest.raises(ExpressionError, match=r"runs over time, but is drawn over d; draw a function of it"):
            curves_of({"y": y, "x": x}, recorded)
    for y in ("d", "3", "max(train[1].speed) - d"):
        assert curves_of({"y": y, "x": x}, recorded)[0].y.shape == (recorded.points + more,)


def test_a_function_plot_draws_expressions_in_a_plain_variable(drawn):
    x = {"name": "d", "from": 15.5, "to": 19.5, "points": 101}
    (ax,) = drawn(x=x, y=["1 / (d**2 - 15**2) + 1 / (20**2 - d**2)"], x_label="gap d [km]", y_label="U")
    d, u = ax.lines[0].get_data()
    assert (d[0], d[-1], d.size) == (15.5, 19.5, 101)
    np.testing.assert_allclose(u, 1 / (d**2 - 225) + 1 / (400 - d**2))
    assert ax.get_xlabel() == "gap d [km]"


def test_x_may_be_another_signal(drawn, recorded):
    (ax,) = drawn(x="train[i].position", y=["train[i].speed"])
    np.testing.assert_array_equal(ax.lines[1].get_data(), [recorded["train[2].position"], recorded["train[2].speed"]])
    assert ax.get_xlabel() == "position [m]"
    (ax,) = drawn(x="train[:].position", y=["train[:].speed"])
    np.testing.assert_array_equal(ax.lines[1].get_xdata(), recorded["train[2].position"])


def test_units_stand_on_the_axis_only_when_all_share_one(drawn):
    (ax,) = drawn(y=["train[1].speed", "cruise[1].force"])
    assert ax.get_ylabel() == ""
    (ax,) = drawn(y=["train[1].speed - target.value"])
    assert ax.get_ylabel() == "[m/s]"
    assert bracketed("m/s2") == "[m/s²]"
    assert bracketed("1/s") == "[1/s]"
