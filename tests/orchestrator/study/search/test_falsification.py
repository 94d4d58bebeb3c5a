"""The search itself, over functions whose broken part is known."""

import math

import pytest
from railcosim.orchestrator.study.search.falsification import search


@pytest.mark.parametrize("method", ["random", "cma-es", "tpe"])
def test_what_can_be_broken_is_found_and_made_small(searched, method):
    space, evaluations, _ = searched(lambda x: 0.7 - float(x[0]))
    told = []
    found = search(space, evaluations, "held", budget=300, method=method, seed=3, told=lambda *what: told.append(what))
    assert found.found
    assert found.nearest.breaks("held")
    assert found.runs == len(told) <= 300
    assert told[-1] == (found.runs, 300, found.nearest.margins["held"])
    assert list(found.changes) == ["it.x0"]
    assert 0.7 < found.changes["it.x0"] < 0.7 + 0.3 / 100
    assert found.shrinking == len(evaluations.done) - found.runs
    assert found.failed == 0


def test_what_holds_is_told_with_the_least_margin(searched):
    space, evaluations, ran = searched(lambda x: 1.0 + float(x[0]))
    found = search(space, evaluations, "held", budget=20, method="random")
    assert not found.found
    assert (found.runs, found.shrinking, found.changes) == (20, 0, {})
    assert found.nearest.margins["held"] == 1.0 + min(changes.get("it.x0", 0.5) for changes in ran)


def test_a_scenario_that_breaks_by_itself_needs_no_search(searched):
    space, evaluations, ran = searched(lambda _: -1.0)
    found = search(space, evaluations, "held", budget=20)
    assert (found.found, found.runs, found.changes) == (True, 1, {})
    assert ran == [{}]


def test_failed_runs_are_counted_and_told_once(searched):
    def margin(x):
        if x[0] > 0.6:
            raise ArithmeticError("too far")
        return 1.0

    space, evaluations, _ = searched(margin)
    found = search(space, evaluations, "held", budget=40, method="cma-es")
    assert not found.found
    assert 0 < found.failed < 40
    assert found.errors == ("too far",)


def test_without_a_single_run_there_is_no_least_margin(searched):
    def margin(_):
        raise ArithmeticError("never")

    space, evaluations, _ = searched(margin)
    found = search(space, evaluations, "held", budget=5, method="tpe")
    assert found.nearest is None
    assert found.failed == 5


def test_a_search_that_is_gone_on_with_ends_as_if_it_had_not_been_interrupted(searched):
    def margin(x):
        return 0.99 - float(x.max())

    space, evaluations, _ = searched(margin)
    search(space, evaluations, "held", budget=7, method="tpe", seed=5)
    evaluations._dataset.flush()
    space, resumed, ran = searched(margin, resumed=True)
    once = search(space, resumed, "held", budget=60, method="tpe", seed=5)
    resumed._dataset.flush()
    assert len(ran) == len(resumed.done) - 7
    assert all(changes not in [one.changes for one in evaluations.done] for changes in ran)
    assert math.isfinite(once.nearest.margins["held"])
    space, afresh, _ = searched(margin)
    whole = search(space, afresh, "held", budget=60, method="tpe", seed=5)
    assert (whole.runs, whole.changes, whole.nearest.changes) == (once.runs, once.changes, once.nearest.changes)
