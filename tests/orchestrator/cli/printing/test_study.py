"""A study in words, on wide and narrow terminals."""

import math
import sys
from types import SimpleNamespace

import pytest
from railcosim.orchestrator.cli.printing import show_runs
from railcosim.orchestrator.cli.printing.study import show_summary
from railcosim.orchestrator.study.analysis import Estimate, Influence, Kept, Sensitivity, Spread, Summary

from .test_progress import Terminal

NONE = Estimate(math.nan)
GAP = Spread("gap", 199, 1, Estimate(3, 2, 4), 0.5, (NONE, Estimate(1.5, 1, 2), NONE), -0.715, 126, 9.0, 3)
EMPTY = Spread("lost", 0, 200, NONE, math.nan, (NONE,) * 3, math.nan, -1, math.nan, -1)
KEPT = (
    Kept("gap", 180, 19, 1, Estimate(0.9045, 0.856, 0.938), GAP, (126,)),
    Kept("lost", 0, 2, 198, Estimate(0.0), EMPTY, (7, 9)),
    Kept("never", 0, 0, 0, NONE, EMPTY, ()),
)
SUMMARY = Summary(200, {"completed": 199, "failed": 1}, 0.95, KEPT, (GAP, EMPTY), ((5, "boom"),), "Brackets are ...")
WORDS = "requirement pass of those judged least margin in run median"


def rows(lines):
    return [" ".join(line.split()) for line in lines if line]


@pytest.mark.parametrize("width", [80, 160])
def test_runs_and_requirements(shown, width):
    found = rows(shown(show_summary, SUMMARY, width=width))
    assert found[:2] == ["200 runs: 199 completed, 1 failed", "run 5: boom"]
    assert found[2:9] == [
        "Requirements",
        WORDS,
        "gap 180 of 199 90.5% [85.6, 93.8] -0.715 126 1.5",
        "lost 0 of 2 0.0% - 7 -",
        "never 0 of 0 - - - -",
        "unjudged: 1 run (gap)",
        "unjudged: 198 runs (lost)",
    ]
    assert found[-1] == "Brackets are ..."


def test_metrics(shown):
    wide = rows(shown(show_summary, SUMMARY, width=160))
    assert "gap 3 [2, 4] 0.5 - 1.5 - -0.715 (126) 9 (3)" in wide
    assert "lost - - - - - - -" in wide
    narrow = rows(shown(show_summary, SUMMARY, width=72))
    assert "gap 3 - 1.5 - -0.715 9" in narrow
    assert "without a value: 200 runs (lost)" in narrow


def test_what_matters(shown):
    first = Influence("a.x", Estimate(0.5, 0.4, 0.6), NONE, Estimate(0.9, 0.8, 1.0), Estimate(0.95, 0.85, 1.05))
    second = Influence("b", NONE, NONE, Estimate(-0.001, -0.101, 0.099), Estimate(0.2))
    made = Sensitivity("margin.gap", 199, "Saltelli", 0.456, (first, second))
    lines = rows(shown(show_summary, SUMMARY, [made], width=80))
    assert lines[-5:] == [
        "What matters for margin.gap",
        "parameter alone with others rank correlation",
        "a.x 0.90 ±0.10 0.95 ±0.10 0.50 ±0.10",
        "b 0.00 ±0.10 0.20 -",
        "199 runs; shares by Saltelli; ± for 95%; ranks explain 46% of its variance",
    ]
    many = Sensitivity("metric.y", 9, "", math.nan, tuple(Influence(f"p{k}", Estimate(0.1)) for k in range(10)))
    lines = rows(shown(show_summary, SUMMARY, [made] * 3 + [many] * 2 + [Sensitivity("z", 9, "", 0.0, ())]))
    assert lines[-1] == "9 runs; ± for 95%; 2 weaker parameters are left out"
    assert sum(line.startswith("What matters for") for line in lines) == 4


def test_many_rows_without_a_value_are_counted(shown):
    lost = tuple(
        Spread(f"lost{k}", *[getattr(EMPTY, x) for x in EMPTY.__dataclass_fields__ if x != "name"]) for k in range(9)
    )
    lines = rows(shown(show_summary, Summary(200, {"failed": 200}, 0.95, (), lost, (), "Note.")))
    assert "without a value: 200 runs (9 rows)" in lines
    assert rows(shown(show_summary, Summary(0, {}, 0.95, (), (), (), ""))) == ["no runs"]


def test_on_a_terminal_there_is_a_bar(monkeypatch, at_once):
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    with show_runs("small", False) as shown:
        shown.begun(SimpleNamespace(dashboard="http://here/status"))
        shown.progress(1, 2, 0)
        shown.progress(2, 2, 1)
    said = terminal.getvalue()
    assert "what the workers do: http://here/status" in said
    assert "2 of 2 runs, 1 failed" in said


def test_elsewhere_there_are_lines(capsys):
    with show_runs("small", False) as shown:
        shown.begun(SimpleNamespace(dashboard=""))
        for done in range(1, 101):
            shown.progress(done, 100, done // 50)
    lines = capsys.readouterr().err.splitlines()
    assert lines[0] == "small: 10 % of 100 runs"
    assert lines[-1] == "small: 100 % of 100 runs, 2 failed"
    assert len(lines) == 10
    with show_runs("small", True) as shown:
        shown.begun(None)
        shown.progress(1, 1, 0)
    assert capsys.readouterr().err == ""
