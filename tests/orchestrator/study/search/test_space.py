"""All that is varied as one cube."""

import numpy as np
import pytest
from railcosim.orchestrator import System
from railcosim.orchestrator.errors import ScenarioError
from railcosim.orchestrator.run import execute
from railcosim.orchestrator.study.search.space import make_space, read_space
from railcosim.orchestrator.system import Event


def space_of(system, *texts):
    nominal = execute(system, kind="plain")
    return make_space(system, nominal.checked, nominal.results, *read_space(texts))[1]


def test_a_point_of_the_cube_is_a_set_of_changes(lagging):
    space = space_of(lagging(), "lag.rate=2:6", "lag=A,B", "target.value=signal(0, 2, 2)", "simulation.seed=1:4")
    assert space.keys == ["lag.rate", "lag", "simulation.seed", "target.values[1]", "target.values[2]"]
    assert space.choices == [0, 2, 0, 0, 0]
    changes = space.changes(np.array([0.25, 0.9, 0.0, 0.5, 1.0]))
    assert changes == {
        "lag.rate": 3.0,
        "lag": "B",
        "simulation.seed": 1,
        "target.values[1]": 1.0,
        "target.values[2]": 2.0,
    }


def test_the_origin_is_the_scenario_as_it_stands(lagging):
    space = space_of(lagging(seed=3), "lag.rate=2:10", "lag=A,B", "target.value=signal(0, 4, 2)", "simulation.seed=1:4")
    assert space.nominal["simulation.seed"] == 3.0
    assert space.origin()[[0, 1, 3, 4]].tolist() == pytest.approx([0.375, 0.5, 0.25, 0.25])
    assert space.changes(space.origin())["simulation.seed"] == 3


def test_a_distribution_without_an_end_is_cut_where_it_is_rare(lagging):
    space = space_of(lagging(), "lag.rate=normal(5, 1)")
    ends = [space.changes(np.array([share]))["lag.rate"] for share in (0.0, 1.0)]
    assert ends == pytest.approx([5 - 3.0902, 5 + 3.0902], abs=1e-4)


def test_nominal_is_what_all_have_in_common(mine):
    system = System(stop_time=1.0, step=0.5, events=[Event("lag[1].u", "set", 0.5, 1.0)])
    for k, rate in ((1, 2.0), (2, 3.0)):
        system.add(f"lag[{k}]", mine("Lag"), rate=rate, gain=1.5)
    texts = ["lag.rate=1:2", "lag[2].rate=1:2", "lag.gain=1:2", "events[1].at=0:1", "events[2].at=0:1"]
    nominal = space_of(system, *texts, "simulation.step=0.25,0.5").nominal
    assert nominal == {"lag[2].rate": 3.0, "lag.gain": 1.5, "events[1].at": 0.5, "simulation.step": 0.5}


def test_a_start_value_is_nominal_too(mine):
    system = System(stop_time=1.0, step=0.5)
    system.add("train", "PointMassTrain", force=0.0, position=7.0)
    assert space_of(system, "train.position=0:10", "train.position_start=0:10").nominal == {
        "train.position": 7.0,
        "train.position_start": 7.0,
    }


def test_a_rate_limit_holds_for_values_left_as_they_were(lagging):
    space = space_of(lagging(), "target.value=signal(0, 4, 2, rate=1)")
    assert space.allows({"target.values[2]": 2.0})
    assert not space.allows({"target.values[2]": 2.1})


def test_all_that_cannot_be_read_is_told_at_once():
    with pytest.raises(ScenarioError) as caught:
        read_space(["a.b=signal(1)", "c", "d.e=1:2", "d.e=2:3", "f.g=signal(0, 1, 2)", "f.g=1:2"])
    assert [problem.place for problem in caught.value.problems] == [
        "--vary a.b=signal(1)",
        "--vary c",
        "--vary d.e",
        "--vary f.g",
    ]
    with pytest.raises(ScenarioError, match="nothing is varied"):
        read_space([])
