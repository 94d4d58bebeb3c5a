"""The line's resistance by hand: g (gradient + 0.6/R) + resistance, constant in each section."""

import pytest
from railcosim.components import ComponentError, Line

PROFILE = [
    {"position": 0.0},
    {"position": 1e3, "gradient": 0.01},
    {"position": 2e3, "gradient": -0.02, "radius": 6000.0},
    {"position": 3e3, "resistance": 0.05},
    {"position": 4e3, "tunnel": 1500.0},
]


@pytest.mark.parametrize(
    ("position", "expected", "opposing"),
    [
        (-5.0, 0.0, 0.0),
        (0.0, 0.0, 0.0),
        (999.9, 0.0, 0.0),
        (1000.0, 0.0981, 0.0),
        (1999.0, 0.0981, 0.0),
        (2000.0, -0.1962 + 9.81 * 1e-4, 9.81 * 1e-4),
        (3000.0, 0.05, 0.05),
        (9e9, 9.81 * 1.95e-4, 9.81 * 1.95e-4),
    ],
)
def test_sections(position, expected, opposing):
    both = {"line_resistance": expected, "curve_resistance": opposing}
    assert Line(profile=PROFILE, position=position).outputs() == pytest.approx(both, abs=1e-12)
    half = Line(profile=PROFILE, position=position, factor=0.5).outputs()
    assert half == pytest.approx({name: 0.5 * value for name, value in both.items()}, abs=1e-12)


def test_without_data_the_line_is_level():
    assert Line(position=5e3).outputs() == {"line_resistance": 0.0, "curve_resistance": 0.0}


@pytest.mark.parametrize(
    "profile",
    [
        [],
        "flat",
        [1, 2],
        [{"gradient": 0.01}],
        [{"position": 1.0}, {"position": 1.0}],
        [{"position": 0.0, "slope": 0.01}],
        [{"position": 0.0, "radius": -1.0}],
        [{"position": 0.0, "tunnel": -1.0}],
        [{"position": 0.0, "resistance": -0.01}],
        [{"position": 0.0, "gradient": "steep"}],
    ],
)
def test_unusable_lines_are_refused(profile):
    with pytest.raises(ComponentError, match="profile"):
        Line(profile=profile)


def test_further_gradients_are_added_to_those_of_the_profile():
    line = Line(points=2, position=150.0, positions=[0.0, 100.0], gradients=[0.01, -0.02], factor=0.5)
    assert line.outputs() == {"line_resistance": 0.5 * 9.81 * -0.02, "curve_resistance": 0.0}
    section = [{"position": 0.0, "gradient": 0.03, "resistance": 0.1}]
    steep = Line(profile=section, points=2, position=50.0, positions=[0.0, 100.0], gradients=[0.01, -0.02])
    assert steep.outputs()["line_resistance"] == 9.81 * 0.03 + 0.1 + 9.81 * 0.01
    assert steep.outputs()["curve_resistance"] == 0.1
