"""Model exchange: FMPy's CVode integrates our FMUs and comes to what co-simulation comes to, the nearer the finer.

Inputs are drawn and jump a few times; what is compared is all real outputs, away from jumps and samples. One reference
is independent of both: the train's equation of motion, integrated by SciPy up to the event at which it stands.
"""

import contextlib
import io
import itertools
import os
import random

import fmpy
import numpy as np
import pytest
from fmpy.validation import validate_fmu
from railcosim.components import CATALOGUE
from railcosim.components.declarations import Input
from railcosim.fmus.build import build
from railcosim.fmus.description import default_step
from scipy.integrate import solve_ivp

pytestmark = pytest.mark.filterwarnings("ignore")

AMPLITUDES = {"N": 1e5, "m": 2.0, "m/s": 10.0, "m/s2": 0.1, "N/kg": 0.01}
PARTS = 4
"""Communication steps in a period: what is compared are the points in the middle."""
LOOSE, TIGHT = (1e-5, 1), (1e-10, 16)
"""CVode's relative tolerance, and into how many parts each step of co-simulation's integration is divided."""
ENERGIES = {"energy_residual"}
"""A difference of energies, small beside each."""
NEAR = {"CoupledSubwayTrain": 1e-5, "Consist": 1e-5, "FreightTrain": 2e-4}
"""How near real outputs come at the tighter tolerance where couplers are stiff, relative above one unit."""
USUAL = 1e-6


def exported(name, fmi="2"):
    return str(build(name, kind="native", profile="model-exchange", fmi=fmi))


def drawn(component, rng, jumps, stop):
    """Inputs that are constant between jumps; trips are left alone."""
    columns = {}
    for slot in component.of(Input):
        start = np.ravel(component.present_values[slot.name]) if slot.type is not str else []
        low, high = (
            b if b is not None else s * np.inf
            for b, s in ((slot.declaration.minimum, -1), (slot.declaration.maximum, 1))
        )
        for n, own in enumerate(start):
            values = [own] * len(jumps)
            if slot.type is bool:
                values = [bool(own != (k % 3 == 2)) for k in range(len(jumps))]
            elif slot.type is float and slot.name != "trip_time":
                swing = AMPLITUDES.get(slot.unit, 1.0)
                values = [float(np.clip(own + swing * rng.uniform(-1.0, 1.0), low, high)) for _ in jumps]
            columns[slot.scalars[n]] = ({float: float, int: np.int32, bool: np.bool_}[slot.type], values)
    if not columns:
        return None
    edges = [(t, k) for k, pair in enumerate(itertools.pairwise([*jumps, stop])) for t in pair]
    rows = [(t, *(values[k] for _, values in columns.values())) for t, k in edges]
    return np.array(rows, dtype=[("time", float), *((name, kind) for name, (kind, _) in columns.items())])


def moving(name):
    """Start values of what moves when it begins."""
    variables = fmpy.read_model_description(exported(name)).modelVariables
    return {v.name: 8.0 for v in variables if v.name.startswith(("speed_start", "vehicle_speed_start"))}


def deviation(name, seed, fineness, periods=100):
    """The output that departs most, and by how much."""
    tolerance, parts = fineness
    component, rng = CATALOGUE[name](), np.random.default_rng(seed)
    period = default_step(component)
    jumps = [0.0, *((k + 0.25) * period for k in sorted(set(rng.integers(1, periods - 1, 6).tolist())))]
    described = fmpy.read_model_description(exported(name))
    names = {v.name for v in described.modelVariables}
    outputs = [v.name for v in described.modelVariables if v.causality == "output"]
    starts = moving(name)
    starts |= {"sample_time": period} if "sample_time" in names else {}
    starts |= {"max_step": component.present_values["max_step"] / parts} if "max_step" in names else {}
    how = {
        "stop_time": periods * period,
        "output_interval": period / PARTS,
        "start_values": starts,
        "input": drawn(component, rng, jumps, (periods + 1) * period),
        "output": outputs,
        "record_events": False,
    }
    with contextlib.redirect_stdout(io.StringIO()):
        one = fmpy.simulate_fmu(
            exported(name), fmi_type="ModelExchange", solver="CVode", relative_tolerance=tolerance, **how
        )
        other = fmpy.simulate_fmu(exported(name), fmi_type="CoSimulation", step_size=period / PARTS, **how)
    assert len(one) == len(other) == periods * PARTS + 1
    middle = [
        k for k in range(PARTS // 2, len(one), PARTS) if min(abs(other["time"][k] - t) for t in jumps) > period / 8
    ]
    assert len(middle) > periods // 2
    worst = {
        n: np.abs(one[n][middle].astype(float) - other[n][middle]).max() / max(1.0, np.abs(other[n][middle]).max())
        for n in outputs
        if n not in ENERGIES
    }
    return max(worst.items(), key=lambda item: item[1], default=("", 0.0))


CASES = sorted(CATALOGUE)
SOME = sorted(random.Random(19).sample(CASES, 1))
"""What the long tier tries of the campaign, beside a train."""
TRAINS = ["PointMassTrain"]


TRIED = [
    pytest.param(name, marks=pytest.mark.long if name in {*SOME, *TRAINS} else pytest.mark.campaign) for name in CASES
]


@pytest.mark.parametrize("name", TRIED)
def test_cvode_comes_to_what_co_simulation_comes_to(name):
    seeds = range(int(os.environ.get("EXCHANGE_SEEDS", "2")))
    for seed in seeds:
        output, found = deviation(name, seed, TIGHT)
        assert found <= NEAR.get(name, USUAL), (seed, output, found)


@pytest.mark.parametrize(
    "name",
    [
        pytest.param("PointMassTrain", marks=pytest.mark.long),
        *(pytest.param(train, marks=pytest.mark.campaign) for train in ("Consist", "LineTrain", "FreightTrain")),
    ],
)
def test_it_comes_the_nearer_the_finer_both_are(name):
    loose, tight = deviation(name, 0, LOOSE)[1], deviation(name, 0, TIGHT)[1]
    assert tight < 0.1 * loose


@pytest.mark.parametrize("fmi", ["2", "3"])
@pytest.mark.parametrize("name", TRIED)
def test_checkers_find_nothing(name, fmi, need):
    need("fmu_manipulation_toolbox")
    from fmu_manipulation_toolbox.checker import OperationGenericCheck
    from fmu_manipulation_toolbox.operations import FMU

    assert validate_fmu(exported(name, fmi)) == []
    check = OperationGenericCheck()
    FMU(exported(name, fmi)).apply_operation(check)
    assert check.compliant_with_version


@pytest.mark.parametrize("fmi", ["2", "3"])
@pytest.mark.parametrize("name", TRIED)
def test_the_co_simulation_beside_it_is_that_of_the_fmu_without(name, fmi):
    component, rng = CATALOGUE[name](), np.random.default_rng(5)
    how = {"stop_time": 5.0, "output_interval": 0.1}
    if fmi == "2":  # by scalars
        how |= {"start_values": moving(name), "input": drawn(component, rng, [0.0, 1.3, 2.5, 4.0], 5.1)}
    with contextlib.redirect_stdout(io.StringIO()):
        one, other = (
            fmpy.simulate_fmu(str(path), fmi_type="CoSimulation", **how)
            for path in (exported(name, fmi), build(name, kind="native", fmi=fmi))
        )
    assert one.tobytes() == other.tobytes()


def constant(name, fmi, rng):
    """Inputs that are constant and move what there is to move, by names of scalars or of arrays."""
    found = {}
    for slot in CATALOGUE[name]().of(Input):
        if slot.type is not float or slot.name == "trip_time" or not slot.scalars:
            continue
        low, high = slot.declaration.minimum, slot.declaration.maximum
        swing = AMPLITUDES.get(slot.unit, 1.0) * rng.uniform(-1.0, 1.0, len(slot.scalars))
        values = np.clip(np.ravel(slot.start) + swing, -np.inf if low is None else low, high)
        if fmi == "3":
            found[slot.name] = values.tolist() if slot.shape else values[0]
        else:
            found |= dict(zip(slot.scalars, values, strict=True))
    return found


@pytest.mark.parametrize("name", TRIED)
def test_fmi_3_comes_to_the_bits_of_fmi_2(name):
    """Behind CVode, which calls both alike. FMPy cannot mix inputs over time that are arrays with others."""
    component, found = CATALOGUE[name](), []
    arrays = any(slot.shape for slot in component.of(Input))
    period = default_step(component)
    jumps = [0.0, 7.25 * period, 31.25 * period]
    for fmi in ("2", "3"):
        rng = np.random.default_rng(3)
        with contextlib.redirect_stdout(io.StringIO()):
            result = fmpy.simulate_fmu(
                exported(name, fmi),
                fmi_type="ModelExchange",
                solver="CVode",
                stop_time=60 * period,
                output_interval=period,
                start_values=constant(name, fmi, rng) if arrays else {},
                input=None if arrays else drawn(component, rng, jumps, 61 * period),
            )
        found.append([np.reshape(result[n], (len(result), -1)) for n in result.dtype.names])
    assert len(found[1][0]) >= 61
    two, three = (np.hstack([column.astype(float) for column in columns]) for columns in found)
    assert three.tobytes() == two.tobytes()


@pytest.mark.long
def test_a_train_brakes_to_rest_rests_and_departs_as_scipy_has_it():
    """m v' = F - m (c0 + c1 v + c2 v^2) while it moves; at rest it moves not at all."""
    mass, c0, c1, c2 = 400e3, 0.01176, 0.00077616, 0.00016
    forces = [(0.0, -2e5), (60.0, -2e5), (60.0, 3e5), (80.0, 3e5)]

    def motion(force):
        return lambda t, x: [x[1], force / mass - (c0 + c1 * x[1] + c2 * x[1] ** 2)]

    def stands(_, x):
        return x[1]

    stands.terminal, stands.direction = True, -1
    how = {"rtol": 1e-12, "atol": 1e-12, "method": "DOP853"}
    braking = solve_ivp(motion(-2e5), (0.0, 60.0), [0.0, 20.0], events=stands, **how)
    (stop,), place = braking.t_events[0], braking.y_events[0][0][0]
    leaving = solve_ivp(motion(3e5), (60.0, 80.0), [place, 0.0], **how)
    result = fmpy.simulate_fmu(
        exported("PointMassTrain"),
        fmi_type="ModelExchange",
        solver="CVode",
        relative_tolerance=1e-10,
        stop_time=80.0,
        output_interval=0.5,
        record_events=False,
        start_values={"speed_start": 20.0},
        input=np.array(forces, dtype=[("time", float), ("force", float)]),
        output=["position", "speed"],
    )
    rests = (result["time"] > stop) & (result["time"] < 60.0)
    assert np.count_nonzero(rests) > 40
    assert set(result["speed"][rests]) == {0.0}
    assert np.ptp(result["position"][rests]) == 0.0
    assert result["position"][rests][0] == pytest.approx(place, abs=1e-6)
    assert result["position"][-1] == pytest.approx(leaving.y[0, -1], abs=1e-6)
    assert result["speed"][-1] == pytest.approx(leaving.y[1, -1], abs=1e-7)


@pytest.mark.long
def test_a_train_rests_where_the_solver_has_no_steps_but_its_samples():
    """Euler's steps end where samples are due: what passes its standstill in one stands before the sample is taken."""
    result = fmpy.simulate_fmu(
        exported("SubwayTrain"),
        fmi_type="ModelExchange",
        solver="Euler",
        step_size=0.01,
        output_interval=0.01,
        stop_time=10.0,
        record_events=False,
        start_values={"speed_start": 2.0, "sample_time": 0.01},
        input=np.array([(0.0, -2e5)], dtype=[("time", float), ("force", float)]),
        output=["position", "speed"],
    )
    (arrived, *_) = np.flatnonzero(result["speed"] == 0.0)
    assert 10 < arrived < 900
    assert set(result["speed"][arrived:]) == {0.0}
    assert np.ptp(result["position"][arrived:]) == 0.0
    assert min(result["speed"]) == 0.0
