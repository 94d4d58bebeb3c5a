"""What studies and searches show of themselves in a notebook."""

import math
from pathlib import Path

from railcosim.orchestrator.evaluation import Verdict
from railcosim.orchestrator.study.analysis import SHARES, Estimate, Kept, Spread, Summary, summary_html
from railcosim.orchestrator.study.search import Falsified, Optimized
from railcosim.orchestrator.study.search.evaluations import Evaluation
from railcosim.orchestrator.study.search.falsification import Falsification
from railcosim.orchestrator.study.search.optimization import Optimization


def spread(name, value=1.5, count=2):
    quantiles = tuple(Estimate(value) for _ in SHARES)
    run = 0 if count else -1
    return Spread(name, count, 0, Estimate(value), 0.1, quantiles, value, run, value, run)


def summary(metrics, broken=()):
    nothing = spread("unjudged", math.nan, 0)
    kept = (
        Kept("<safe>", 1, 1, 0, Estimate(0.5), spread("<safe>"), (0,)),
        Kept("unjudged", 0, 0, 2, Estimate(math.nan), nothing, ()),
    )
    return Summary(2, {"completed": 2}, 0.95, kept if metrics else (), metrics, broken, "")


def test_a_summary_is_small_and_escaped():
    shown = summary_html(summary((spread("<b>end</b>"),), ((1, "<failed>"),)), "<lag>")
    assert "<b>&lt;lag&gt;</b>: 2 runs (2 completed)" in shown
    assert "<li>run 1: &lt;failed&gt;</li>" in shown
    assert "<td>&lt;safe&gt;</td><td>1 of 2</td><td>1.5</td><td>0</td><td>1.5</td>" in shown
    assert "<td>unjudged</td><td>0 of 0</td><td>–</td><td>–</td><td>–</td>" in shown
    assert f"<td>&lt;b&gt;end&lt;/b&gt;</td>{'<td>1.5</td>' * 6}" in shown
    assert "<table" not in summary_html(summary(()), "empty")
    many = summary_html(summary(tuple(spread(f"m{k}") for k in range(100))), "many")
    assert "Metrics, the first 30 of 100" in many
    assert "<td>m29</td>" in many
    assert "<td>m30</td>" not in many


def test_a_counterexample():
    found = Falsification("<low>", "cma-es", 0, 12, 3, 0, None, True)
    verdict = Verdict("<low>", "always x < 1", "fail", -0.5, 2.0)
    shown = Falsified(found, Path("out"), verdict, Path("a.toml"), ("lag.x = <2>",))._repr_html_()
    assert "<b>&lt;low&gt;</b>: broken after 12 runs" in shown
    assert "<td>margin</td><td>-0.5</td>" in shown
    assert "<code>lag.x = &lt;2&gt;</code>" in shown
    assert Falsified(found, Path("out"))._repr_html_() == "<p><b>&lt;low&gt;</b>: not broken in 12 runs</p>"


def test_the_best():
    best = Evaluation(3, {"lag.x": 1.0}, "completed", metrics={"end": 0.25})
    found = Optimization({"end": "<end>"}, (), 0, 8, 0, (best,), (best,))
    shown = Optimized(found, Path("out"), (Path("<best>.toml"),), (("lag.x = 1", "lag.y = 2"),))._repr_html_()
    assert "&lt;end&gt;" in shown
    assert "<td>&lt;best&gt;.toml</td><td>0.25</td><td>lag.x = 1<br>lag.y = 2</td>" in shown
