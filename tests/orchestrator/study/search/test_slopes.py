"""The gradient of a margin in the cube: that of runs, by central differences."""

import sys

import numpy as np
import pytest
from railcosim.orchestrator import System
from railcosim.orchestrator.errors import ScenarioError
from railcosim.orchestrator.study.batch import Batch
from railcosim.orchestrator.study.design import Dimension
from railcosim.orchestrator.study.search.slopes import Slopes
from railcosim.orchestrator.study.search.space import Space

REQUIREMENTS = {
    "low": "always lag.x <= 1.5",
    "square": "eventually lag.x * target.value >= 2.0 from 0.5",
    "own": "always lag.x <= 3.0 * lag.gain - 0.1 * lag.rate",
    "late": "always at_sample(lag.x) <= 1.5",
    "logic": "always (eventually[0, 0.5] lag.x >= 0.9) and not (echo.y > 2.0)",
    "unlike": "always mass.x <= 6.0 and mass.v <= 3.0",  # 0.6 m/s are left, and 2.6 m, which is a smaller part
    "true": "always not level.on",
}
VARIED = ("lag.rate=1:6", "target.values=uniform(0.5, 1.5)", "lag.gain=normal(1, 0.2)", "lag.x=0.2:0.8")


@pytest.fixture
def system(mine):
    """A lag after a schedule, and its echo."""
    made = System(stop_time=2.0, step=0.1, requirements=REQUIREMENTS)
    made.add("target", "Schedule", {"points": 1}, values=1.0)
    made.add("lag", mine("Lag"), rate=5.0, gain=1.0)
    made.add("echo", mine("Sampled"))
    made.add("level", mine("Level"))
    made.add("mass", mine("Mass"))
    made.connect("target.value", "mass.a", scale=1.0)
    made.connect("lag.x", "level.u")
    made.connect("target.value", "lag.u")
    made.connect("lag.x", "echo.u")
    return made


@pytest.mark.parametrize("requirement", ["low", "square", "own", "late", "logic", "unlike"])
def test_the_gradient_of_a_margin_is_that_of_runs(system, requirement):
    """Central differences of runs agree to 1e-5 of the largest."""
    space, point, step = Space(tuple(map(Dimension.parse, VARIED)), (), {}), np.array([0.3, 0.7, 0.6, 0.4]), 1e-4
    with Batch(system, kind="plain") as batch:
        found = Slopes(batch.checked, space).at(requirement, point)
        ends = [[batch.run(space.changes(point + by * axis)) for by in (step, -step)] for axis in np.eye(4)]
    wanted = [(high.scaled[requirement] - low.scaled[requirement]) / (2.0 * step) for high, low in ends]
    assert found == pytest.approx(np.array(wanted), abs=1e-5 * np.abs(wanted).max())
    assert np.abs(found).max() > 0.01


def test_a_requirement_may_speak_of_what_a_model_was_swapped_for(system, mine):
    """The new lag has no gain; the requirement is about the old one's."""
    system.instances["lag"].model, system.instances["lag"].swapped = mine("LagWithSlope"), True
    with Batch(system, kind="plain") as batch:
        space = Space((Dimension.parse("lag.rate=1:6"),), (), {})
        found = Slopes(batch.checked, space).at("own", np.array([0.5]))
    assert found == pytest.approx([-0.5])  # the margin falls by a tenth of the rate, whose range is five


def test_what_has_no_order_and_a_truth_have_none(system, mine):
    space = Space((Dimension.parse("lag.rate=1:6"), Dimension.parse(f"lag={mine('Lag')},{mine('Resting')}")), (), {})
    with Batch(system, kind="plain") as batch:

        def checked(changes):
            return batch.checked({key: value for key, value in changes.items() if key != "lag"})

        slopes = Slopes(checked, space)
        assert slopes.at("low", np.array([0.3, 0.7]))[1] == 0.0
        assert not slopes.at("true", np.array([0.3, 0.7])).any()


def test_without_casadi_there_is_none(system, monkeypatch):
    monkeypatch.setitem(sys.modules, "railcosim.orchestrator.study.search.traced", None)
    with (
        Batch(system, kind="plain") as batch,
        pytest.raises(ScenarioError, match="casadi is not installed; pip install 'railcosim\\[native\\]'"),
    ):
        Slopes(batch.checked, Space((Dimension.parse("lag.rate=1:6"),), (), {})).at("low", np.array([0.3]))
