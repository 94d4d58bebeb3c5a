"""The runs of a search: each written down, and none run twice."""

import math

import pytest
from railcosim.orchestrator.study.search.evaluations import Evaluation


def test_a_score_is_the_scaled_margin_where_there_is_one():
    both = Evaluation(0, {}, "completed", margins={"a": 4.0}, robustness={"a": 0.5}, verdicts={"a": "pass"})
    assert both.score("a") == 0.5
    assert Evaluation(0, {}, "completed", margins={"a": 4.0}).score("a") == 4.0
    assert math.isnan(Evaluation(0, {}, "failed").score("a"))


def test_a_condition_without_a_measure_counts_one():
    unknown = {"a": math.nan}
    assert Evaluation(0, {}, "completed", margins=unknown, verdicts={"a": "pass"}).score("a") == 1.0
    assert Evaluation(0, {}, "completed", margins=unknown, verdicts={"a": "fail"}).score("a") == -1.0


def test_what_was_run_is_known(searched):
    _, evaluations, ran = searched(lambda x: float(x[0] - 0.25))
    many = [{"it.x0": 0.5}, {"it.x0": 0.125}, {"it.x0": 0.5}]
    found = list(evaluations.run(many)) + list(evaluations.run([{"it.x0": 0.125}]))
    assert [one.run for one in found] == [0, 1, 0, 1]
    assert [one.breaks("held") for one in found] == [False, True, False, True]
    assert ran == many[:2]
    assert [one.run for one in evaluations.done] == [0, 1]


def test_runs_are_asked_for_one_by_one(searched):
    _, evaluations, ran = searched(lambda _: 1.0)
    next(evaluations.run([{"it.x0": 0.1}, {"it.x0": 0.2}]))
    assert len(ran) == 1


def test_a_search_that_is_gone_on_with_knows_its_runs(searched):
    def margin(x):
        if x[0] > 0.9:
            raise ArithmeticError("too far")
        return float(x[0])

    many = [{}, {"it.x0": 1 / 3, "it.x1": 0.1}, {"it.x0": 0.95}]
    _, evaluations, _ = searched(margin)
    before = list(evaluations.run(many))
    evaluations._dataset.flush()
    _, resumed, ran = searched(margin, resumed=True)
    again = list(resumed.run([*many, {"it.x1": 0.2}]))
    assert ran == [{"it.x1": 0.2}]
    assert [one.run for one in again] == [0, 1, 2, 3]
    assert again[1].margins == before[1].margins == {"held": 1 / 3}
    assert again[1].metrics == {"value": 1 / 3}
    assert again[2].failed
    assert again[2].error == "too far"


def test_a_search_begun_anew_forgets_what_was_there(searched):
    _, evaluations, _ = searched(lambda _: 1.0)
    list(evaluations.run([{}]))
    evaluations._dataset.flush()
    _, _, ran = searched(lambda _: 1.0)
    _, fresh, ran = searched(lambda _: 1.0)
    list(fresh.run([{}]))
    assert ran == [{}]


@pytest.mark.parametrize("value", [3, 3.0])
def test_whole_numbers_are_the_same_however_they_are_kept(searched, value):
    _, evaluations, ran = searched(lambda _: 1.0)
    list(evaluations.run([{"it.x0": 3}, {"it.x0": value}]))
    assert len(ran) == 1
