"""The largest errors of each trip."""

from railcosim.components import Simulation, TripMonitor


def test_maxima_of_trips():
    simulation = Simulation(TripMonitor())
    simulation.initialize()
    simulation.set("trip", 3)
    simulation.start()

    def sample(trip, trip_time, error, speed=0.0):
        for name, value in {
            "trip": trip, "trip_time": trip_time, "position_error": error, "speed_error": -2 * error,
            "augmented_error": 3 * error, "speed": speed, "speed_limit": 10.0,
        }.items():  # fmt: skip
            simulation.set(name, value)
        simulation.step(0.01)

    def finished():
        names = ("trip", "position_error", "speed_error", "augmented_error", "overspeed")
        return [simulation.get(f"finished_{name}") for name in names]

    sample(3, -0.01, 99.0, 99.0)
    for n, (error, speed) in enumerate([(0.1, 5.0), (-0.3, 9.0), (0.2, 8.0)]):
        sample(3, 0.01 * n, error, speed)
    assert simulation.get("largest_speed_error") == 0.6
    assert finished() == [2, 0.0, 0.0, 0.0, -1e3]
    sample(4, -0.01, 99.0, 99.0)
    assert finished() == [3, 0.3, 0.6, 0.8999999999999999, -1.0]
    sample(4, 0.0, 0.05, 11.0)
    assert finished()[0] == 3
    assert simulation.get("largest_overspeed") == 1.0
    sample(5, -0.01, 0.0)
    assert finished() == [4, 0.05, 0.1, 0.15000000000000002, 1.0]
