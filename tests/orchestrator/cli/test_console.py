"""What the tables show, on wide and narrow terminals; the words of the whole command line: test_cli.py."""

import io
import math
import re

import pytest
from railcosim.orchestrator.cli import console
from railcosim.orchestrator.evaluation.metrics import Metric, MetricChange
from railcosim.orchestrator.evaluation.published import PublishedRow
from railcosim.orchestrator.evaluation.requirements import Verdict
from railcosim.orchestrator.fmi.interface import Interface, Variable
from railcosim.orchestrator.names import SignalName
from railcosim.orchestrator.problems import Problem
from rich.console import Console


def shown(show, *arguments, width=120):
    """What a function prints on a terminal of that width, without colours; no line is wider than it."""
    out = Console(file=io.StringIO(), width=width, highlight=False, force_terminal=True, color_system=None)
    show(out, *arguments)
    text = re.sub(r"\x1b\[[0-9;]*m", "", out.file.getvalue())
    assert max(map(len, text.splitlines())) <= width
    return [line.rstrip() for line in text.splitlines()]


def row(metric="gap", measured=17.25, *, published=17.0, verdict="reproduced", reason="", claim="", where="Table 2"):
    return PublishedRow(metric, None, claim, None, published, measured, 0.5, "km", where, "stated", verdict, reason)


GAPS = Metric("gap", "final(x)", {2: 17.3125, 3: 16.646}, "m")


def test_single_values_stand_one_a_row_and_indexed_ones_side_by_side():
    lines = shown(console.show_metrics, [Metric("settling", "s(x)", {None: 138.7}, "s"), GAPS])
    assert [line.split() for line in lines if line] == [
        ["Metrics"],
        ["metric", "value", "unit"],
        ["settling", "138.7", "s"],
        ["Metrics", "by", "index"],
        ["metric", "[2]", "[3]", "unit"],
        ["gap", "17.3125", "16.646", "m"],
    ]


def test_on_a_narrow_terminal_indexed_values_stand_below_one_another():
    lines = shown(console.show_metrics, [Metric("gap", "final(x)", dict.fromkeys(range(1, 9), 17312.5), "m")], width=50)
    assert [line.split() for line in lines[1:4]] == [
        ["Metrics"],
        ["metric", "value", "unit"],
        ["gap[1]", "17312.5", "m"],
    ]
    assert any(line.split() == ["gap[8]", "17312.5", "m"] for line in lines)


def test_a_value_is_never_an_unexplained_nan_or_inf():
    late = Metric("settling", "s(x, until = 9)", {None: math.inf}, "s")
    lost = Metric("gap", "g(x)", {None: math.nan}, "", problem="'g(x)': the window lasts until 9 s")
    text = "\n".join(shown(console.show_metrics, [late, lost]))
    assert re.search(r"settling +never +s", text)
    assert re.search(r"gap +-$", text, re.MULTILINE)
    assert "no value: the window lasts until 9 s (gap)" in text
    assert "nan" not in text
    assert "inf" not in text


def test_comfort_is_shown_with_its_levels_under_the_sources_own_words():
    text = "\n".join(shown(console.show_metrics, [Metric("peak", "c(x)", {1: 0.595, 2: 0.937}, "m/s2", comfort=True)]))
    assert "0.595 (2, 3)" in text
    assert "0.937 (3, 4)" in text
    assert "quasi-static acceleration compared with the ISO 2631-1 reaction scale (as in the source)" in text


def test_a_comparison_stands_beside_each_value():
    lines = shown(console.show_metrics, [GAPS], [MetricChange("gap", 2, 17.3125, 17.3, "m")])
    assert ["gap[2]", "17.3125", "17.3", "-0.0125", "m"] in [line.split() for line in lines]
    assert ["gap[3]", "16.646", "m"] in [line.split() for line in lines]


def test_a_requirement_shows_verdict_margin_and_the_worst_place():
    verdicts = [
        Verdict("spacing", "always a <\n    b", "fail", margin=-759.0, time=140.2, index=4),
        Verdict("later", "always c until 9", "inconclusive", reason="the window is not covered"),
    ]
    lines = shown(console.show_requirements, verdicts)
    assert any(re.fullmatch(r"spacing +fail +-759 +140\.2 s, i = 4 +always a < b", line) for line in lines)
    assert "because: the window is not covered (later)" in lines
    assert "Requirements are judged at the recorded points." in lines


@pytest.mark.parametrize("width", [160, 80, 70])
def test_published_values_fold_the_claim_and_nothing_else(width):
    claim = "with the comfort layer train 4 accelerates with about 1 m/s2 in the first half minute of the run"
    groups = console.by_source([row(claim=claim), row("speed"), row("time", where="Fig. 5")])
    lines = shown(console.show_published, groups, width=width)
    assert lines[1] == "Published values"
    assert any(re.fullmatch(r"gap: ?.* 17 +17\.25 +0\.5 +km +reproduced", line) for line in lines)
    assert any(re.fullmatch(r"speed +17 +17\.25 +0\.5 +km +reproduced", line) for line in lines)
    assert lines.index("stated: Table 2") < lines.index("stated: Fig. 5")
    assert len(lines) <= (9 if width == 160 else 14)


def test_why_a_value_is_not_judged_or_missed_is_said_once():
    rows = [row("a", verdict="not judged", reason="the scenario was modified") for _ in range(3)]
    rows.append(row("b", math.nan, verdict="missed", reason="there is no value"))
    rows.append(row("c", published=None, verdict="not judged", reason="no number is stated"))
    text = "\n".join(shown(console.show_published, console.by_source(rows)))
    assert text.count("the scenario was modified") == 1
    assert "missed: there is no value (b)" in text
    assert re.search(r"c +in words", text)


def test_the_summary_names_what_went_wrong():
    verdicts = [Verdict("spacing", "", "fail"), Verdict("comfort", "", "pass"), Verdict("late", "", "inconclusive")]
    rows = [row("a"), row("b", verdict="missed"), row("c", verdict="not judged")]
    assert console.summary(verdicts, rows) == [
        ("1 of 3 requirements pass; fail: spacing; 1 inconclusive", True),
        ("1 of 3 published values reproduced; missed: b; 1 not judged", True),
    ]
    assert console.summary([], [row()]) == [("1 of 1 published values reproduced", False)]


def test_problems_that_differ_in_the_index_only_are_told_once():
    names = [SignalName(f"train[{k}]", "a") for k in (1, 2)]
    first, second = (Problem(f"x.toml:3: {name}", "wrong", names=(name,)) for name in names)
    other = Problem("x.toml:4: train[1].a", "wrong", names=(names[0],))
    assert console.folded([first, second, other]) == [f"{first} (and 1 more like it, for other indices)", str(other)]


def test_notes_that_differ_in_the_index_only_are_told_once():
    assert console.folded(["train[1].a: so", "train[2].a: so"]) == [
        "train[1].a: so (and 1 more like it, for other indices)"
    ]


def test_an_interface_stands_by_causality_with_what_each_output_depends_on():
    variables = [
        Variable("gain", 0, "Real", "parameter", "tunable", "exact", 0.5, "1/s", description="of the loop"),
        Variable("on", 1, "Boolean", "input", "discrete", None, True),
        Variable("u", 2, "Real", "input", "continuous", None, 0.0, "m", description="what comes in"),
        Variable("y", 3, "Real", "output", "continuous", None, None, "m", dependencies=frozenset({"u", "on"})),
        Variable("z", 4, "Real", "output", "continuous", None, None, None, dependencies=frozenset()),
        Variable("w", 5, "Real", "output", "continuous", None, None),
    ]
    interface = Interface("M", "M", "{1}", {v.name: v for v in variables}, {}, {}, vendor={"optional_inputs": ["u"]})
    lines = [" ".join(line.split()) for line in shown(console.show_interface, interface)]
    assert [line for line in lines if line in ("Parameters", "Inputs", "Outputs")] == [
        "Parameters",
        "Inputs",
        "Outputs",
    ]
    assert "gain Real 1/s 0.5 of the loop (tunable)" in lines
    assert "on Boolean true" in lines
    assert "u Real m 0 what comes in (optional)" in lines
    assert "y Real m on, u" in lines
    assert "z Real no input" in lines
    assert "w Real not said" in lines


def test_progress_starts_at_the_start_time(capsys):
    with console.progress("late", False, start=100.0) as progress:
        lines = {}
        for time in (100.0, 104.0, 110.0):
            progress(time, 110.0)
            lines[time] = capsys.readouterr().err.splitlines()
    told = [f"late: {percent} % of 10 s" for percent in range(10, 101, 10)]
    assert lines == {100.0: [], 104.0: told[:4], 110.0: told[4:]}
    with console.progress("quiet", True) as progress:
        assert progress is None


def test_in_a_pipe_lines_are_not_folded_and_columns_sets_the_width(monkeypatch, capsys):
    monkeypatch.delenv("COLUMNS", raising=False)
    assert console.console().width == 160
    console.say(console.console(), "word " * 60)
    assert len(capsys.readouterr().out.splitlines()) == 1
    monkeypatch.setenv("COLUMNS", "70")
    assert console.console().width == 70
