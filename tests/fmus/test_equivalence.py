"""Plain Python, Python FMU and native FMU give the same numbers, for every component there is.

Parameters, start values, inputs and steps are drawn from the declarations, inside their bounds; nothing is written down
per component, so that a new one cannot escape.
"""

import ast
import contextlib
import functools
import math
import os
import tempfile
import zipfile
from dataclasses import dataclass
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.fmi2 import FMU2Slave
from hypothesis import HealthCheck, Phase, find, given, reject, settings
from hypothesis import strategies as st
from hypothesis.errors import NoSuchExample
from railcosim.components import CATALOGUE, ComponentError, Simulation
from railcosim.components.component import evaluated
from railcosim.components.declarations import Input, Memory, Parameter, Size, State, Tape
from railcosim.fmus.build import build
from railcosim.fmus.references import resolve
from railcosim.fmus.variables import scalar_variables
from railcosim.orchestrator import load, run

HERE = Path(__file__).parent
SAMPLES = (HERE.parent / "components" / "samples.py", HERE / "native_samples.py")
COMPUTED_TEXTS = {"Types", "Everything"}
"""The only samples that cannot be native; they are compared as Python FMUs."""
MODELS = Path(__file__).parents[2] / "models"
SCALES = {"m": 1e3, "m/s": 30.0, "m/s2": 1.0, "N": 1e5, "N/kg": 0.1, "s": 10.0, "kg": 1e5}
"""How large an input or a start value of zero may become, by its unit."""
PLACES = {"ahead_position": (3.2e3, 17.5e3), "behind_position": (-17.5e3,), "leader_position": (40e3,)}
"""Where the neighbours of a train near zero are, m: the cruise ports' inputs, for controllers of either range."""
IDLE = {"Line"}
"""Components whose default data give one value everywhere."""


def cases():
    """Every component with its default build arguments, and with other sizes: the smallest it allows, or larger."""
    found = list(CATALOGUE)
    for path in SAMPLES:
        found += [f"{path}:{node.name}" for node in ast.parse(path.read_text()).body if isinstance(node, ast.ClassDef)]
    for reference in found:
        declarations = resolve(reference).declarations
        sizes = {name: d for name, d in declarations.items() if isinstance(d, Size)}
        others = {name: d.minimum if d.minimum < d.default else d.default + 2 for name, d in sizes.items()}
        for arguments in [{}, others] if others else [{}]:
            try:
                resolve(reference)(**arguments)
            except ComponentError:  # its data are for another size
                continue
            name = reference.rpartition(":")[2]
            yield pytest.param(reference, arguments, id=name + "".join(f"-{v}" for v in arguments.values()))


pytestmark = [
    pytest.mark.filterwarnings("ignore:.* encountered in:RuntimeWarning"),  # runs that leave the domain
    pytest.mark.unmeasured,
]

CASES = list(cases())
FEW = {"PointMassTrain", "ComfortCruise", "Cailc", "RadioLink", "Timetable", "Consist-1"}
"""Beside the samples, those that are run here with every change; all are in the long tier."""
every_component = pytest.mark.parametrize(("path", "arguments"), CASES)


# ---------------------------------------------------------------- what is run


@dataclass(frozen=True)
class Script:
    """One run: start values by slot, and for each step the time, its length, inputs and tunable parameters to set."""

    start_time: float
    starts: dict
    steps: list


def reals(slot, wide):
    """Real numbers for a slot: inside its bounds, near its start value, or as large as its unit lets expect."""
    start = float(np.ravel(np.asarray(slot.start, dtype=float))[0]) if np.size(slot.start) else 0.0
    if start != 0.0 and not wide:
        ends = sorted((0.5 * start, 2.0 * start))
    else:
        scale = max(abs(start), SCALES.get(slot.unit, 1.0))
        ends = [start - scale, start + scale]
    low, high = slot.declaration.minimum, slot.declaration.maximum
    low = ends[0] if low is None else max(low, ends[0]) if low < ends[1] else low
    high = ends[1] if high is None else min(high, ends[1]) if high > ends[0] else high
    return low, high


def cell(slot, wide=False):
    if slot.type is bool:
        return st.booleans()
    if slot.type is str:
        return st.text('aä%#"\\ ', max_size=5)
    if slot.type is int:
        low, high = slot.declaration.minimum, slot.declaration.maximum
        start = int(np.ravel(slot.start)[0])
        return st.integers(start - 3 if low is None else int(low), start + 3 if high is None else int(high))
    return st.floats(*reals(slot, wide))


def values(slot, wide=False):
    if not slot.shape:
        return cell(slot, wide)
    count = math.prod(slot.shape)
    kind = object if slot.type is str else slot.type
    return st.lists(cell(slot, wide), min_size=count, max_size=count).map(
        lambda cells: np.array(cells, dtype=kind).reshape(slot.shape)
    )


def random_value(slot, rng, places):
    """A value of an input; drawn without hypothesis, which would spend the time on shrinking signals."""
    if slot.type is str:
        return "".join(rng.choice(list("abc ")) for _ in range(3))
    if slot.type is bool:
        drawn = rng.random(slot.shape) < 0.5
    elif slot.type is int:
        drawn = np.asarray(slot.start) + rng.integers(-3, 4, slot.shape)
    else:
        drawn = places.get(slot.name, 0.0) + rng.uniform(*reals(slot, wide=True), slot.shape)
    return drawn if slot.shape else drawn.item()


@st.composite
def scripts(draw, component):
    """A run of a component."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    places = {name: draw(st.sampled_from(choices)) for name, choices in PLACES.items()}
    has_tape = any(component.of(Tape))
    starts = {}
    computed = evaluated(component, "initial")
    for slot in component.of(Parameter, State, Memory):
        if slot.name not in computed and slot.name != "tape_file" and draw(st.booleans()):
            starts[slot.name] = draw(values(slot))
    step = draw(st.sampled_from([0.125, 0.1, 0.3, 0.01, 1.0 / 3.0, 20.0]))
    lengths = [step] * 8
    if component.is_sampled:
        once_a_step = not has_tape and not component.declarations["sample_time"].minimum and draw(st.booleans())
        starts["sample_time"] = 0.0 if once_a_step else step / draw(st.integers(1, 4))
        if not has_tape and starts["sample_time"] > 0.0:
            parts = draw(st.lists(st.sampled_from([1, 2, 3, 0.5, 0.25, 0.7, 1e-10]), min_size=6, max_size=6))
            lengths = [starts["sample_time"] * part for part in parts]
    for noise in component.noises.values():
        starts[noise.hold.name] = step * draw(st.sampled_from([0.25, 0.5, 1.0, 2.5, 3.0]))
    if not component.is_sampled or (starts["sample_time"] == 0.0 and draw(st.booleans())):
        lengths = draw(st.lists(st.floats(0.01, 0.5), min_size=6, max_size=6))
    if "max_step" in component.slots:
        starts["max_step"] = draw(st.sampled_from([0.0, 0.1, 0.04, step / 3.0, 1.0]))
    if has_tape:
        lengths = [step] * 20
        starts["tape_duration"] = 10 * step
        starts["tape_cutoff"] = draw(st.sampled_from([0.0, 0.02, 0.3, 2.0])) / step
    # Samples of each trip, from the wait before it; trips of several lengths leave the tape's end to earlier ones.
    trips = [(trip + 1, place) for trip in range(20) for place in range(-rng.integers(1, 3), rng.integers(1, 6))]
    clocks = [slot for slot in component.of(Parameter) if slot.unit == "s"]
    events = [float(x) for slot in clocks for x in np.ravel(starts.get(slot.name, slot.start))]
    time = start_time = draw(st.sampled_from([0.0, 1.0, -0.7, *(event - 2.5 * step for event in events)]))
    steps = []
    for k, length in enumerate(lengths):
        moved = [slot for slot in component.of(Input) if rng.random() < 0.8 or k == 0]
        given = {slot.name: random_value(slot, rng, places) for slot in moved}
        if has_tape:
            given |= {"trip": trips[k][0], "trip_time": trips[k][1] * step}
        if k == 4:
            given |= {s.name: draw(values(s)) for s in component.of(Parameter) if s.declaration.tunable}
        steps.append((time, length, given))
        time += length
    return Script(start_time, starts, steps)


# ---------------------------------------------------------------- the three ways to run it


def plain(cls, arguments, script):
    """Rows of all outputs: at the start, and for each step after setting the inputs and after stepping."""
    simulation = Simulation(cls(**arguments))
    names = [slot.name for slot in simulation.component.output_slots]

    def row():
        cells = [simulation.get(name) for name in names]
        return [x for value in cells for x in (np.ravel(value) if isinstance(value, np.ndarray) else [value])]

    for name, value in script.starts.items():
        simulation.set(name, value)
    simulation.initialize(script.start_time)
    for name, value in script.steps[0][2].items():
        simulation.set(name, value)
    rows = [row()]
    simulation.start()
    for time, length, changes in script.steps:
        if simulation.time != time:
            simulation.time = time
        for name, value in changes.items():
            simulation.set(name, value)
        rows.append(row())
        simulation.step(length)
        rows.append(row())
    return rows


_TYPES = {float: "Real", int: "Integer", bool: "Boolean", str: "String"}


@functools.cache
def unpacked(reference, arguments, kind):
    folder = tempfile.mkdtemp(dir=os.environ["RAILCOSIM_CACHE"])
    with zipfile.ZipFile(build(reference, dict(arguments), kind=kind)) as archive:
        archive.extractall(folder)
    return folder, fmpy.read_model_description(folder, validate=False)


def packaged(reference, arguments, script, kind):
    """The same rows out of an FMU."""
    folder, description = unpacked(reference, tuple(arguments.items()), kind)
    component = resolve(reference)(**arguments)
    slots, starts = {}, {}
    for variable in scalar_variables(component):
        (starts if variable.is_start else slots).setdefault(variable.slot.name, []).append(variable.reference)
    here = os.getcwd()
    fmu = FMU2Slave(
        guid=description.guid,
        unzipDirectory=folder,
        modelIdentifier=description.coSimulation.modelIdentifier,
        instanceName="it",
    )
    fmu.instantiate()

    def set_all(given):
        for name, value in given.items():
            kind = _TYPES[component.slots[name].type]
            if references := starts.get(name) or slots.get(name):
                getattr(fmu, f"set{kind}")(references, np.ravel(np.asarray(value, dtype=object)).tolist())

    def row():
        cells = []
        for slot in component.output_slots:
            if slots.get(slot.name):
                read = getattr(fmu, f"get{_TYPES[slot.type]}")(slots[slot.name])
                cells += [x.decode() if isinstance(x, bytes) else slot.type(x) for x in read]
        return cells

    try:
        fmu.setupExperiment(startTime=script.start_time)
        set_all(script.starts)
        fmu.enterInitializationMode()
        set_all(script.steps[0][2])
        rows = [row()]
        fmu.exitInitializationMode()
        for time, length, changes in script.steps:
            set_all(changes)
            rows.append(row())
            fmu.doStep(time, length)
            rows.append(row())
        fmu.terminate()
    finally:
        fmu.freeInstance()
        os.chdir(here)
    return rows


def compare(reference, arguments, script):
    cls = resolve(reference)
    try:
        expected = plain(cls, arguments, script)
    except (ArithmeticError, ValueError):  # outside what the equations are made for; ComponentError is one of them
        reject()
    native = reference.rpartition(":")[2] not in COMPUTED_TEXTS
    for kind in ("python", "native") if native else ("python",):
        assert packaged(reference, arguments, script, kind) == expected, kind


# ---------------------------------------------------------------- the tests


def checked(examples, **rest):
    return settings(
        max_examples=examples,
        deadline=None,
        database=None,
        suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
        **rest,
    )


@pytest.mark.sample(10)
@pytest.mark.parametrize(("path", "arguments"), [case for case in CASES if ":" in case.values[0] or case.id in FEW])
def test_plain_python_and_both_kinds_of_fmu_agree_to_the_last_bit(path, arguments):
    @checked(5, derandomize=True)
    @given(scripts(resolve(path)(**arguments)))
    def agree(script):
        compare(path, arguments, script)

    agree()


@pytest.mark.parametrize(
    ("examples", "repeatable"),
    [
        pytest.param(20, True, marks=pytest.mark.long, id="more"),
        pytest.param(60, False, marks=pytest.mark.campaign, id="many, others each time"),
    ],
)
@every_component
def test_they_agree_on_many_more_runs(path, arguments, examples, repeatable):
    large = path.endswith("Train") or path == "DistributedMpc"  # of which each takes seconds

    @checked(examples // 5 if large else examples, derandomize=repeatable)
    @given(scripts(resolve(path)(**arguments)))
    def agree(script):
        compare(path, arguments, script)

    agree()


def test_powers_are_those_of_the_c_library_not_products():
    """A compiler that turns pow(x, 2) into x * x is right to an ulp, and wrong once in a thousand numbers."""
    told_apart = [u for u in np.random.default_rng(0).uniform(-20.0, 20.0, 20_000).tolist() if u**2 != u * u][:5]
    assert told_apart or math.pow(1.1, 2.0) == 1.1 * 1.1  # on a C library whose power is exact there are none
    steps = [(0.1 * k, 0.1, {"u": u}) for k, u in enumerate([1.1, *told_apart])]
    compare(f"{SAMPLES[1]}:Functions", {}, Script(0.0, {}, steps))


def test_only_computed_texts_keep_a_component_from_being_native():
    for case in CASES:
        path, arguments = case.values
        if path.rpartition(":")[2] in COMPUTED_TEXTS:
            with pytest.raises(ComponentError, match="text"):
                build(path, arguments, kind="native")


@pytest.mark.parametrize("path", sorted({case.values[0] for case in CASES}), ids=lambda path: path.rpartition(":")[2])
def test_the_runs_move_something(path):
    """The comparison would be idle on signals that stand still."""

    def moves(arguments, script):
        try:
            rows = plain(resolve(path), arguments, script)
        except (ArithmeticError, ValueError):
            return False
        return any(cell != rows[0][k] for row in rows for k, cell in enumerate(row))

    for arguments in (case.values[1] for case in CASES if case.values[0] == path):
        found = checked(20, derandomize=True, phases=[Phase.generate])
        with contextlib.suppress(NoSuchExample):
            find(scripts(resolve(path)(**arguments)), functools.partial(moves, arguments), settings=found)
            return
    assert path in IDLE


@pytest.mark.long
def test_a_whole_scenario_gives_the_same_results_in_all_three_ways():
    """Wang et al. 2020: five trains, their controllers, target and gust, closed loop over 350 s."""
    runs = {kind: run(load(MODELS / "comfort_cruise.toml"), kind=kind) for kind in ("plain", "python", "native")}
    names = set(runs["plain"].names())
    assert {"train[1].speed", "cruise[4].demand", "gust.acceleration"} <= names
    for kind in ("python", "native"):
        assert set(runs[kind].names()) == names
        assert all(np.array_equal(runs[kind][name], runs["plain"][name]) for name in names), kind
