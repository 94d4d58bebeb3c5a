"""The scatter matrix: half a square of panels."""

import numpy as np
from railcosim.orchestrator.study.analysis.pictures.axes import Axis
from railcosim.orchestrator.study.analysis.pictures.scatter import columns_of, draw_matrix


def matrix(studied, axes, vary, count=40, failed=()):
    frame, plan = studied(vary, {"margin.m": lambda x, *_: x - 0.5}, count, failed=failed)
    columns = columns_of([Axis(frame, one) for one in plan.dimensions], [("margin of m", frame["margin.m"].to_numpy())])
    panels = axes(len(columns) ** 2)
    draw_matrix(panels, columns, frame["verdict.m"].astype(object).to_numpy())
    return panels, len(columns)


def test_every_parameter_with_every_other(studied, axes):
    vary = {"a.x": "0:1", "b.y": "loguniform(1, 9)", "c": ["P", "Q"], "d": [1, 2, 5]}
    panels, count = matrix(studied, axes, vary, failed=(3,))
    left = set(panels[0].figure.axes)
    assert [ax in left for ax in panels] == [column <= row for row in range(count) for column in range(count)]
    assert [ax.get_xlabel() for ax in panels[-count:]] == ["a.x", "b.y", "c", "d", "margin of m"]
    assert [panels[k * count].get_ylabel() for k in range(count)] == ["", "b.y", "c", "d", "margin of m"]
    diagonal = panels[1 + count]
    assert (
        sum(bar.get_height() for bar in diagonal.patches[20:]) + sum(bar.get_height() for bar in diagonal.patches[:20])
        == 40
    )
    assert sum(len(marks.get_offsets()) for marks in panels[count].collections) == 40
    (said,) = panels[0].figure.legends
    assert said.get_texts()[0].get_text() == "no verdict (1)"


def test_a_column_without_a_value_is_empty(studied, axes):
    panels, _ = matrix(studied, axes, {"a.x": "0:1"}, 3, failed=(0, 1, 2))
    assert not panels[-1].patches
    assert np.isnan(panels[2].collections[0].get_offsets()[:, 1].filled(np.nan)).all()
