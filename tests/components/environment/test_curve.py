"""Curve resistance by hand, and its integral along transition curves against quadrature."""

import math

import pytest
from railcosim.components.environment.curve import LAWS, arc, transitions
from scipy.integrate import quad


def test_arcs_by_hand():
    assert arc(0.0, "roeckl") == 0.0
    assert arc(600.0, "600/R") == 1e-3
    assert arc(705.0, "roeckl") == pytest.approx(1e-3, rel=1e-15)  # 650 / (705 - 55) N/kN
    assert arc(280.0, "roeckl") == pytest.approx(2e-3, rel=1e-15)  # 500 / (280 - 30)
    with pytest.raises(ValueError, match=r"^'radius' is in m, .*: 90 is tighter than any curve of roeckl, 100$"):
        arc(90.0, "roeckl")


@pytest.mark.parametrize(
    ("radius", "end_radius", "law", "parts"),
    [
        (0.0, 400.0, "roeckl", 1),
        (400.0, 0.0, "600/R", 1),
        (0.0, 200.0, "roeckl", 2),
        (150.0, 900.0, "roeckl", 2),
        (250.0, 120.0, "roeckl", 1),
        (0.0, 300.0, "roeckl", 1),
    ],
)
def test_a_transition_curve_is_integrated_exactly(radius, end_radius, law, parts):
    found = transitions(100.0, 180.0, radius, end_radius, law)
    assert len(found) == parts
    assert (found[0].begin, found[-1].end) == pytest.approx((100.0, 180.0), abs=1e-12)
    k0, k1 = (1.0 / r if r else 0.0 for r in (radius, end_radius))

    def resistance(x):
        k = k0 + (k1 - k0) * (x - 100.0) / 80.0
        return 9.81 * arc(1.0 / k, law) if k else 0.0

    for part in found:
        middle = 0.3 * part.begin + 0.7 * part.end
        assert part.at(middle) == pytest.approx(resistance(middle), rel=1e-12)
        expected, error = quad(resistance, part.begin, middle, epsabs=1e-13, epsrel=1e-13)
        assert error < 1e-11
        assert part.until(middle - part.begin) == pytest.approx(expected, rel=1e-10, abs=1e-11)


def test_transition_curves_tighter_than_their_law_are_refused():
    with pytest.raises(ValueError, match="50 is tighter than any curve of roeckl, 100"):
        transitions(0.0, 100.0, 0.0, 50.0, "roeckl")
    assert all(math.isfinite(law.smallest) for laws in LAWS.values() for law in laws)
