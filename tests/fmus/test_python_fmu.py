"""Python FMUs in FMPy give what plain Python gives, many at a time and one life after another."""

import math
import subprocess
import sys

import fmpy
import numpy as np
import pytest
from railcosim.components import CATALOGUE, ComponentError, simulate
from railcosim.components.declarations import Input, Memory, State, Tape
from railcosim.components.tracing import start_name
from railcosim.fmus.build import build, build_component
from railcosim.fmus.references import resolve

STEP = 0.125  # s; a power of two, so that every importer's arithmetic on time is exact
ARGUMENTS = {
    "Schedule": {"points": 3},
    "Chain": {"masses": 4},
    "RadioLink": {"messages": 4, "outages": [[1.0, 1.4]]},
    "Line": {"line": [{"position": -2.0, "gradient": 0.01}, {"position": 1.0, "gradient": -0.02, "radius": 7e3}]},
}
AGED = {"age_limit": 0.2, "degraded_age": 0.5}
STARTS = {
    "Schedule": {"times": [0.0, 0.5, 1.5], "values": [1.0, -2.0, 4.0], "interpolate": True},
    "Gust": {"start_time": 0.5, "stop_time": 1.0},
    "PointMassTrain": {"position": 20.0, "speed": 12.0, "limit_force": True, "traction_limit": 1e5, "max_step": 0.05},
    "ComfortCruise": AGED,
    "TunablePotentialCruise": AGED,
    "FixedDistanceCruise": AGED,
    "RangePotentialCruise": AGED | {"gap_min": 15e3, "gap_max": 20e3},
    "RadioLink": {"seed": 5, "delay": 0.3, "jitter": 0.3, "loss": 0.2, "burst_begin": 0.3},
    "Dice": {"seed": 7, "deviation": 0.5},
    "Everything": {"seed": 11, "mode": "süß", "x": [1.0, -2.0]},
}
SIZES = {"N": 4e5, "m/s": 20.0, "m/s2": 0.5, "m": 4.0}
PLACES = {"ahead_position": 15e3, "behind_position": -16e3, "leader_position": 40e3}


def excitation(component, step):
    """Inputs over time for any component: every one of them moves, trips change while the train waits."""

    def at(t):
        k = round(t / step)
        values = {}
        for number, slot in enumerate(component.of(Input)):
            if slot.name == "trip":
                values["trip"] = 1 + (k + 2) // 8
            elif slot.name == "trip_time":
                values["trip_time"] = ((k + 2) % 8 - 2) * step
            elif slot.type is not str:
                cells = [_signal(slot, number + 0.7 * c, t) for c in range(len(slot.scalars))]
                values[slot.name] = np.array(cells).reshape(slot.shape) if slot.shape else cells[0]
        return values

    return at


def _signal(slot, phase, t):
    wave = math.sin(3.0 * t + phase)
    if slot.type is bool:
        return wave > 0.2
    if slot.type is int:
        return round(5.0 * wave)
    # Whole multiples of 1/64, so that an importer that interpolates between points hits them exactly.
    return PLACES.get(slot.name, 0.0) + round(64.0 * SIZES.get(slot.unit, 1.0) * wave) / 64.0


def prepared(reference, step, sampling=1):
    """Build arguments and start values that make any component do something."""
    cls = resolve(reference)
    arguments = ARGUMENTS.get(cls.__name__, {})
    component = cls(**arguments)
    starts = dict(STARTS.get(cls.__name__, {}))
    if component.is_sampled:
        starts["sample_time"] = step / sampling
    for noise in component.noises.values():
        starts[noise.hold.name] = step / sampling
    if any(isinstance(slot.declaration, Tape) for slot in component.slots.values()):
        starts |= {"tape_duration": 8 * step, "tape_cutoff": 0.3 / step}
    return cls, arguments, starts


def scalars(component, values):
    """Values by slot as values by FMI name."""
    found = {}
    for name, value in values.items():
        slot = component.slots[name]
        cells = np.ravel(np.broadcast_to(np.asarray(value, dtype=object), slot.shape)) if slot.shape else [value]
        found |= dict(zip(slot.scalars, cells, strict=True))
    return found


def begun(component, name):
    """What holds the start value of a variable: of a state, a parameter."""
    kept = any(name in slot.scalars for slot in component.of(State, Memory))
    return start_name(name) if kept else name


# ---------------------------------------------------------------- the same numbers as in plain Python


@pytest.mark.few
@pytest.mark.parametrize(
    ("step", "sampling"),
    [(STEP, 2), *(pytest.param(*case, marks=pytest.mark.long) for case in ((STEP, 1), (0.1, 1), (0.1, 4)))],
)
def test_fmpy_gives_what_plain_python_gives(reference, unpack, built, step, sampling):
    """FMPy against components.simulate: the same bits where FMPy's arithmetic on time is exact, else 1e-12 of the
    signal's size.

    ``sampling`` samples per communication step where the component is sampled.
    """
    cls, arguments, starts = prepared(reference, step, sampling)
    count = 24
    expected = simulate(cls(**arguments, **starts), count * step, step, excitation(cls(**arguments), step))
    component = cls(**arguments)
    columns = [
        {"time": k * step, **scalars(component, excitation(component, step)(k * step))} for k in range(count + 1)
    ]
    kinds = {n: s.type for s in component.slots.values() for n in s.scalars} | {"time": float}
    signals = np.array([tuple(c.values()) for c in columns], dtype=[(n, kinds[n]) for n in columns[0]])
    outputs = [slot for slot in component.output_slots if slot.type is not str]
    result = fmpy.simulate_fmu(
        str(unpack(built(reference, arguments))),
        stop_time=count * step,
        output_interval=step,
        start_values={begun(component, name): value for name, value in scalars(component, starts).items()},
        input=signals if len(columns[0]) > 1 else None,
        output=[name for slot in outputs for name in slot.scalars],
    )
    assert result["time"] == pytest.approx(expected["time"], abs=1e-12)
    for slot in outputs:
        own = expected[slot.name].reshape(count + 1, -1).T
        for name, column in zip(slot.scalars, own, strict=True):
            if step == STEP:
                assert np.array_equal(result[name], column), name
            else:
                # Relative to the signal's size: where it passes through zero, its rounding errors do not.
                size = max(1.0, float(np.abs(column).max()))
                np.testing.assert_allclose(result[name], column, rtol=1e-12, atol=1e-12 * size, err_msg=name)


@pytest.mark.long
def test_the_excitation_moves_every_number(reference):
    """The comparison above would be idle on signals that stand still; flags and schedules of the catalogue may."""
    cls, arguments, starts = prepared(reference, STEP)
    result = simulate(cls(**arguments, **starts), 3.0, STEP, excitation(cls(**arguments), STEP))
    still = {name for name, column in result.items() if (column == column[0]).all()}
    if cls.__name__ in CATALOGUE:
        assert still < result.keys() - {"time"}
    else:
        assert still <= {"echo", "last_step"}


def test_texts_come_through(instantiate, sample):
    instance = instantiate(sample("Types"))
    instance.enter(label="Zug nach Köln", remark="über Düren")
    assert instance.get("text") == "Zug nach Köln über Düren"
    instance.set({"doors[2]": True})
    assert instance.get("text") == "door open"
    assert (instance.get("closed[1]"), instance.get("closed[2]")) == (True, False)


def test_values_of_the_component_become_starts_without_the_importer_setting_them(instantiate, component_class, sample):
    train = component_class("PointMassTrain")(speed=12.5, mass=3e5, limit_force=True)
    instance = instantiate(build_component(train)).initialize()
    assert [instance.get(n) for n in ("speed", "mass", "limit_force", "position")] == [12.5, 3e5, True, 0.0]
    chain = component_class(sample("Chain"))(masses=2, position=[1.0, -1.0], stiffness=3.0)
    instance = instantiate(build_component(chain)).initialize()
    assert instance.get("tension[1]") == 6.0
    assert instantiate("PointMassTrain").initialize().get("speed") == 0.0


def test_outputs_are_fresh_during_initialization_and_after_a_set(instantiate):
    instance = instantiate("PointMassTrain").enter(c0=0.0, c1=0.0, c2=0.0)
    instance.set({"force": 4e5})
    assert instance.get("acceleration") == 1.0
    instance.start()
    instance.set({"force": 8e5})
    assert instance.get("acceleration") == 2.0
    instance.set({"line_resistance": 0.5, "disturbance": -0.25})
    assert instance.get("acceleration") == 1.25


def test_a_computed_start_follows_the_input_set_in_initialization_mode(instantiate, sample):
    instance = instantiate(sample("Estimator")).enter()
    instance.set({"measured": 5.0})
    assert instance.get("estimate") == 4.75
    instance.set({"measured": 6.0})
    assert instance.get("estimate") == 5.75


def test_an_array_is_set_element_by_element_while_a_start_is_computed_from_it(write_component, instantiate):
    """`initial` must not be asked between two elements: half an array may be outside its domain."""
    reference = write_component(
        "from railcosim.components import Component, Input, Memory, Output, maths\n\n\n"
        "class C(Component):\n"
        "    u = Input('m', shape=(2,))\n"
        "    m = Memory('m')\n"
        "    y = Output('m')\n\n"
        "    def initial(self):\n"
        "        return {'m': maths.log(self.u[0] * self.u[1])}\n\n"
        "    def outputs(self):\n"
        "        return {'y': self.m}\n\n"
        "    def update(self):\n"
        "        return {'m': self.m}\n"
    )
    instance = instantiate(reference).enter()
    instance.set({"u[1]": math.e, "u[2]": 1.0})
    assert instance.get("y") == 1.0


def test_time_starts_where_the_importer_says(instantiate):
    instance = instantiate("Gust")
    instance.call("setupExperiment", None, 215.0)
    instance.call("enterInitializationMode")
    assert instance.get("acceleration") == -0.5
    instance.start()
    instance.time = 215.0
    assert [row["acceleration"] for row in instance.step(12.5, 3)] == [-0.5, 0.0, 0.0]


# ---------------------------------------------------------------- the whole state


def drive(instance, component, k, count):
    """Some steps of the excitation from step k on; every value that can be read after each."""
    rows = []
    for n in range(k, k + count):
        instance.set(scalars(component, excitation(component, STEP)(n * STEP)))
        instance.step(STEP)
        rows.append(instance.everything())
    return rows


def warm(instantiate, reference):
    cls, arguments, starts = prepared(reference, STEP, 2)
    component = cls(**arguments)
    instance = instantiate(reference, arguments)
    instance.initialize(**scalars(component, starts))
    drive(instance, component, 0, 11)
    return instance, component


@pytest.mark.few
def test_save_run_restore_run_is_bit_equal(reference, instantiate):
    """Past the change of a trip, so that a tape holds something, and once more after the restore."""
    instance, component = warm(instantiate, reference)
    time, before = instance.time, instance.everything()
    state = instance.call("getFMUState")
    first = drive(instance, component, 11, 9)
    instance.call("setFMUState", state)
    instance.time = time
    assert instance.everything() == before
    assert drive(instance, component, 11, 9) == first
    instance.call("freeFMUState", state)


@pytest.mark.few
def test_a_serialized_state_continues_in_another_instance(reference, instantiate):
    instance, component = warm(instantiate, reference)
    state = instance.call("getFMUState")
    data = instance.call("serializeFMUstate", state)
    first = drive(instance, component, 11, 9)
    _, arguments, starts = prepared(reference, STEP, 2)
    other = instantiate(reference, arguments).initialize(**scalars(component, starts))
    other.call("setFMUState", other.call("deSerializeFMUstate", data))
    other.time = 11 * STEP
    assert drive(other, component, 11, 9) == first


def test_a_saved_state_is_a_copy(instantiate, sample):
    """What is saved must not move on with the instance."""
    instance = instantiate(sample("Everything")).initialize()
    state = instance.call("getFMUState")
    data = instance.call("serializeFMUstate", state)
    instance.step(0.1, 3)
    assert instance.call("serializeFMUstate", state) == data


def test_a_state_of_another_component_is_refused(instantiate, sample):
    data = (one := instantiate("Gust").initialize()).call("serializeFMUstate", one.call("getFMUState"))
    other = instantiate("PointMassTrain").initialize()
    state = other.call("deSerializeFMUstate", data)
    message = other.refused("call", "setFMUState", state)
    assert "a saved state of Gust does not fit this PointMassTrain" in message


def test_a_corrupt_state_is_refused(instantiate):
    instance = instantiate("Gust").initialize()
    data = instance.call("serializeFMUstate", instance.call("getFMUState"))
    for broken in (data[:-9], b"\xff\x00", b"{}"):
        instance = instantiate("Gust").initialize()
        state = instance.call("deSerializeFMUstate", broken)
        assert "ValueError: the serialized state is corrupt" in instance.refused("call", "setFMUState", state)


@pytest.mark.few
def test_reset_gives_a_new_life(reference, instantiate):
    cls, arguments, starts = prepared(reference, STEP, 2)
    component = cls(**arguments)
    instance = instantiate(reference, arguments)
    virgin = instance.everything()
    lives = []
    for _ in range(2):
        instance.initialize(**scalars(component, starts))
        lives.append(drive(instance, component, 0, 11))
        instance.call("reset")
        instance.time = 0.0
        assert instance.everything() == virgin
    assert lives[0] == lives[1]


# ---------------------------------------------------------------- many instances


@pytest.mark.long
def test_two_hundred_interleaved_instances_do_not_disturb_each_other(instantiate, sample):
    kinds = [build(r) for r in (sample("Everything"), sample("Counter"), "PointMassTrain", sample("Dice"))]
    alone = {}
    for kind in kinds:
        for seed in range(3):
            instance = instantiate(kind)
            alone[kind, seed] = instance.initialize(**_different(instance, seed)).step(0.1, 3)
    crowd = []
    for k in range(200):
        instance = instantiate(kinds[k % 4], name=f"number {k}")
        crowd.append((kinds[k % 4], k % 3, instance.initialize(**_different(instance, k % 3))))
    rows = [[] for _ in crowd]
    for _ in range(3):
        for row, (_, _, instance) in zip(rows, crowd, strict=True):
            row.extend(instance.step(0.1))
    for row, (kind, seed, _) in zip(rows, crowd, strict=True):
        assert row == alone[kind, seed]


def _different(instance, seed):
    if "seed" in instance.variables:
        return {"seed": seed}
    return {"speed" if "speed" in instance.variables else "u": float(seed)}


CYCLES = """
import sys, shutil, tempfile, gc
from fmpy import read_model_description, extract
from fmpy.fmi2 import FMU2Slave
folder = extract(sys.argv[1], unzipdir=tempfile.mkdtemp())
description = read_model_description(folder)
kept, counts = [], []
for k in range(300):
    fmu = FMU2Slave(guid=description.guid, unzipDirectory=folder, instanceName="x",
                    modelIdentifier=description.coSimulation.modelIdentifier)
    fmu.instantiate()
    if k % 3 == 0:
        fmu.setupExperiment(); fmu.enterInitializationMode(); fmu.exitInitializationMode(); fmu.doStep(0.0, 0.1)
        fmu.reset()
    if k % 50 == 0:
        kept.append(fmu)
    else:
        fmu.freeInstance()
    if k == 10:
        try:
            broken = FMU2Slave(guid=description.guid, unzipDirectory=folder, instanceName="y",
                               modelIdentifier=description.coSimulation.modelIdentifier)
            broken.instantiate()
            broken.doStep(0.0, 0.1)
        except Exception as error:
            assert error.status == 4
            broken.freeInstance()
    if k % 20 == 0:
        gc.collect()
        (slave,) = [module for name, module in sys.modules.items() if name.endswith("_slave") and "." not in name]
        counts.append((sys.getrefcount(vars(slave)), len(kept)))
for fmu in kept:
    fmu.setupExperiment(); fmu.enterInitializationMode(); fmu.exitInitializationMode(); fmu.doStep(0.0, 0.1)
    fmu.terminate(); fmu.freeInstance()
assert len({count for count, _ in counts}) == 1, counts
assert slave.Slave.component.__name__ == "Gust" and vars(slave)["__name__"].endswith("_slave")
shutil.rmtree(folder)
print("survived", k + 1)
"""


def test_three_hundred_lives_in_one_process():
    """pythonfmu's wrapper gives back a reference that it never took; without the slave's remedy this crashes."""
    done = subprocess.run(
        [sys.executable, "-c", CYCLES, str(build("Gust"))], capture_output=True, text=True, timeout=60, check=False
    )
    assert (done.returncode, done.stdout.strip()) == (0, "survived 300"), done.stderr[-2000:]


def test_a_tape_file_carries_learning_to_the_next_life(instantiate, sample, tmp_path):
    def life(tape):
        instance = instantiate(sample("Learner")).initialize(sample_time=0.125, tape_duration=1.0, tape_file=str(tape))
        instance.set({"error": 1.0, "trip_time": 0.0})
        command = instance.get("command")
        instance.step(0.125)
        instance.call("terminate")
        return command

    tape = tmp_path / "gelernt süß.tape"
    assert [life(tape), life(tape), life(tape)] == [0.0, 0.5, 1.0]


def test_a_component_that_is_unusable_as_built_is_refused_before_it_is_an_fmu(sample):
    with pytest.raises(
        ComponentError, match="Chain: build argument 'masses' takes a whole number of at least 2, not 1"
    ):
        build(sample("Chain"), {"masses": 1})
