"""Jerk-limited profiles against their own definition: exact pieces, reached speeds, limits kept."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from railcosim.components.environment.profile import Phase, Profile, speed_change
from scipy.integrate import quad

changes = st.floats(-30.0, 30.0).filter(lambda dv: abs(dv) > 1e-3)


@given(changes, st.floats(0.05, 1.2), st.floats(0.05, 1.0))
def test_a_change_of_speed_reaches_it_within_its_limits(change, acceleration, jerk):
    """The integral of the jerk, twice, is the change; |a| stays below its limit, also where the peak is a triangle."""
    phases = speed_change(5.0, change, acceleration, jerk)
    profile = Profile(40.0, phases)
    end = phases[-1].begin + phases[-1].duration
    assert profile.at(end + 1.0).speed == pytest.approx(40.0 + change, abs=1e-9)
    assert profile.at(end + 1.0).acceleration == 0.0
    sampled = [profile.at(t) for t in np.linspace(0.0, end + 1.0, 200)]
    assert max(abs(m.acceleration) for m in sampled) <= acceleration + 1e-12
    assert all(abs(m.jerk) in (0.0, jerk) for m in sampled)


def test_position_and_speed_are_the_integrals():
    """Against adaptive quadrature, 1e-9."""
    profile = Profile(10.0, speed_change(3.0, 8.0, 0.5, 0.2) + speed_change(60.0, -5.0, 0.9, 0.4))
    for t in (2.0, 4.0, 10.0, 25.0, 63.0, 100.0):
        breaks = [b for b in profile.times if 0.0 < b < t]
        speed = 10.0 + quad(lambda s: profile.at(s).acceleration, 0.0, t, points=breaks or None, limit=200)[0]
        position = quad(lambda s: profile.at(s).speed, 0.0, t, points=breaks or None, limit=200)[0]
        assert profile.at(t).speed == pytest.approx(speed, abs=1e-9)
        assert profile.at(t).position == pytest.approx(position, abs=1e-8)


def test_there_is_no_jump_at_a_breakpoint():
    profile = Profile(10.0, speed_change(3.0, 8.0, 0.5, 0.2))
    for t in profile.times[1:]:
        before, after = profile.at(t - 1e-9), profile.at(t)
        assert before[:3] == pytest.approx(after[:3], abs=2e-8)


def test_no_change_needs_no_phases():
    assert speed_change(0.0, 0.0, 1.0, 1.0) == []


def test_mistakes_are_told():
    with pytest.raises(ValueError, match="before the one ahead of it ends"):
        Profile(0.0, [Phase(0.0, 5.0, 0.1), Phase(4.0, 1.0, -0.1)])
    with pytest.raises(ValueError, match="must be positive"):
        speed_change(0.0, 1.0, 0.0, 0.1)
