"""PID, PD-type ILC and adaptive control: their laws by hand, their memory, and the restart at each departure."""

import pytest
from railcosim.components import AdaptiveAto, Ailc, AtoController, Cailc, PdIlc, PidAto, Simulation


class Loop:
    """A controller at work, told the speed of the train and of its reference."""

    def __init__(self, component):
        self.simulation = Simulation(component)
        self.simulation.initialize()
        self.simulation.start()

    def force(self, trip, trip_time, **inputs):
        for name, value in {"trip": trip, "trip_time": trip_time, **inputs}.items():
            self.simulation.set(name, value)
        self.simulation.step(0.01)
        return self.simulation.get("force")


def test_pid():
    """Eq. 60 with the integral up to the last sample and a backward difference."""
    loop = Loop(PidAto())
    errors, integral, last = [0.1, 0.3, -0.2, 0.05], 0.0, 0.0
    for n, error in enumerate(errors):
        expected = 300201 * error + integral + 10 * (error - last) / 0.01
        assert loop.force(1, 0.01 * n, reference_speed=10.0, speed=10.0 - error) == pytest.approx(expected, rel=1e-9)
        integral, last = integral + 0.01 * error, error
    assert loop.force(2, -0.01, speed=10.0) == 0.0
    assert loop.force(2, 0.0, reference_speed=0.1, speed=0.0) == pytest.approx(300201 * 0.1 + 10 * 0.1 / 0.01)


def test_pd_ilc_begins_with_pid_and_goes_on_from_its_own_force():
    """Eq. 61 on the force that the PID trip left."""
    loop, pid = Loop(PdIlc()), Loop(PidAto())
    errors = [0.1, 0.3, -0.2, 0.05]
    first = []
    for n, error in enumerate(errors):
        first.append(loop.force(0, 0.01 * n, reference_speed=10.0, speed=10.0 - error))
        assert first[-1] == pid.force(0, 0.01 * n, reference_speed=10.0, speed=10.0 - error)
    loop.force(1, -0.01)
    last = 0.0
    for n, error in enumerate([0.05, 0.15, -0.1]):
        expected = first[n] + 1.05e5 * error + (error - last) / 0.01
        assert loop.force(1, 0.01 * n, reference_speed=10.0, speed=10.0 - error) == pytest.approx(expected, rel=1e-9)
        last = error


def test_adaptive():
    """Eqs. 62-63, the decay integrated implicitly and the gain adapted before it acts; anew on each trip."""
    loop = Loop(AdaptiveAto())
    gain, v = 0.0, 5.0
    for n, error in enumerate([0.2, -0.1, 0.05]):
        x, size = 8.0 * 0.01 * n + error, 1.0 + v + v * v
        denominator = size * abs(x) + 0.5
        gain = (gain + 0.01 * 20.0 * size**2 * x**2 / denominator) / (1.0 + 0.01)
        expected = -(1e5 + gain * size**2 / denominator) * x
        inputs = {"position": 0.01 * n, "speed": v, "reference_speed": v - error}
        assert loop.force(1, 0.01 * n, **inputs) == pytest.approx(expected, rel=1e-9)
        assert loop.simulation.get("robust_gain") == pytest.approx(gain, rel=1e-12)
    loop.force(2, -0.01)
    assert loop.simulation.get("robust_gain") == 0.0


@pytest.mark.parametrize("component", [Cailc, Ailc, PdIlc, AdaptiveAto, PidAto])
def test_all_have_the_port(component):
    """One can replace another: the same inputs, and every output of the port."""
    declared = component.declarations
    assert set(AtoController.declarations) <= set(declared)
    out = component(trip_time=1.0, speed=1.0).outputs()
    assert {"force", "position_error", "speed_error", "augmented_error", "estimate", "barrier_reached"} <= out.keys()


def test_the_port_is_filled_in_by_outputs_alone():
    """A controller of one's own needs no memory and no update."""

    class Proportional(AtoController):
        def outputs(self):
            errors = self._errors()
            return self._report(-1e5 * errors.augmented, errors)

    out = Proportional(trip_time=1.0, speed=1.1, reference_speed=1.0).outputs()
    assert out["force"] == pytest.approx(-1e4)
    assert "sample_time" not in Proportional.declarations
