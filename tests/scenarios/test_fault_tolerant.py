"""The fault-tolerant cruise scenarios: regression values, requirements R1 to R3 and known values of every preset.

All expected numbers were measured for the specification with two independent implementations, NumPy and C.
"""

import numpy as np
import pytest
from railcosim.components import Consist
from railcosim.fmus.build import native_problem
from railcosim.orchestrator import load, run
from railcosim.orchestrator.evaluation import BAD

fast = pytest.mark.skipif(bool(native_problem(Consist)), reason="100 000 steps take minutes without native FMUs")

REGRESSION = {
    # t: x11, x33 (m), F21 (N), a21 (m/s2), estimated and true f21 (N), e1, e2, e3 (m)
    10: (10484.574751, 3952.492508, 9937.8975, 0.03120267, 2.8823, 0.0, 15.425249, 74.786944, -92.704745),
    100: (15688.568007, 9143.662232, 10753.0191, -0.00517929, 0.0059, 0.0, 4.431993, 21.346192, -26.440416),
    330: (32640.546584, 26090.583998, 14451.1274, 0.00494543, -15999.4035, -16e3, 0.453416, 1.077221, -1.113613),
    600: (51395.741445, 44845.855140, 31950.1227, 0.24967703, 8430.3151, 8430.5606, 0.018971, -0.088076, -0.025402),
    1000: (78444.999814, 71894.997646, 10157.6213, 3e-8, 0.0, 0.0, 0.000186, -0.000355, 0.002524),
}


@pytest.fixture(scope="module")
def nominal():
    return run(load("fault_tolerant_cruise", preset="nominal"), figures=False)


def all_well(result, judged=True):
    """Every requirement passes and every known value that is judged is reproduced."""
    assert {v.name: (v.verdict, v.margin) for v in result.requirements if v.verdict != "pass"} == {}
    values = [*result.published, *result.references]
    assert {p.metric: (p.measured, p.value) for p in values if p.verdict in BAD} == {}
    assert any(p.verdict == "reproduced" for p in values) is judged


def metric(result, name):
    return max(next(m for m in result.metrics if m.name == name).values.values())


@pytest.mark.long
@fast
def test_nominal(nominal):
    all_well(nominal)


@fast
@pytest.mark.parametrize("t", REGRESSION)
def test_regression(nominal, t):
    """Positions and distances to the last printed digit.

    Forces and faults to 0.1 N: the specification's plant integrates the fault, ours gets its mean over each sample.
    """
    k = int(np.argmin(np.abs(nominal.time - t)))
    x11, x33, force, acceleration, estimate, fault, *errors = REGRESSION[t]
    assert nominal["train[1].position[1]"][k] == pytest.approx(x11, abs=1.1e-6)
    assert nominal["train[3].position[3]"][k] == pytest.approx(x33, abs=1.1e-6)
    assert nominal["train[2].actuator_force[1]"][k] == pytest.approx(force, abs=0.1)
    assert nominal["train[2].acceleration[1]"][k] == pytest.approx(acceleration, abs=1e-6)
    assert nominal["cruise[2].fault_estimate[1]"][k] == pytest.approx(estimate, abs=0.05)
    assert nominal["faults[2].fault_now[1]"][k] == pytest.approx(fault, abs=1e-3)
    ahead = [nominal["reference.virtual_position"], *(nominal[f"train[{i}].tail_position"] for i in (1, 2))]
    found = [x[k] - nominal[f"train[{i}].position[1]"][k] - 3200.0 for i, x in enumerate(ahead, 1)]
    assert found == pytest.approx(errors, abs=1.1e-6)


@fast
def test_the_fault_estimate_converges(nominal):
    """Own code for the specification's measure, beside the scenario's metric: the last 10 s of every interval."""
    schedule = {(1, 1): ((100, 320), (220, 460)), (2, 3): ((400, 640), (500, 700)), (3, 3): ((540, 760), (600, 740))}
    for (i, j), (constant, periodic) in schedule.items():
        instants = sorted({*constant, *periodic})
        for end in instants[1:]:
            judged = (nominal.time >= end - 10) & (nominal.time < end - 0.05)
            error = nominal[f"cruise[{i}].fault_estimate[{j}]"] - nominal[f"faults[{i}].fault_now[{j}]"]
            size = nominal[f"faults[{i}].fault_size[{j}]"][judged]
            assert (size > 7e3).all()
            assert np.abs(error[judged] / size).max() < 5e-4


@pytest.mark.long
@fast
def test_the_ablation_violates_r3():
    """Plain backstepping for the heads: speed differences of -40 to 50 m/s, R3 and the barrier fail, R1 and R2 hold."""
    result = run(load("fault_tolerant_ablation"), figures=False)
    assert {v.name for v in result.requirements if v.verdict == "fail"} == {"r3_range", "barrier"}
    assert all(p.verdict == "reproduced" for p in result.references)


def test_the_default_is_the_experiment_of_the_source_with_its_noise():
    """Every other preset is free of it, because its known values are, but those that say so."""
    for name in ("fault_tolerant_cruise", "fault_tolerant_baseline"):
        for preset in (None, *load(name).provenance.presets):
            system = load(name, preset=preset)
            noisy = preset is None or preset.startswith("noise")
            found = [x.start["deviation"] for x in system.instances.values() if x.model == "GaussianDisturbance"]
            assert found == [0.02 if noisy else 0.0] * 3, preset
        assert load(name).provenance.preset == "noise"


@fast
@pytest.mark.long
@pytest.mark.parametrize("preset", ["noise", "wide-start", "mass-high", "resistance-high", "coupler-soft", "lag-long",
                                    "omega-high"])  # fmt: skip
def test_presets(preset):
    all_well(run(load("fault_tolerant_cruise", preset=preset), figures=False))


@fast
@pytest.mark.long
@pytest.mark.parametrize("preset", ["stress", "mass-low", "coupler-stiff", "lag-short", "omega-low", "late-exchange"])
def test_presets_without_known_values(preset):
    result = run(load("fault_tolerant_cruise", preset=preset), figures=False)
    assert [v.name for v in result.requirements if v.verdict != "pass"] == []


@fast
@pytest.mark.long
@pytest.mark.parametrize("preset", ["pole-2", "pole-6", "pole-10", "noise", "noise-pole-6", "noise-pole-10"])
def test_the_baseline_leaves_a_residual(nominal, preset):
    """Its known values; without noise its fault error is more than 1000 times the observer's."""
    result = run(load("fault_tolerant_baseline", preset=preset), figures=False)
    all_well(result, judged=preset != "noise-pole-10")  # whose one known value is the random numbers'
    if preset.startswith("pole"):
        assert metric(result, "fault_error") > 1000.0 * metric(nominal, "fault_error")


@fast
@pytest.mark.long
def test_eight_trains_of_eight_carriages():
    """R1 to R3 hold, every fault is found, and speeds differ no more at the last train than at the first ones."""
    result = run(load("fault_tolerant_eight"), figures=False)
    assert [v.name for v in result.requirements if v.verdict != "pass"] == []
    assert metric(result, "fault_error") < 5e-4


# A step of Python FMUs costs 4 ms, so that 1000 s at 0.01 s would take 400 s. The closed loop runs its whole length,
# with every fault, at 0.1 s instead, in a campaign; and at 0.01 s the same faults come and go, overlap and heal sixty
# times as fast.
@pytest.mark.parametrize(
    ("step", "seconds", "haste"),
    [
        pytest.param(0.01, 1.0, 1.0, marks=pytest.mark.long),
        pytest.param(0.1, 1000.0, 1.0, marks=[pytest.mark.campaign, fast]),
        pytest.param(0.01, 15.0, 60.0, marks=[pytest.mark.long, fast]),
    ],
)
def test_python_and_native_agree(step, seconds, haste):
    """Bit for bit, with faults, noise and all trains."""
    settings = [f"simulation.stop_time={seconds}"]
    native, python = (
        run(hastened(load("fault_tolerant_cruise", settings=settings, step=step), haste), kind=kind, figures=False)
        for kind in ("auto", "python")
    )
    for name in native.names():
        assert (native[name] == python[name]).all(), name
    if seconds > 10.0:  # every actuator was at fault, and all are well again
        faults = np.array([native[f"faults[{i}].fault_size[{j}]"] for i in (1, 2, 3) for j in (1, 2, 3)])
        assert (faults.max(axis=1) > 15e3).all()
        assert not faults[:, -1].any()


def hastened(system, factor):
    """The system with its fault schedule run through that many times as fast."""
    for name, instance in system.instances.items():
        if name.startswith("faults"):
            instance.build["schedule"] = [
                row | {key: row[key] / factor for key in ("from", "until")} for row in instance.build["schedule"]
            ]
    return system


@pytest.mark.long
def test_an_observer_beside_the_controller_sees_the_same():
    """`StateFaultObserver`, given the command one point older, repeats the controller's own estimates bit for bit."""
    system = load(
        "fault_tolerant_cruise", preset="nominal", settings=["simulation.stop_time=5.0", "simulation.record=0.01"]
    )
    system.add("observer", "StateFaultObserver")
    for name in ("position", "speed"):
        system.connect(f"train[2].{name}", f"observer.{name}")
    system.connect("cruise[2].force", "observer.force", delay=1)
    result = run(system)
    for j in (1, 2, 3):
        inside, beside = (result[f"{name}.fault_estimate[{j}]"] for name in ("cruise[2]", "observer"))
        assert (beside == inside).all()
        # This one depends directly on the command: it is reported a step after the state it belongs to.
        inside, beside = (result[f"{name}.actuator_force_estimate[{j}]"] for name in ("cruise[2]", "observer"))
        assert (beside[1:] == inside[:-1]).all()
        inside, beside = (result[f"{name}.acceleration_estimate[{j}]"] for name in ("cruise[2]", "observer"))
        assert (beside == inside).all()
