"""Whether a step is fine enough: by hand, and on a run."""

import json
import math
from dataclasses import replace

import pytest
from railcosim.orchestrator import System
from railcosim.orchestrator.evaluation import ComparedValue, Metric, Verdict
from railcosim.orchestrator.run import Run, add_step_check, at_half_the_step, check_step, execute


def ended(values, requirements=(), references=(), step=0.1):
    metrics = [Metric(name, "", {None: value}, unit) for name, (value, unit) in values.items()]
    system = System(stop_time=1.0, step=step)
    made = [Verdict(name, "", word) for name, word in requirements]
    return Run(system, None, "completed", None, metrics=metrics, requirements=made, references=list(references))


def known(metric, tolerance):
    return ComparedValue(metric, None, "", None, 1.0, 1.0, tolerance, "m", "", "reference", "reproduced")


@pytest.mark.parametrize(
    ("before", "after", "verdict"),
    [
        ((100.0, "m"), (100.9, "m"), "fine"),  # 1 % of itself
        ((100.0, "m"), (101.1, "m"), "too coarse"),
        ((0.0, "m"), (1e-9, "m"), "too coarse"),  # nothing of that unit is larger
        ((5.0, "s"), (5.1, "s"), "fine"),  # one recorded point
        ((5.0, "s"), (5.2, "s"), "too coarse"),
        ((math.inf, "s"), (math.inf, "s"), "fine"),
        ((math.inf, "s"), (80.0, "s"), "too coarse"),
        ((math.nan, "m"), (math.nan, "m"), "fine"),
        ((1.0, "m"), (math.nan, "m"), "too coarse"),
        ((1.0, ""), (0.0, ""), "too coarse"),  # true, false
    ],
)
def test_what_may_change(before, after, verdict):
    assert check_step(ended({"x": before}), ended({"x": after})).verdict == verdict


def test_small_values_beside_large_ones_of_their_unit():
    found = check_step(
        ended({"speed": (80.0, "m/s"), "error": (0.001, "m/s")}),
        ended({"speed": (80.0, "m/s"), "error": (0.05, "m/s")}),
    )
    assert found.verdict == "fine"
    assert [(c.name, c.allowed) for c in found.changes] == [("error", 0.08), ("speed", pytest.approx(0.8))]


def test_a_known_value_may_change_by_its_tolerance():
    before, after = {"x": (100.0, "m")}, {"x": (101.5, "m")}
    assert check_step(ended(before), ended(after)).verdict == "too coarse"
    assert check_step(ended(before, references=[known("x", 0.1), known("x", 1.6)]), ended(after)).verdict == "fine"
    tight = check_step(ended(before, references=[known("x", 1.2)]), ended(after))
    assert [(c.name, c.change, c.allowed) for c in tight.beyond] == [("x", 1.5, 1.2)]


def test_what_is_true_stays_true():
    before, after = (ended({"x": (value, "")}) for value in (1.0, 0.0))
    before.metrics = [replace(metric, truth=True) for metric in before.metrics]
    assert [change.allowed for change in check_step(before, after).beyond] == [0.0]
    assert check_step(before, ended({"x": (1.0, "")})).verdict == "fine"


def test_a_requirement_that_comes_out_differently():
    found = check_step(ended({}, [("a", "pass"), ("b", "pass")]), ended({}, [("a", "pass"), ("b", "fail")]))
    assert (found.verdict, found.requirements) == ("too coarse", ["b"])


def test_without_metrics_and_requirements_there_is_no_verdict():
    assert check_step(ended({}), ended({})).verdict == "not judged"
    assert check_step(ended({}, [("a", "pass")]), ended({}, [("a", "pass")])).verdict == "fine"


def test_a_run_says_so_in_its_record(tmp_path):
    system = System(stop_time=2.0, step=0.1, metrics={"way": "final(train.position)"})
    system.add("train", "PointMassTrain", speed=20.0, force=0.0)
    first = execute(system, kind="plain", output=tmp_path)
    add_step_check(tmp_path, check_step(first, execute(at_half_the_step(system), kind="plain")))
    record = json.loads((tmp_path / "run.json").read_text())
    assert (record["status"], record["step_check"]["verdict"], record["step_check"]["step"]) == (
        "completed",
        "fine",
        0.1,
    )
    (change,) = record["step_check"]["changes"]
    assert (change["metric"], change["unit"]) == ("way", "m")
    assert abs(change["change"]) < 1e-6
