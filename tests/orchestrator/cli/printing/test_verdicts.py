"""Verdicts as tables, and in a line."""

import math
import re

import pytest
from railcosim.orchestrator.cli.printing.verdicts import by_source, in_one_line, show_requirements, show_values, summary
from railcosim.orchestrator.evaluation import ComparedValue, Verdict


def row(
    metric="gap", measured=17.25, *, value=17.0, verdict="reproduced", reason="", claim="", where="Table 2", **more
):
    made = {"tolerance": 0.5, "unit": "km", "origin": "stated", **more}
    return ComparedValue(
        metric, None, claim, None, value, measured, where=where, verdict=verdict, reason=reason, **made
    )


def test_a_requirement_shows_verdict_margin_and_the_worst_place(shown):
    verdicts = [
        Verdict("spacing", "always a <\n    b", "fail", margin=-759.0, time=140.2, index=4),
        Verdict("later", "always c until 9", "inconclusive", reason="the window is not covered"),
    ]
    lines = shown(show_requirements, verdicts)
    assert any(re.fullmatch(r"spacing +fail +-759 +140\.2 s, i = 4 +always a < b", line) for line in lines)
    assert "because: the window is not covered (later)" in lines
    assert "Requirements are judged at every communication point." in lines


@pytest.mark.parametrize("width", [160, 80, 70])
def test_published_values_fold_the_claim_and_nothing_else(shown, width):
    claim = "with the comfort layer train 4 accelerates with about 1 m/s2 in the first half minute of the run"
    groups = by_source([row(claim=claim), row("speed"), row("time", where="Fig. 5")])
    lines = shown(show_values, "Published values", groups, width=width)
    assert lines[1] == "Published values"
    assert any(re.fullmatch(r"gap: ?.* 17 +17\.25 +0\.5 +km +reproduced", line) for line in lines)
    assert any(re.fullmatch(r"speed +17 +17\.25 +0\.5 +km +reproduced", line) for line in lines)
    assert lines.index("stated: Table 2") < lines.index("stated: Fig. 5")
    assert len(lines) <= (9 if width == 160 else 14)


def test_why_a_value_is_not_judged_or_missed_is_said_once(shown):
    rows = [row("a", verdict="departs", reason="the fit is coarse") for _ in range(3)]
    rows.append(row("b", math.nan, verdict="missed", reason="there is no value"))
    rows.append(row("c", value=None, verdict="not judged", reason="no number is stated"))
    text = "\n".join(shown(show_values, "Published values", by_source(rows)))
    assert text.count("departs: the fit is coarse (a)") == 1
    assert "missed: there is no value (b)" in text
    assert re.search(r"c +in words", text)


def test_the_summary_names_what_went_wrong():
    verdicts = [Verdict("spacing", "", "fail"), Verdict("comfort", "", "pass"), Verdict("late", "", "inconclusive")]
    rows = [row("a"), row("b", verdict="missed"), row("c", verdict="not judged")]
    assert summary(verdicts, rows) == [
        ("1 of 3 requirements pass; fail: spacing; 1 inconclusive", True),
        ("1 of 3 stated values reproduced; missed: b; 1 not judged", True),
    ]
    assert summary([], [row()]) == [("1 of 1 stated values reproduced", False)]


def test_the_summary_counts_each_origin_apart():
    rows = [
        row("a"),
        row("b", origin="fitted", verdict="departs", reason="the fit is coarse"),
        row("c", origin="fitted", verdict="departs no more"),
        row("d", origin="misprint", verdict="not judged"),
        row("e", origin="reference"),
    ]
    assert summary([], rows) == [
        ("1 of 1 stated values reproduced", False),
        ("0 of 2 fitted values reproduced; departs no more: c; 1 departs as known", True),
        ("1 misprint, never judged", False),
        ("1 of 1 reference values (our own) reproduced", False),
    ]
    assert in_one_line(rows) == (
        "reproduced: stated 1 of 1, fitted 0 of 2 (1 departs, 1 departs no more), misprint 0 of 1 (1 not judged), "
        "reference 1 of 1"
    )


def test_a_changed_run_says_once_why_nothing_is_judged():
    why = {"verdict": "not judged", "reason": "the scenario was modified"}
    rows = [row("a", **why), row("b", origin="reference", **why), row("c", origin="reference", **why)]
    line = "3 known values (1 stated, 2 reference) not judged, because the scenario was modified"
    assert summary([], rows) == [(line, False)]


def test_numbers_take_prefixes_and_what_is_true_or_false_is_said_in_words(shown):
    rows = [
        row("energy", 71403300.0, value=71388000.0, tolerance=18000.0, unit="J"),
        row("order", 1.0, value=1.0, tolerance=0.0, unit="", judges_truth=True),
    ]
    lines = shown(show_values, "Published values", by_source(rows))
    assert any(re.fullmatch(r"energy +71\.388 +71\.4033 +0\.018 +MJ +reproduced", line) for line in lines)
    assert any(re.fullmatch(r"order +true +true +reproduced", line) for line in lines)
