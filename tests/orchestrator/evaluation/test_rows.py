"""Values for several i at once are those of each i alone, which is written out here: `train[2]` for `train[i]`."""

import re

import numpy as np
import pytest
from railcosim.orchestrator.evaluation import Judge, Part

TIMES = np.arange(31) * 0.5
_RNG = np.random.default_rng(3)
COLUMNS = {f"train[{k}].{name}": _RNG.normal(size=31).cumsum() for name in ("speed", "force") for k in (1, 2, 3)}
PARAMETERS = {"limit.time": 4.0, **{f"train[{k}].arrival": 3.0 + (k == 3) for k in (1, 2, 3)}, "train[1].mass": 2.0}


class Run:
    """Of arrays."""

    step, completed, units, parameters, points = 0.5, True, {}, PARAMETERS, 31

    def __init__(self, time=TIMES, **changed):
        self.time, self.stop_time, self.columns = time, float(time[-1]), {**COLUMNS, **changed}

    def names(self):
        return self.columns.keys()

    def part(self, first, last):
        return {name: values[first:last] for name, values in {"time": self.time, **self.columns}.items()}

    def __getitem__(self, name):
        return self.columns[name]


TEXTS = [
    "max(train[i].speed)",
    "max(train[i].speed) + min(train[i].speed) * i",
    "rms(train[i].speed, until = limit.time) > 1 and not peak(train[i].force) > 2.5",
    "jerk(train[i].speed - 2 * train[1].speed, outside = [[1, 2], [limit.time, 7]])",
    "mean_jerk(train[i].speed, 1.0) - peak(train[:].speed)",
    "traction_energy(train[i].force, train[i].speed)",
    "max(abs(train[i].speed - mean(train[i].speed)))",
    "at(train[i].speed, train[i].arrival)",
    "final(train[i].speed, until = train[i].arrival)",
    "amplification(train[i].speed, train[1].speed)",
    "max(at_sample(train[i].speed) if train[i].force > 0 else i)",
    "spread(train[:i].speed)",
    "initial(train[i].speed if i > 1 else 0) + train[1].mass",
]


def judged(metrics, run, requirements=()):
    return Judge(metrics, dict(requirements), [*COLUMNS, *PARAMETERS], PARAMETERS)


@pytest.mark.parametrize("text", TEXTS)
def test_a_metric_of_several_is_that_of_each(text):
    (together,) = judged({"m": text}, run := Run()).metrics(run)
    alone = [judged({"m": re.sub(r"\bi\b", str(k), text)}, run).metrics(run)[0] for k in (1, 2, 3)]
    assert [x.problem for x in alone] == [""] * 3
    assert not together.problem
    assert list(together.values.values())[:3] == [one.values[None] for one in alone]
    assert together.truth == alone[-1].truth


def test_a_value_that_is_missing_is_said_of_its_own_i():
    run = Run(**{"train[2].speed": np.full(31, np.nan)})
    (metric,) = judged({"m": "max(train[i].speed) > 0"}, run).metrics(run)
    assert np.isnan(metric.values[2])
    assert metric.truth
    assert [metric.values[k] for k in (1, 3)] == [COLUMNS[f"train[{k}].speed"].max() > 0 for k in (1, 3)]
    late = judged({"m": "max(train[i].speed, until = 3.0 if i < 3 else 50.0)"}, Run())
    (metric,) = late.metrics(Run())
    assert list(metric.values) == [1, 2, 3]
    assert np.isnan(metric.values[3])
    assert "until 50 s" in metric.problem
    assert metric.values[1] == COLUMNS["train[1].speed"][:7].max()


@pytest.mark.parametrize(
    "bound", ["max(train[i].speed)", "at(train[1].speed, train[i].arrival)", "peak(train[:].speed)"]
)
def test_a_requirement_may_compare_with_a_number_of_each(bound):
    run = Run()
    (verdict,) = judged({}, run, {"r": f"always train[i].speed <= {bound}"}.items()).verdicts(run)
    speeds = np.array([COLUMNS[f"train[{k}].speed"] for k in (1, 2, 3)])
    found = {
        "max": speeds.max(axis=1, keepdims=True),
        "at(": speeds[0, [6, 6, 8], np.newaxis],
        "pea": np.abs(speeds).max(),
    }
    slack = found[bound[:3]] - speeds
    assert verdict.margin == slack.min()
    assert verdict.index == 1 + slack.argmin() // 31


def test_what_counts_in_a_run_is_not_taken_from_one_with_other_times():
    judge = judged(
        {"m": "max(train[i].speed, after = 10)"}, None, {"r": "always train[i].speed < 1 outside [0, 10]"}.items()
    )
    for run, first in ((Run(), 20), (Run(TIMES * 2.0), 10), (Run(), 20)):
        (metric,), (verdict,) = judge.metrics(run), judge.verdicts(run)
        speeds = np.array([COLUMNS[f"train[{k}].speed"] for k in (1, 2, 3)])
        assert list(metric.values.values()) == speeds[:, first:].max(axis=1).tolist()
        assert verdict.margin == (1.0 - speeds[:, first + 1 :]).min()


def test_metrics_and_requirements_share_a_run_that_was_prepared():
    judge, run = judged({"m": "max(train[i].speed)"}, None, {"r": "always train[i].speed < 1"}.items()), Run()
    prepared = judge.prepared(run)
    assert judge.prepared(prepared) is prepared
    assert judged({}, run).prepared(prepared) is not prepared
    assert judge.values(prepared) == judge.values(run)
    assert judge.verdicts(prepared) == judge.verdicts(run)
    assert Part(run, run.part(0, 9), 0, beyond=2).own_time.size == 7
