"""The smallest change that still breaks: on functions whose smallest change is known."""

import numpy as np
import pytest
from railcosim.orchestrator.study.search.shrinking import shrink
from railcosim.orchestrator.study.search.signals import Placed, Signal
from railcosim.orchestrator.study.search.space import Space


@pytest.fixture
def smallest(searched):
    def find(breaks, changes, nominal, budget=200):
        space, _, _ = searched(lambda _: 0.0, nominal)
        runs = []

        def tried(given):
            runs.append(given)
            return breaks({**space.nominal, **given})

        return shrink(space, changes, tried, budget), runs

    return find


def test_what_does_not_matter_is_left_out(smallest):
    found, _ = smallest(lambda x: x["it.x1"] > 0.75, {"it.x0": 0.9, "it.x1": 1.0, "it.x2": 0.1}, (0.5, 0.5, 0.5))
    assert list(found) == ["it.x1"]
    assert 0.75 < found["it.x1"] < 0.75 + 0.5 / 64


def test_what_matters_together_stays_together(smallest):
    found, _ = smallest(lambda x: x["it.x0"] + x["it.x1"] > 1.5, {"it.x0": 1.0, "it.x1": 1.0}, (0.5, 0.5))
    assert set(found) == {"it.x0", "it.x1"}
    assert 1.5 < sum(found.values()) < 1.52


def test_one_change_remains_of_two_either_of_which_does(smallest):
    found, _ = smallest(lambda x: max(x["it.x0"], x["it.x1"]) > 0.7, {"it.x0": 1.0, "it.x1": 1.0}, (0.5, 0.5))
    assert len(found) == 1


def test_no_more_runs_are_spent_than_there_are(smallest):
    found, runs = smallest(lambda x: x["it.x0"] > 0.6, {"it.x0": 1.0, "it.x1": 1.0}, (0.5, 0.5), budget=3)
    assert len(runs) == 3
    assert found["it.x0"] > 0.6


def test_what_is_no_number_is_left_out_or_stays(smallest):
    """A model, or a whole number, is not halved."""
    found, runs = smallest(lambda x: x.get("it") == "B", {"it": "B", "it.x0": 1}, (0.5,))
    assert found == {"it": "B"}
    assert {type(given["it.x0"]) for given in runs if "it.x0" in given} <= {int}


def test_nothing_is_left_of_a_scenario_that_breaks_by_itself(smallest):
    assert smallest(lambda _: True, {}, (0.5,)) == ({}, [])
    found, _ = smallest(lambda _: True, {"it.x0": 1.0}, (0.5,))
    assert found == {}


def test_a_signal_is_left_out_as_a_whole_and_keeps_its_rate():
    """Of two signals one does not matter; of the other the second value does, which may differ from the first by 1."""
    signals = [Placed(Signal(f"{name}.value", 0.0, 4.0, 2), f"{name}.values", np.ones(2), 1.0) for name in "ab"]
    space = Space((), tuple(signals), {key: 1.0 for one in signals for key in one.keys})
    changes = {"a.values[1]": 2.0, "a.values[2]": 3.0, "b.values[1]": 2.0, "b.values[2]": 2.0}
    tried = []

    def breaks(given):
        tried.append(given)
        return given.get("a.values[2]", 1.0) > 2.5

    found = shrink(space, changes, breaks, 100)
    assert set(found) == {"a.values[1]", "a.values[2]"}
    assert all(space.allows(given) for given in tried)
    assert tried.index(next(x for x in tried if not any(key.startswith("b") for key in x))) <= 10
