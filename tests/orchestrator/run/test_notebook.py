"""What runs and results show of themselves in a notebook."""

import sys

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import pytest
from railcosim.orchestrator import Results, System, run
from railcosim.orchestrator.comparison import compare
from railcosim.orchestrator.errors import RailcosimError, ScenarioError
from railcosim.orchestrator.run.execution import execute


@pytest.fixture
def system(mine):
    made = System(stop_time=1.0, step=0.1)
    made.add("lag[1]", mine("Lag"), u=1.0, x=0.0)
    made.add("lag[2]", mine("Lag"), u=2.0, x=0.0)
    made.provenance.name = "<two>"
    made.judged.metrics = {"end": "final(lag[i].x)", "count": "max(lag[1].x)"}
    made.judged.requirements = {"low": "always lag[i].x < 1"}
    return made


def test_a_run(system):
    shown = run(system, kind="native")._repr_html_()
    assert "<b>&lt;two&gt;</b>: completed" in shown
    assert "<td>fail</td><td>low</td>" in shown
    assert "<td>end[2]</td><td>1.26424</td>" in shown


def test_a_run_that_failed(system, mine):
    system.add("fails", mine("Fails"), until=0.5)
    shown = execute(system, kind="native")._repr_html_()
    assert ": failed</p><ul><li>fails, t = 0.6" in shown


def test_results(system):
    outcome = run(system, kind="native")
    shown = outcome.results._repr_html_()
    assert "Results of 2 signals at 11 points from 0 to 1 s" in shown
    assert "<code>lag[1].x</code></td><td></td><td>0.63212</td><td>0</td><td>0.63212</td>" in shown


def test_many_results_and_texts():
    columns = {f"x[{k}]": np.ones(2) for k in range(30)}
    facts = {"units": {}, "parameters": {}, "step": 1.0, "stop_time": 1.0, "completed": True}
    shown = Results(columns, np.arange(2.0), **facts)._repr_html_()
    assert "2 points from 0 to 1 s, of which 20 are listed" in shown
    texts = Results({"word": np.array(["a", "<b>"], dtype=object), "y": np.ones(2)}, np.arange(2.0), **facts)
    assert "<td>&lt;b&gt;</td><td>–</td><td>–</td>" in texts._repr_html_()
    empty = Results({"y": np.empty(0)}, np.empty(0), **facts)
    assert "<td>–</td><td>–</td><td>–</td>" in empty._repr_html_()


def test_a_comparison(system):
    other = system.changed(stop_time=0.5)
    shown = compare({"long": system, "<short>": other}, kind="native")._repr_html_()
    assert "&lt;short&gt;" in shown
    assert "<td>end[1]</td><td>0.63212</td><td>0.393469</td>" in shown
    assert "<td>low</td><td>fail</td>" in shown


def test_a_frame(system, monkeypatch):
    system.add("train", "PointMassTrain", force=0.0)
    outcome = run(system, kind="native")
    frame = outcome.frame()
    assert list(frame)[:2] == ["lag[1].x", "lag[2].x"]
    assert frame.index.name == "time"
    assert frame.attrs["units"]["train.speed"] == "m/s"
    assert "lag[1].x" not in frame.attrs["units"]
    np.testing.assert_array_equal(frame["lag[2].x"], outcome["lag[2].x"])
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(RailcosimError, match="pip install pandas"):
        outcome.frame()


def test_a_plot(system):
    mpl.use("Agg")
    outcome = run(system, kind="native")
    drawn = outcome.plot("lag[:].x", "lag[2].x - lag[1].x")
    assert len(drawn.lines) == 3
    assert drawn.get_xlabel() == "time [s]"
    assert outcome.plot("lag[1].x", ax=drawn) is drawn
    assert len(drawn.lines) == len({line.get_color() for line in drawn.lines}) == 4
    with pytest.raises(ScenarioError, match=r"lag\[3\]"):
        outcome.plot("lag[3].x")
    plt.close("all")
