"""Predictive and constant time headway control in closed loop: string stability, and the shipped scenario."""

import itertools

import numpy as np
import pytest
from railcosim.components import CATALOGUE
from railcosim.fmus.build import native_problem
from railcosim.orchestrator import System, load, run
from railcosim.orchestrator.linearization.closed_loop import linearize

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(bool(native_problem(CATALOGUE["DistributedMpc"])), reason="long runs need native FMUs"),
]
FREQUENCIES = np.geomspace(1e-3, 10.0, 200)
"""rad/s"""


def platoon(law, gap, plans):
    """Four trains at 50 m/s with the gap that they want, all connected by wire."""
    system = System(stop_time=60.0, step=0.1)
    system.add("target", "Schedule", values=50.0)
    for i in range(1, 5):
        told = {"has_plan": True} if plans and i > 1 else {}
        system.add(f"train[{i}]", "PointMassTrain", position=gap * (4 - i), speed=50.0)
        system.add(f"cruise[{i}]", law, has_ahead=i > 1, **told)
        system.connect("target.value", f"cruise[{i}].target_speed")
        system.connect(f"cruise[{i}].force", f"train[{i}].force")
        for name in ("position", "speed"):
            system.connect(f"train[{i}].{name}", f"cruise[{i}].{name}")
            if i > 1:
                system.connect(f"train[{i - 1}].{name}", f"cruise[{i}].ahead_{name}")
        if told:
            system.connect(f"cruise[{i - 1}].plan", f"cruise[{i}].ahead_plan")
    return system


def gains(law, gap, plans=False):
    """How much larger the speed's deviation is at each train than at the one ahead, by frequency."""
    model = linearize(platoon(law, gap, plans), 50.0, inputs=["train[1].disturbance"], outputs=["train[:].speed"])
    found = []
    for w in FREQUENCIES:
        z = 1j * w if model.step is None else np.exp(1j * w * model.step)
        y = model.c @ np.linalg.solve(z * np.eye(len(model.a)) - model.a, model.b)
        found.append(np.abs(y[1:, 0] / y[:-1, 0]))
    return np.array(found)


def test_the_constant_time_headway_law_is_a_lag_of_its_headway():
    expected = np.abs(1.0 / (20.0j * FREQUENCIES + 1.0))
    assert gains("TimeHeadwayCruise", 1250.0) == pytest.approx(np.tile(expected, (3, 1)).T, abs=1e-12)


@pytest.mark.parametrize("plans", [True, False], ids=["with plans", "without"])
def test_the_predictive_controller_is_string_stable(plans):
    """Away from its limits, where its matrices are those of the FMU's own steps, twenty Newton steps included."""
    assert gains("DistributedMpc", 1270.0, plans).max() < 1.0


@pytest.mark.parametrize(
    ("law", "settings"),
    [
        ("TimeHeadwayCruise", ["cruise.standstill_gap=400"]),
        ("DistributedMpc", ["cruise.gap_margin=150", "cruise.sample_time=0.5"]),
    ],
)
def test_a_braking_wave_dies_out(law, settings):
    """Each of ten trains deviates less from its speed than the one ahead of it, of which the first is braked."""
    system = load("braking_wave", swaps=[f"cruise={law}"], settings=["cruise.time_headway=100", *settings])
    (deviations,) = (metric.values for metric in run(system).metrics if metric.name == "speed_deviation")
    assert all(after < before for before, after in itertools.pairwise(deviations.values()))


@pytest.mark.parametrize("preset", [None, "no-plans"])
def test_the_shipped_platoon_stops_behind_the_train_that_breaks_down(preset):
    result = run(load("predictive_platoon", preset=preset))
    assert [verdict.name for verdict in result.requirements if verdict.verdict != "pass"] == []
    found = {metric.name: metric.values for metric in result.metrics}
    peaks = list(found["acceleration_peak"].values())
    assert peaks == sorted(peaks, reverse=True)
    assert min(found["gap_min"].values()) > 250.0
