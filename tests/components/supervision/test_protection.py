"""Protection: warning, brakes and their release, the hold at standstill, and the limit over place."""

import numpy as np
import pytest
from railcosim.components import Protection, Simulation
from railcosim.components.supervision.braking import brake

MASS = 194295.0


class Watch:
    """A protection and a point mass under its force, both sampled."""

    def __init__(self, step=0.01, **values):
        self.simulation = Simulation(Protection(**values))
        self.simulation.initialize()
        self.simulation.start()
        self.step, self.position, self.speed, self.time = step, 0.0, 0.0, 0.0

    def sample(self, demanded=0.0, resistance=0.0):
        for name, value in {
            "trip_time": self.time, "position": self.position, "speed": self.speed, "demanded_force": demanded
        }.items():  # fmt: skip
            self.simulation.set(name, value)
        self.simulation.step(self.step)
        acceleration = (self.get("force") - resistance) / MASS
        self.position += self.speed * self.step + 0.5 * acceleration * self.step**2
        self.speed += acceleration * self.step
        self.time += self.step
        return acceleration

    def get(self, name):
        return self.simulation.get(name)


@pytest.mark.parametrize(
    ("speed", "warning", "service", "emergency", "force"),
    [
        (19.4, False, False, False, 5e4),
        (19.55, True, False, False, 5e4),
        (19.6, True, False, False, 5e4),
        (19.61, True, True, False, -0.9 * MASS),
        (20.2, True, True, True, -1.2 * MASS),
    ],
)
def test_stages(speed, warning, service, emergency, force):
    out = Protection(trip_time=5.0, speed=speed, demanded_force=5e4).outputs()
    assert (out["warning"], out["service_brake"], out["emergency_brake"]) == (warning, service, emergency)
    assert out["force"] == pytest.approx(force)
    assert out["overspeed"] == pytest.approx(speed - 19.6)
    watching = Protection(trip_time=5.0, speed=speed, demanded_force=5e4, intervene=False).outputs()
    assert watching["force"] == 5e4
    assert watching["service_brake"] == service


def test_a_brake_is_held_to_the_standstill_and_until_the_next_wait():
    """Against 7.4 kN that pull back, it holds within a centimetre; at full traction all the while."""
    watch = Watch()
    watch.speed = 19.7
    standing = None
    for n in range(4000):
        watch.sample(demanded=400e3, resistance=7362.0)
        assert watch.get("service_brake")
        if standing is None and abs(watch.speed) < 0.01:
            standing = n, watch.position
    n, place = standing
    assert n * 0.01 == pytest.approx(19.7 / (0.9 + 7362.0 / MASS), rel=0.1)
    assert watch.position == pytest.approx(place, abs=0.05)
    before = watch.position
    for _ in range(300):
        watch.sample(demanded=400e3, resistance=7362.0)
    assert watch.position == pytest.approx(before, abs=1e-6)
    watch.time = -1.0
    watch.sample()
    assert not watch.get("service_brake")


@pytest.mark.parametrize("approach", [0.0, -300e3])
def test_the_service_brake_may_be_released_at_standstill(approach):
    watch = Watch(release_at_standstill=True, step=0.05)
    watch.speed = 19.7
    while watch.speed > 0.05:
        watch.sample(demanded=approach)
        assert watch.get("service_brake")
    watch.sample(demanded=1e5)
    watch.sample(demanded=1e5)
    assert not watch.get("service_brake")
    assert watch.get("force") == 1e5


def test_the_emergency_brake_is_not_released_at_standstill():
    emergency = Watch(release_at_standstill=True, step=0.05)
    emergency.speed = 21.0
    for _ in range(600):
        emergency.sample(demanded=1e5)
    assert emergency.get("emergency_brake")


@pytest.mark.parametrize("step", [0.01, 0.05, 0.1])
def test_the_hold_is_steady_at_every_usual_sample(step):
    watch = Watch(step=step)
    watch.speed = 19.7
    rates = [watch.sample(demanded=400e3) for _ in range(round(40.0 / step))]
    assert np.abs(rates[-100:]).max() < 1e-6
    assert min(rates) > -0.91


@pytest.mark.parametrize(
    ("speed", "demanded", "rate"),
    [
        (19.61, -1.3, -1.3),  # the service brake would be weaker
        (19.61, -0.5, -0.9),
        (20.2, -1.3, -1.3),
        (20.2, -1.0, -1.2),  # between the two brakes
        (10.0, -1.3, -1.3),  # no longer too fast: the brake that was called for still acts
        (0.35, -1.3, -1.3),
        (0.3, -1.3, -1.2),  # any brake eases into the standstill
        (0.1, -1.3, -0.4),
        (-0.5, -1.3, 0.9),  # rolling back: no reason to push
        (-0.5, 1.3, 0.9),
    ],
)
def test_a_controller_that_brakes_harder_keeps_its_force(speed, demanded, rate):
    values = {"trip_time": 5.0, "speed": speed, "service_latched": True}
    assert Protection(demanded_force=demanded * MASS, **values).outputs()["force"] == pytest.approx(rate * MASS)
    watching = Protection(demanded_force=demanded * MASS, intervene=False, **values).outputs()
    assert watching["force"] == demanded * MASS


@pytest.mark.parametrize("speed", [-0.05, 0.0, 0.04, 0.05])
@pytest.mark.parametrize("demanded", [-400e3, 0.0, 400e3])
def test_what_holds_a_standing_train_is_the_brake_alone(speed, demanded):
    values = {"trip_time": 50.0, "speed": speed, "position": 3.2, "hold_position": 3.1, "service_latched": True}
    out = Protection(demanded_force=demanded, **values).outputs()
    assert out["force"] == brake(MASS, 0.9, 3.2, speed, 3.1)


@pytest.mark.parametrize("step", [0.01, 0.05, 0.1])
def test_a_controller_that_never_stops_braking_is_held_all_the_same(step):
    """2.06 m/s2 to the standstill, less than the samples' own 0.05 m/s back, and then no motion."""
    watch = Watch(step=step)
    watch.speed = 19.7
    rates, speeds = [], []
    for _ in range(round(25.0 / step)):
        rates.append(watch.sample(demanded=-400e3))
        speeds.append(watch.speed)
    assert min(rates) == pytest.approx(-400e3 / MASS)
    assert np.argmax(np.array(speeds) < 1.0) * step == pytest.approx(18.7 / (400e3 / MASS), abs=2.0 * step)
    assert min(speeds) > -0.05
    assert np.abs(rates[-round(5.0 / step) :]).max() < 1e-6


def test_while_waiting_nothing_is_called_for():
    out = Protection(trip_time=-1.0, speed=50.0, demanded_force=1.0).outputs()
    assert (out["warning"], out["service_brake"], out["emergency_brake"], out["force"]) == (False, False, False, 1.0)


def test_limit_over_place():
    """The places at which the reference meets the limits' times (section 3)."""
    for position, limit in ((264.0, 19.6), (265.0, 22.6), (1905.0, 19.6), (2097.0, 22.6), (3178.0, 19.6)):
        assert Protection(by_place=True, position=position, trip_time=1.0).outputs()["speed_limit"] == limit


def test_braking_force():
    assert brake(MASS, 1.2, 0.0, 10.0, 0.0) == pytest.approx(-1.2 * MASS)
    assert brake(MASS, 1.2, 0.0, -10.0, 0.0) == pytest.approx(1.2 * MASS)
    assert brake(MASS, 1.2, 5.0, 0.0, 5.0) == 0.0
    assert brake(MASS, 1.2, 5.1, 0.01, 5.0) == pytest.approx(-MASS * (4.0 * 0.01 + 4.0 * 0.1))
