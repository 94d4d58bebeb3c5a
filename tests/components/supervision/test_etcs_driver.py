"""The driver who keeps the permitted speed."""

import pytest
from railcosim.components import EtcsDriver


@pytest.mark.parametrize(
    ("speed", "permitted", "demanded", "expected"),
    [
        (10.0, 30.0, 5e4, 5e4),  # the controller's, far below
        (10.0, 30.0, 1e9, 100e3 * (0.8 + 0.02)),  # nobody else: the largest acceleration, and the slope
        (29.0, 30.0, 1e9, 100e3 * (0.5 * 0.4 + 0.02)),
        (30.0, 30.0, 5e4, 100e3 * (-0.5 * 0.6 + 0.02)),
        (30.0, 10.0, 5e4, 100e3 * (-0.9 + 0.02)),
        (30.0, 10.0, -2e5, -2e5),  # a controller that brakes harder
    ],
)
def test_force(speed, permitted, demanded, expected):
    driver = EtcsDriver(
        speed=speed, permitted_speed=permitted, demanded_force=demanded, line_resistance=0.02, mass=100e3
    )
    assert driver.outputs()["force"] == pytest.approx(expected)
