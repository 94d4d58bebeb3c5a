"""The format of a line, and what a train meets over its length, against quadrature."""

import pytest
from railcosim.components import ComponentError, Line
from railcosim.components.environment.curve import arc
from railcosim.components.environment.track import NO_LIMIT, read_line
from railcosim.components.tracing import Sourced
from scipy.integrate import quad

SECTIONS = [
    {"position": 0.0, "gradient": 0.002},
    {"position": 100.0, "gradient": 0.012, "radius": 500.0},
    {"position": 180.0, "gradient": 0.012, "radius": 500.0, "end_radius": 0.0},
    {"position": 260.0, "gradient": -0.02, "end_radius": 250.0},
    {"position": 330.0, "gradient": -0.02, "radius": 250.0, "resistance": 0.01},
    {"position": 500.0, "tunnel": 700.0, "gradient": 0.001},
]
WHOLE = {
    "sections": SECTIONS,
    "curve_law": "roeckl",
    "altitude": 400.0,
    "speed_limits": [[0.0, 20.0], [200.0, 12.0], [240.0, 25.0], [600.0, 15.0]],
    "stops": [{"position": 0.0, "name": "A"}, {"position": 450.0}, {"position": 1000.0, "name": "Z"}],
    "neutral_sections": [[300.0, 340.0]],
}
TRAIN = {"mass": 1e5, "length": 90.0}
BREAKS = [0.0, 100.0, 180.0, 260.0, 319.0, 320.0, 330.0, 500.0]


def gradient(x):
    return next((s["gradient"] for s in reversed(SECTIONS) if s["position"] <= x), 0.002)


def curve(x):
    if 100.0 <= x < 180.0:
        return arc(500.0, "roeckl")
    curvature = (1.0 - (x - 180.0) / 80.0) / 500.0 if 180.0 <= x < 260.0 else 0.0
    if 260.0 <= x < 330.0:
        curvature = (x - 260.0) / 70.0 / 250.0
    if 330.0 <= x < 500.0:
        return arc(250.0, "roeckl") + 0.01 / 9.81
    return (arc(1.0 / curvature, "roeckl") if curvature > 0.0 else 0.0) + (0.00013 * 700.0 / 1e3 if x >= 500.0 else 0.0)


@pytest.mark.parametrize("position", [-10.0, 40.0, 99.0, 120.0, 185.0, 230.0, 262.0, 318.4, 333.0, 420.0, 505.0, 2e3])
def test_resistance_over_the_trains_length_is_the_exact_mean(position):
    def mean(of):
        breaks = [b for b in (*BREAKS, 260.0 + 70.0 * 250.0 / 300.0) if position - 90.0 < b < position]
        value, error = quad(of, position - 90.0, position, points=breaks or None, epsabs=1e-13, limit=200)
        assert error < 1e-9
        return value / 90.0

    found = Line(line=WHOLE, train=TRAIN, position=position).outputs()
    opposing = mean(lambda x: 9.81 * curve(x))
    assert found["curve_resistance"] == pytest.approx(opposing, abs=1e-11)
    assert found["line_resistance"] == pytest.approx(opposing + mean(lambda x: 9.81 * gradient(x)), abs=1e-11)
    point = Line(line=WHOLE, position=position).outputs()
    assert point["curve_resistance"] == pytest.approx(9.81 * curve(position), abs=1e-14)
    assert point["line_resistance"] == pytest.approx(9.81 * (curve(position) + gradient(position)), abs=1e-14)


@pytest.mark.parametrize("position", [-10.0, 40.0, 150.0, 262.0, 505.0, 2e3])
def test_the_mean_altitude_is_the_mean_of_the_gradients_integral(position):
    breaks = [s["position"] for s in SECTIONS]

    def altitude(x):
        height, begins = 400.0, [*breaks[1:], float("inf")]
        for begin, end in zip(breaks, begins, strict=True):
            low = -float("inf") if begin == 0.0 else begin
            if x > low:
                height += gradient(begin) * (min(x, end) - begin)
        return height

    inside = [b for b in breaks if position - 90.0 < b < position]
    expected, _ = quad(altitude, position - 90.0, position, points=inside or None, epsabs=1e-12)
    found = read_line(WHOLE).mean_altitude(position, 90.0)
    assert found == pytest.approx(expected / 90.0, abs=1e-10)


@pytest.mark.parametrize(
    ("position", "limit", "stop", "neutral"),
    [
        (0.0, 20.0, 0.0, False),
        (100.0, 20.0, 450.0, False),
        (200.0, 20.0, 450.0, False),
        (200.1, 12.0, 450.0, False),
        (250.0, 12.0, 450.0, False),
        (330.0, 12.0, 450.0, True),  # the rear is still under the lower limit
        (330.1, 25.0, 450.0, True),
        (299.9, 12.0, 450.0, False),
        (429.9, 25.0, 450.0, True),
        (430.1, 25.0, 450.0, False),
        (600.5, 15.0, 1000.0, False),
        (1000.1, 15.0, 1e9, False),
    ],
)
def test_limits_hold_for_the_whole_train(position, limit, stop, neutral):
    found = Line(line=WHOLE, train=TRAIN, position=position).outputs()
    assert (found["speed_limit"], found["next_stop"], found["neutral"]) == (limit, stop, neutral)


def test_the_way_back_is_the_line_mirrored():
    one, both = read_line(WHOLE), read_line(WHOLE | {"way_back": True})
    assert [stop.position for stop in both.stops] == [0.0, 450.0, 1000.0, 1550.0, 2000.0]
    assert [stop.name for stop in both.stops] == ["A", "", "Z", "", "A"]
    assert both.neutral == ((300.0, 340.0), (1660.0, 1700.0))
    for x in (50.0, 150.0, 210.0, 300.0, 400.0, 700.0):
        there, opposing = one.resistance(x)
        assert both.resistance(x) == (there, opposing)
        assert both.resistance(2000.0 - x) == pytest.approx((2.0 * opposing - there, opposing), abs=1e-14)
        assert both.limits.at(2000.0 - x) == one.limits.at(x)
    assert both.mean_altitude(2050.0, 100.0) == pytest.approx(400.0 + 0.5 * (0.002 - 0.002) * 50.0, abs=1e-9)


def test_without_limits_there_is_none():
    assert Line(position=5.0).outputs()["speed_limit"] == NO_LIMIT


def test_a_tunnel_of_known_section_resists_by_the_trains_data():
    line = [{"position": 0.0}, {"position": 100.0, "tunnel": 900.0, "area": 32.0}, {"position": 1000.0}]
    train = {"mass": 1e5, "length": 50.0, "tunnel_resistance": [[24.0, 15.0], [40.0, 7.0]]}
    found = Line(line=line, train=train, position=125.0, speed=30.0).outputs()  # half of the train is inside
    assert found["line_resistance"] == found["curve_resistance"] == pytest.approx(0.5 * 11.0 * 900.0 / 1e5, rel=1e-15)


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"sections": []}, "sections are a list of at least one"),
        ({"speed_limits": [[0.0, 20.0], [0.0, 30.0]]}, "speed limit 2: 'begin' must exceed 0"),
        ({"speed_limits": [[0.0, 200.0]]}, "is it in another unit"),
        ({"stops": [{"position": 5.0}, {"position": 1.0}]}, "stop 2: 'position' must exceed 5"),
        ({"neutral_sections": [[30.0, 20.0]]}, "neutral section 1: 'end' must exceed 'begin', 30"),
        ({"curve_law": "Roeckl"}, "'curve_law' must be one of '600/R', 'roeckl', not 'Roeckl'"),
        ({"name": 5}, "'name' must be a text, not 5"),
        ({"way_back": True, "stops": [{"position": 9.0}]}, "'way_back' takes a line with at least two stops"),
        ({"national": {"M_NVAVADH": 0.0}}, "'Kt_int' must be a number, not None"),
        ({"gradient": 0.1}, "a line has no 'gradient'"),
        ({"sections": [{"position": 0.0, "radius": 90.0}]}, "section 1: 'radius' is in m"),
        ({"sections": [{"position": 0.0, "end_radius": 900.0}], "stops": ()}, "section 1: a transition curve ends"),
    ],
)
def test_unusable_lines_are_refused_with_key_and_row(change, complaint):
    with pytest.raises(ComponentError) as told:
        Line(line=WHOLE | change)
    assert complaint in str(told.value)


def test_a_transition_curve_may_end_at_the_last_stop():
    ends = [{"position": 0.0}, {"position": 50.0}]
    line = read_line({"sections": [{"position": 0.0, "end_radius": 600.0}], "stops": ends})
    assert line.resistance(25.0)[0] == pytest.approx(9.81 * 0.5e-3, rel=1e-12)


def test_a_train_whose_length_is_a_parameter_has_all_steps():
    position, length = Sourced(frozenset({"position"})), Sourced(frozenset({"length"}))
    whole, _ = read_line(WHOLE).mean_resistance(position, length)
    assert whole.names == {"position", "length"}
