"""The force distribution as a component of its own; its formula is tested with the vehicles."""

import pytest
from railcosim.components import ForceDistribution, SubwayTrain


@pytest.mark.parametrize("force", [100e3, -100e3])
def test_it_shares_as_the_train_does(force):
    out = ForceDistribution(force=force).outputs()
    assert out["vehicle_force"] == pytest.approx(SubwayTrain(force=force).outputs()["vehicle_force"], rel=1e-12)
    assert sum(out["effective_force"]) == pytest.approx(force, rel=1e-12)


def test_a_dear_vehicle_does_less():
    cheap = ForceDistribution(force=60e3).outputs()["vehicle_force"]
    dear = ForceDistribution(force=60e3, cost=[0.1, 0.1, 0.1, 0.1, 10.0, 0.1]).outputs()["vehicle_force"]
    assert dear[4] < 0.1 * cheap[4]
    assert dear[1] > cheap[1]


def test_any_vehicles():
    rows = [{"mass": 4e4, "weight": 1.0, "motored": k == 0} for k in range(3)]
    assert ForceDistribution(vehicles=3, consist=rows, force=9e3).outputs()["vehicle_force"] == [9e3, 0.0, 0.0]
    assert ForceDistribution(vehicles=3, consist=rows, force=-9e3).outputs()["vehicle_force"] == pytest.approx(
        [-3e3] * 3
    )
