"""The runs of a search: each written down, and none run twice."""

import math

import pytest
from railcosim.orchestrator.study.campaign import Dataset
from railcosim.orchestrator.study.rows import Row
from railcosim.orchestrator.study.search.evaluations import Evaluation, Evaluations


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


def test_what_is_asked_for_twice_at_once_is_run_once(searched):
    _, evaluations, ran = searched(lambda x: float(x[0]))
    found = evaluations.run([{"it.x0": 0.25}, {"it.x0": 0.25}, {"it.x0": 0.5}])
    assert [one.margins["held"] for one in found] == [0.25, 0.25, 0.5]
    assert len(ran) == 2


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


@pytest.fixture
def backwards(tmp_path):
    """Runs of which the last comes first, and what was asked for; a group is cut short after some."""

    def build(cut=None, **kept):
        def evaluate(points):
            asked.append([number for number, _ in points])
            for number, changes in [*reversed(points)][:cut]:
                yield (number, changes), Row("completed", margins={"held": changes["x"]})

        asked = []
        return Evaluations(evaluate, Dataset(tmp_path, ["x"], ["held"], 0), **kept), asked

    return build


MANY = [{"x": 0.5}, {"x": 0.25}, {"x": 0.75}, {"x": 1.0}]


def test_runs_are_told_and_numbered_as_they_were_asked_for(backwards):
    evaluations, asked = backwards()
    found = list(evaluations.run(MANY))
    assert [(one.run, one.changes["x"], one.margins["held"]) for one in found] == [
        (0, 0.5, 0.5),
        (1, 0.25, 0.25),
        (2, 0.75, 0.75),
        (3, 1.0, 1.0),
    ]
    assert asked == [[0, 1, 2, 3]]


def test_what_came_before_its_turn_is_forgotten_where_no_more_is_wanted(backwards):
    evaluations, asked = backwards()
    group = evaluations.run(MANY)
    next(group)
    group.close()
    (after,) = evaluations.run([{"x": 2.0}])
    assert after.run == 1
    assert [one.run for one in evaluations.done] == [0, 1]
    assert asked == [[0, 1, 2, 3], [1]]


def test_what_came_before_its_turn_is_kept_where_runs_are_cut_short(backwards):
    evaluations, _ = backwards(cut=2)
    with pytest.raises(KeyboardInterrupt):
        next(evaluations.run(MANY))
    evaluations._dataset.flush()
    resumed, asked = backwards(resumed=True)
    assert [one.run for one in resumed.run(MANY)] == [0, 1, 2, 3]
    assert asked == [[0, 1]]
    (after,) = resumed.run([{"x": 2.0}])
    assert after.run == 4
