"""The train's equations in two parts: what a place means to it, and the rest."""

import numpy as np
from railcosim.orchestrator.driving.dynamics import Dynamics


def test_looked_up_ahead_the_equations_are_the_same_and_hold_no_table(hop):
    dynamics = Dynamics(hop())
    places, speeds, forces = np.linspace(0.0, 2500.0, 41), np.linspace(0.5, 22.0, 41), np.linspace(-1e5, 1e5, 41)
    given = [each[None, :] for each in (places, speeds, forces)]
    whole = np.array(dynamics.acceleration(*given))
    assert (np.array(dynamics.law(dynamics.here(given[0]), *given[1:])) == whole).all()
    slope = 9.81 * np.interp(places, [800.0, 860.0, 1500.0, 1560.0], [0.0, 0.01, 0.01, -0.01])
    resistance = 2400.0 + 60.0 * speeds + 6.0 * speeds**2
    np.testing.assert_allclose(whole[0], (forces - resistance - 120e3 * slope) / 132e3, rtol=1e-12, atol=1e-15)
    assert "cells" in str(dynamics.here(*dynamics.here.sx_in()))
    assert "cells" not in str(dynamics.law(*dynamics.law.sx_in()))
