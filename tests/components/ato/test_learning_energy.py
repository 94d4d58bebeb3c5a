"""The composite energy function: its value by hand, and the change from trip to trip."""

import math

import pytest
from railcosim.components import LearningEnergy, Simulation


def test_energy_and_its_change():
    simulation = Simulation(LearningEnergy())
    simulation.initialize()
    simulation.start()

    def trip(number, error, estimate):
        energies, changes = [], []
        for n in (-1, 0, 1, 2):
            for name, value in {
                "trip": number, "trip_time": 0.01 * n, "augmented_error": error,
                "estimate": [estimate, 40.0, 0.5], "resistance_parameters": [7000.0, 48.0, 0.6],
            }.items():  # fmt: skip
                simulation.set(name, value)
            simulation.step(0.01)
            energies.append(simulation.get("energy"))
            changes.append(simulation.get("change"))
        return energies, changes

    def expected(error, estimate, n):
        rate = 0.5 * ((7000 - estimate) ** 2 / 5e5 + 8.0**2 / 0.01 + 0.1**2 / 0.01)
        return 194295 * 0.01 / math.pi * math.tan(math.pi * error**2 / 0.02) + 0.01 * n * rate

    first, none = trip(1, 0.02, 1000.0)
    assert first == pytest.approx([0.0, *(expected(0.02, 1000.0, n) for n in range(3))], rel=1e-12)
    assert none == [0.0] * 4
    assert simulation.get("largest_change") == -1e12
    second, change = trip(2, 0.01, 4000.0)
    assert second[1:] == pytest.approx([expected(0.01, 4000.0, n) for n in range(3)], rel=1e-12)
    assert change[1:] == pytest.approx([b - a for a, b in zip(first[1:], second[1:], strict=True)], rel=1e-9)
    assert simulation.get("largest_change") == pytest.approx(max(change[1:]), rel=1e-9)
    assert simulation.get("largest_change") < 0.0


def test_without_a_barrier_and_beyond_it():
    inputs = {"trip_time": 1.0, "augmented_error": 0.3}
    assert LearningEnergy(**inputs, has_barrier=False).outputs()["energy"] == pytest.approx(0.5 * 194295 * 0.09)
    assert math.isfinite(LearningEnergy(**inputs).outputs()["energy"])
