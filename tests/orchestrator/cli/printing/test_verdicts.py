"""Verdicts as tables, and in a line."""

import math
import re

import pytest
from railcosim.orchestrator.cli.printing.verdicts import by_source, show_published, show_requirements, summary
from railcosim.orchestrator.evaluation import PublishedRow, Verdict


def row(metric="gap", measured=17.25, *, published=17.0, verdict="reproduced", reason="", claim="", where="Table 2"):
    return PublishedRow(metric, None, claim, None, published, measured, 0.5, "km", where, "stated", verdict, reason)


def test_a_requirement_shows_verdict_margin_and_the_worst_place(shown):
    verdicts = [
        Verdict("spacing", "always a <\n    b", "fail", margin=-759.0, time=140.2, index=4),
        Verdict("later", "always c until 9", "inconclusive", reason="the window is not covered"),
    ]
    lines = shown(show_requirements, verdicts)
    assert any(re.fullmatch(r"spacing +fail +-759 +140\.2 s, i = 4 +always a < b", line) for line in lines)
    assert "because: the window is not covered (later)" in lines
    assert "Requirements are judged at the recorded points." in lines


@pytest.mark.parametrize("width", [160, 80, 70])
def test_published_values_fold_the_claim_and_nothing_else(shown, width):
    claim = "with the comfort layer train 4 accelerates with about 1 m/s2 in the first half minute of the run"
    groups = by_source([row(claim=claim), row("speed"), row("time", where="Fig. 5")])
    lines = shown(show_published, groups, width=width)
    assert lines[1] == "Published values"
    assert any(re.fullmatch(r"gap: ?.* 17 +17\.25 +0\.5 +km +reproduced", line) for line in lines)
    assert any(re.fullmatch(r"speed +17 +17\.25 +0\.5 +km +reproduced", line) for line in lines)
    assert lines.index("stated: Table 2") < lines.index("stated: Fig. 5")
    assert len(lines) <= (9 if width == 160 else 14)


def test_why_a_value_is_not_judged_or_missed_is_said_once(shown):
    rows = [row("a", verdict="not judged", reason="the scenario was modified") for _ in range(3)]
    rows.append(row("b", math.nan, verdict="missed", reason="there is no value"))
    rows.append(row("c", published=None, verdict="not judged", reason="no number is stated"))
    text = "\n".join(shown(show_published, by_source(rows)))
    assert text.count("the scenario was modified") == 1
    assert "missed: there is no value (b)" in text
    assert re.search(r"c +in words", text)


def test_the_summary_names_what_went_wrong():
    verdicts = [Verdict("spacing", "", "fail"), Verdict("comfort", "", "pass"), Verdict("late", "", "inconclusive")]
    rows = [row("a"), row("b", verdict="missed"), row("c", verdict="not judged")]
    assert summary(verdicts, rows) == [
        ("1 of 3 requirements pass; fail: spacing; 1 inconclusive", True),
        ("1 of 3 published values reproduced; missed: b; 1 not judged", True),
    ]
    assert summary([], [row()]) == [("1 of 1 published values reproduced", False)]
