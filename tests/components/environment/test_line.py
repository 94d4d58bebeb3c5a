"""The line's resistance by hand: g (gradient + 0.6/R) + resistance, constant in each section."""

import pytest
from railcosim.components import ComponentError, Line

RESISTANCES = ("line_resistance", "curve_resistance")
PROFILE = [
    {"position": 0.0},
    {"position": 1e3, "gradient": 0.01},
    {"position": 2e3, "gradient": -0.02, "radius": 6000.0},
    {"position": 3e3, "resistance": 0.05},
    {"position": 4e3, "tunnel": 1500.0},
]


def resistances(**values):
    found = Line(**values).outputs()
    return tuple(found[name] for name in RESISTANCES)


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
    assert resistances(line=PROFILE, position=position) == pytest.approx((expected, opposing), abs=1e-12)
    half = resistances(line=PROFILE, position=position, factor=0.5)
    assert half == pytest.approx((0.5 * expected, 0.5 * opposing), abs=1e-12)


def test_without_data_the_line_is_level():
    assert resistances(position=5e3) == (0.0, 0.0)


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
def test_unusable_sections_are_refused(profile):
    with pytest.raises(ComponentError, match="'line' is unusable"):
        Line(line=profile)


def test_further_gradients_are_added_to_those_of_the_line():
    further = {"points": 2, "positions": [0.0, 100.0], "gradients": [0.01, -0.02]}
    assert resistances(**further, position=150.0, factor=0.5) == (0.5 * 9.81 * -0.02, 0.0)
    section = [{"position": 0.0, "gradient": 0.03, "resistance": 0.1}]
    assert resistances(**further, line=section, position=50.0) == (9.81 * 0.03 + 0.1 + 9.81 * 0.01, 0.1)
