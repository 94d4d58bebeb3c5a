"""Runs whose changes reach the structure of a scenario are single runs of it as it is loaded with them."""

import pytest
from railcosim.orchestrator.errors import ScenarioError
from railcosim.orchestrator.run import execute
from railcosim.orchestrator.scenario.loading import load
from railcosim.orchestrator.study import Runner

from .test_batch import agree


@pytest.mark.sample(2)
@pytest.mark.parametrize(
    ("changes", "loaded"),
    [
        ({"preset": "steep"}, {"preset": "steep"}),
        ({"preset": "steep", "lag.gain": 0.5}, {"preset": "steep", "settings": ["lag.gain=0.5"]}),
        ({"simulation.step": 0.05, "lag.rate": 0.3}, {"settings": ["simulation.step=0.05", "lag.rate=0.3"]}),
        ({"lag.count": 3, "lag.gain": [1.0, 2.0, 3.0]}, {"settings": ["lag.count=3", "lag.gain=[1, 2, 3]"]}),
    ],
)
def test_a_row_is_a_single_run(scenario, changes, loaded):
    run = execute(load(scenario, **loaded), kind="plain")
    with Runner(scenario, kind="plain", keep=1) as runner:
        for _ in range(2):
            agree(runner.run(changes), run)
            agree(runner.run(), execute(load(scenario), kind="plain"))


def test_models_are_swapped_and_settings_stay(scenario, mine):
    swap = mine("LagWithSlope")
    run = execute(load(scenario, swaps=[f"lag={swap}"], settings=["lag.rate=0.7"]), kind="plain")
    with Runner(scenario, kind="plain", settings=["lag.rate=0.7"]) as runner:
        agree(runner.run({"lag": swap}), run)


def test_structures_are_held_and_the_one_used_least_lately_goes(scenario):
    with Runner(scenario, kind="plain", keep=2) as runner:
        one, two = runner.batch({}), runner.batch({"preset": "steep"})
        assert runner.batch({}) is one
        runner.batch({"lag.count": 1})
        assert runner.batch({}) is one
        assert runner.batch({"preset": "steep"}) is not two


def test_a_structure_may_fit_the_values_alone_that_come_with_it(scenario):
    scenario.write_text(scenario.read_text().replace('start.rate = "0.5 * i"', "start.rate = [1.0, 2.0]"))
    changes = {"lag.count": 3, "lag.rate": [1.0, 2.0, 4.0]}
    with Runner(scenario, kind="plain") as runner:
        agree(
            runner.run(changes), execute(load(scenario, settings=["lag.count=3", "lag.rate=[1, 2, 4]"]), kind="plain")
        )
        row = runner.run({"lag.count": 3})
        assert [runner.checked(changes).wiring.starts[f"lag[{i}]"]["rate"] for i in (1, 2, 3)] == [1.0, 2.0, 4.0]
        assert runner.checked({"lag[1].rate": 5.0}).wiring.starts["lag[1]"]["rate"] == 5.0
        with pytest.raises(ScenarioError, match="rate"):
            runner.checked({"lag.count": 3})
    with pytest.raises(ScenarioError) as caught:
        load(scenario, settings=["lag.count=3"])
    assert (row.status, row.error) == ("refused", str(caught.value))
