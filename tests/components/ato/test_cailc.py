"""CAILC and AILC: the laws by hand, memory, bounds, flags and the emergency brake."""

import json
import math

import numpy as np
import pytest
from railcosim.components import Ailc, Cailc, ComponentError, Simulation
from railcosim.components.ato.cailc import EMERGENCY, OK, REFUSED, STRETCHED, VIOLATED

MASS, ALPHA, BETA = 194295.0, 8.0, 1.1e5
DRIVING = {
    "trip_time": 12.0, "position": 60.002, "speed": 9.99, "reference_position": 60.0, "reference_speed": 10.0,
    "reference_acceleration": 0.9,
}  # fmt: skip


def by_hand(learned, gain, bounds=None, barrier=None):
    """Section 4 of `docs/models/cailc_ato.md`, the program text, for DRIVING."""
    v, d = 9.99, ALPHA * 0.002 - 0.01
    chi = d if barrier is None else d / math.cos(math.pi * d * d / (2 * barrier * barrier)) ** 2
    q = [p - v**k * g * chi for k, (p, g) in enumerate(zip(learned, gain, strict=True))]
    if bounds:
        q = [min(max(x, low), high) for x, low, high in zip(q, *bounds, strict=True)]
    return q, q[0] + (q[1] + q[2] * v) * v + MASS * 0.9 + MASS * ALPHA * 0.01 - BETA * d


def test_the_law_without_barrier():
    learned, gain = [5000.0, 40.0, 0.5], [5e5, 100.0, 0.3]
    out = Ailc(**DRIVING, learned=learned, learning_gain=gain).outputs()
    q, u = by_hand(learned, gain)
    assert out["estimate"] == pytest.approx(q, rel=1e-9)
    assert out["force"] == pytest.approx(u, rel=1e-9)
    assert out["position_error"] == pytest.approx(0.002, abs=1e-12)
    assert out["speed_error"] == pytest.approx(-0.01, abs=1e-12)
    assert out["augmented_error"] == pytest.approx(0.006, abs=1e-12)
    assert out["barrier_reached"] is False


def test_the_law_with_barrier_and_bounds():
    learned, gain = [5000.0, 40.0, 0.5], [5e5, 100.0, 0.3]
    bounds = [3000.0, 0.0, 0.0], [4000.0, 39.0, 1.0]
    for barrier, limited in ((0.1, False), (0.008, False), (0.1, True)):
        q, u = by_hand(learned, gain, bounds if limited else None, barrier)
        out = Cailc(
            **DRIVING, learned=learned, learning_gain=gain, barrier=barrier, limit_estimate=limited,
            estimate_min=bounds[0], estimate_max=bounds[1],
        ).outputs()  # fmt: skip
        assert out["estimate"] == pytest.approx(q, rel=1e-9)
        assert out["force"] == pytest.approx(u, rel=1e-9)
        assert out["status"] == OK
    assert q[0] == 3000.0 or q[0] == 4000.0


def test_while_waiting_there_is_no_force_and_no_error():
    """The position is still that of the last trip's end."""
    for controller in (Ailc, Cailc):
        out = controller(**DRIVING | {"trip_time": -0.01, "position": 3512.0}).outputs()
        names = ("force", "position_error", "speed_error", "augmented_error")
        assert [out[name] for name in names] == [0.0] * 4


class Loop:
    """A controller at work, told where the train is; kappa and the check of its loop come with it."""

    def __init__(self, component=Cailc, **values):
        self.simulation = Simulation(component(**values))
        self.simulation.initialize()
        self.simulation.start()

    def sample(self, trip=1, trip_time=1.0, **inputs):
        """One sample; the outputs that belong to it, and the memory after it."""
        for name, value in {"trip": trip, "trip_time": trip_time, "reference_acceleration": 0.0, **inputs}.items():
            self.simulation.set(name, value)
        self.simulation.step(0.01)
        return self.simulation

    def get(self, name):
        return self.simulation.get(name)


def test_flags_at_the_barrier():
    loop = Loop()
    kappa = loop.get("stretch_begin")
    assert kappa == pytest.approx(0.845, abs=6e-4)
    for k, (error, status, reached) in enumerate(
        [(0.05, OK, False), (0.0846, STRETCHED, False), (-0.0999, STRETCHED, False), (-0.1001, VIOLATED, True),
         (0.02, OK, True), (3.0, VIOLATED, True)]
    ):  # fmt: skip
        loop.sample(trip_time=1.0 + 0.01 * k, speed=error)
        assert loop.get("augmented_error") == error
        assert loop.get("status") == status
        assert loop.get("barrier_reached") is reached
        assert math.isfinite(loop.get("force"))
    assert loop.get("stretched_count") == 4
    assert loop.get("violated_count") == 2
    assert loop.get("violated_at") == pytest.approx(1.03)
    assert loop.get("largest_augmented_error") == 3.0
    loop.sample(trip=2, trip_time=-0.5)
    loop.sample(trip=2, trip_time=-0.49)
    assert loop.get("barrier_reached") is False
    assert [loop.get(n) for n in ("stretched_count", "violated_count", "violated_at")] == [0, 0, -1.0]


def test_overspeed_latches_the_emergency_brake_until_the_next_wait():
    loop = Loop()
    loop.sample(speed=10.0, reference_speed=10.0, speed_limit=10.0)
    assert loop.get("status") == OK
    loop.sample(trip_time=1.01, speed=10.01, reference_speed=10.0, speed_limit=10.0)
    assert loop.get("status") == EMERGENCY
    assert loop.get("force") == pytest.approx(-1.2 * MASS)
    loop.sample(trip_time=1.02, speed=9.0, reference_speed=10.0, speed_limit=10.0)
    assert loop.get("force") == pytest.approx(-1.2 * MASS)
    loop.sample(trip_time=1.03, position=50.0, speed=0.0, reference_speed=10.0, speed_limit=10.0)
    assert loop.get("status") == EMERGENCY
    assert abs(loop.get("force")) < 1.2 * MASS * 1.0001
    loop.sample(trip=2, trip_time=-1.0)
    loop.sample(trip=2, trip_time=0.0, position=0.0, speed=0.0, reference_speed=0.0)
    assert loop.get("status") == OK


def test_late_is_not_braked_for_unless_asked():
    assert Loop().sample(speed=9.0, reference_speed=10.0, speed_limit=20.0).get("status") == VIOLATED
    stopping = Loop(stop_at_barrier=True)
    assert stopping.sample(speed=9.0, reference_speed=10.0, speed_limit=20.0).get("status") == EMERGENCY


@pytest.mark.parametrize(
    "values",
    [
        {"sample_time": 0.18},
        {"sample_time": 0.08, "delay": 1},
        {"estimate_min": [0.0, 0.15, 0.0], "estimate_max": [1.0, 0.0161, 1.0]},  # the misprint of the source
    ],
)
def test_it_refuses_to_drive_where_it_cannot(values):
    simulation = Simulation(Cailc(**values))
    simulation.initialize()
    simulation.start()
    simulation.set("trip_time", 0.0)
    simulation.set("reference_acceleration", 0.9)
    assert simulation.get("status") == REFUSED
    assert simulation.get("force") == 0.0


def test_the_check_of_the_loop_can_be_switched_off():
    simulation = Simulation(Cailc(sample_time=0.2, check_sampling=False))
    simulation.initialize()
    simulation.start()
    simulation.set("trip_time", 0.0)
    assert simulation.get("status") == OK


def two_trips(loop, first, **inputs):
    """Three samples of a trip with a speed error, a wait, and what the next trip reads at its second sample."""
    for n in range(3):
        loop.sample(trip=first, trip_time=0.01 * n, **({"speed": 0.01} | inputs))
    loop.sample(trip=first + 1, trip_time=-0.01)
    loop.sample(trip=first + 1, trip_time=0.0)
    return loop.sample(trip=first + 1, trip_time=0.01, speed=0.0).get("estimate")


@pytest.mark.parametrize("component", [Ailc, Cailc])
def test_the_next_trip_begins_with_what_this_one_learned(component):
    chi = 0.01 if component is Ailc else 0.01000247
    assert two_trips(Loop(component), 1) == pytest.approx([-5e5 * chi, -0.01 * 0.01 * chi, 0.0], rel=1e-6, abs=1e-5)


def test_a_rehearsal_and_a_trip_with_an_emergency_are_not_learned_from():
    assert not two_trips(Loop(), 0).any()
    assert not two_trips(Loop(), 1, speed_limit=0.005).any()


def test_a_misfit_tape_file_is_a_clear_error(tmp_path):
    path = tmp_path / "memory.tape"
    for text, message in (
        ("nonsense\n", "not a tape file"),
        ("railcosim tape 1 component=Ailc x\nend\n", "does not fit"),
    ):
        path.write_text(text)
        simulation = Simulation(Cailc(tape_file=str(path)))
        simulation.initialize()
        with pytest.raises(ComponentError, match=message):
            simulation.start()


def test_state_goes_through_save_and_restore():
    loop = Loop()
    loop.sample(trip_time=1.0, speed=0.2)
    state = json.loads(loop.simulation.to_bytes())
    other = Loop()
    other.simulation.restore(state)
    for each in (loop, other):
        each.sample(trip_time=1.01, speed=0.01)
    assert loop.get("barrier_reached") is other.get("barrier_reached") is True
    assert (np.asarray(loop.get("estimate")) == other.get("estimate")).all()
