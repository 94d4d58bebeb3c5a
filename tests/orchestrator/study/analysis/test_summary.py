"""What is said of a study, of which every number is known."""

import math

import pytest
from railcosim.orchestrator.study.analysis import summarize

GRID = {"a.x": "0:9:10", "b": ["P", "Q"]}
OUTPUTS = {
    "margin.gap": lambda x, b: x - 2.5,
    "metric.end": lambda x, b: 2 * x,
    "metric.never": lambda x, b: x / (x > 1),
}


@pytest.mark.filterwarnings("ignore:divide by zero|invalid value")
def test_a_summary(studied):
    frame, plan = studied(GRID, OUTPUTS, 20, "grid", failed=(3, 8))
    said = summarize(frame, plan)
    assert (said.runs, said.statuses) == (20, {"completed": 18, "failed": 2})
    assert said.broken == ((3, "error of 3"), (8, "error of 8"))
    (gap,) = said.requirements
    assert (gap.name, gap.passed, gap.failed, gap.unjudged) == ("gap", 13, 5, 2)
    assert gap.rate.value == 13 / 18
    assert math.isnan(gap.rate.low)
    assert gap.failing == (0, 1, 2, 4, 5)
    assert (gap.margin.least, gap.margin.least_run) == (-2.5, 0)
    assert (gap.margin.largest, gap.margin.largest_run, gap.margin.missing) == (6.5, 18, 2)
    end, never = said.metrics
    assert (end.name, end.count, end.missing) == ("end", 18, 2)
    assert end.mean.value == pytest.approx(2 * (90 - 1 - 4) / 18)
    assert [q.value for q in end.quantiles] == [0, 10, 18]
    assert (never.mean.value != never.mean.value, never.largest, never.missing) == (True, math.inf, 4)
    assert said.note == "A grid is no sample: shares are those of its points, and have no intervals."


@pytest.mark.parametrize(
    ("design", "count", "same_as", "note"),
    [
        ("random", 80, 80, "Brackets are 90% confidence intervals."),
        ("sobol", 64, 64, "; those of independent runs, to which 'sobol' is no worse."),
        ("saltelli", 80, 40, ", in which each block of 4 runs counts for 2 that are independent."),
    ],
)
def test_intervals_know_how_many_runs_are_independent(studied, design, count, same_as, note):
    vary = {"a.x": "0:1", "a.y": "0:1"}
    frame, plan = studied(vary, {"margin.m": lambda x, y: x - 0.3, "metric.v": lambda x, y: x}, count, design)
    said = summarize(frame, plan, level=0.9)
    (kept,), (spread,) = said.requirements, said.metrics
    z, p = 1.6448536269514722, kept.passed / count
    width = 2 * z * math.sqrt(p * (1 - p) / same_as + z * z / 4 / same_as**2) / (1 + z * z / same_as)
    assert kept.rate.high - kept.rate.low == pytest.approx(width)
    assert said.note.endswith(note)
    assert spread.mean.low < spread.mean.value < spread.mean.high
    assert spread.quantiles[1].low < spread.quantiles[1].value < spread.quantiles[1].high


def test_nothing_is_known_of_runs_that_all_failed(studied):
    frame, plan = studied({"a.x": "0:1"}, {"margin.m": lambda x: x}, 3, failed=(0, 1, 2))
    (kept,) = summarize(frame.drop(columns="margin.m"), plan).requirements
    assert (kept.passed, kept.failed, kept.unjudged, kept.margin.count) == (0, 0, 3, 0)
    assert math.isnan(kept.rate.value)
    one, plan = studied({"a.x": "0:1"}, {"metric.m": lambda x: x}, 1)
    (spread,) = summarize(one, plan).metrics
    assert (spread.count, math.isnan(spread.sd), math.isnan(spread.mean.low)) == (1, True, True)
