"""Systems written as scenarios load to equal systems."""

import math
from dataclasses import replace
from datetime import date
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from railcosim.orchestrator.master import ALGORITHMS
from railcosim.orchestrator.scenario.loading import dump, loads
from railcosim.orchestrator.system import ACCELERATIONS, LOOPS, UNSETTLED, Connection, Event, Instance, System

EXAMPLE = Path(__file__).with_name("two_trains.toml").read_text(encoding="utf-8")
TEXTS = st.text(st.characters(exclude_categories=["Cs"]), max_size=8)
SCALARS = st.one_of(st.booleans(), st.integers(-(2**63), 2**63 - 1), st.floats(allow_nan=False), TEXTS)
SIGNALS = st.sampled_from(["x", "speed", "force[2]", "engine.torque"])
VALUES = st.recursive(SCALARS, lambda inner: st.lists(inner, max_size=3), max_leaves=6)
POSITIVE = st.floats(0.0, 1e300, exclude_min=True)
FINITE = st.floats(allow_nan=False, allow_infinity=False)
NUMERICS = {
    "extrapolation": st.integers(0, 2),
    "algebraic_loops": st.sampled_from(LOOPS),
    "refresh": st.booleans(),
    "unsettled": st.sampled_from(UNSETTLED),
    "tolerance": st.floats(1e-300, 0.999),
    "max_iterations": st.integers(1, 2**63 - 1),
    "relaxation": st.floats(1e-300, 2.0),
    "acceleration": st.sampled_from(ACCELERATIONS),
    "min_step": st.floats(1e-300, 1e-3),
    "algorithm": st.sampled_from(sorted(ALGORITHMS)),
}
OPTIONS = {
    "step": POSITIVE,
    "isolate": st.sampled_from([False, True, "together"]),
    "step_timeout": POSITIVE,
    "memory_limit": POSITIVE,
    "swapped": st.booleans(),
}
EVENTS = st.one_of(
    st.builds(Event, SIGNALS, st.just("freeze"), FINITE, duration=st.none() | POSITIVE),
    st.builds(Event, SIGNALS, st.just("ramp"), FINITE, rate=FINITE, duration=POSITIVE, every=st.just(1e300)),
    st.builds(Event, SIGNALS, st.just("bias"), FINITE, FINITE, duration=st.none() | POSITIVE),
    st.builds(Event, SIGNALS, st.sampled_from(["set", "override"]), FINITE, st.booleans() | FINITE | TEXTS),
)
NAMES = st.from_regex(r"[a-z][a-z0-9_]{0,5}", fullmatch=True).filter(
    lambda name: name not in ("as", "if", "in", "is", "or")
)


def test_a_system_of_every_feature():
    system = loads(EXAMPLE, settings=["train[2].speed=[1, 2]", 'simulation.order=["train", "cruise", "target"]'])
    system.judged.published, system.judged.references = [], []  # of another preset, or of what was changed
    assert loads(dump(system)) == system


def test_a_swapped_model_stays_a_swapped_one():
    for changes in ({"preset": "mixed"}, {"swaps": ["cruise[2]=Other"]}, {"settings": ["cruise.component=Other"]}):
        system = loads(EXAMPLE, **changes)
        again = loads(dump(system))
        assert [one.swapped for one in again.instances.values()] == [one.swapped for one in system.instances.values()]
        assert again.instances["cruise[2]"].swapped
        assert loads(dump(again)).instances == system.instances


@pytest.mark.parametrize("options", ["convert = false", 'map = { "1" = 10, "-2" = 3 }', 'map = { park = "hold" }'])
def test_what_happens_on_the_way(options):
    system = loads(EXAMPLE.replace("scale = 2, offset = 1.5", options))
    changed = next(one for one in system.connections if not one.convert or one.map)
    assert (changed.convert, changed.map) in ((False, None), (True, {"1": 10, "-2": 3}), (True, {"park": "hold"}))
    assert loads(dump(system)).connections == system.connections


def test_how_an_instance_steps_and_runs():
    system = loads(EXAMPLE, settings=["cruise.step=1.0", "cruise[2].isolate=true", "cruise[2].step_timeout=5"])
    system.instances["target"].memory_limit = 0.5
    again = loads(dump(system))
    assert again.instances == system.instances
    assert (again.instances["cruise[2]"].step_timeout, again.instances["target"].memory_limit) == (5.0, 0.5)


def test_events_and_numerics():
    system = loads(EXAMPLE)
    system.judged.published = []  # that of another preset
    system.stepping.algorithm, system.stepping.algebraic_loops, system.stepping.acceleration = (
        "iterative",
        "solve",
        "aitken",
    )
    system.stepping.extrapolation, system.stepping.tolerance, system.stepping.max_iterations = 2, 1e-9, 7
    system.stepping.relaxation, system.stepping.min_step = 0.5, 1e-4
    system.stepping.tolerances = {"train[2].position": [1e-6, 1e-3], "target.value": [0.0, 1.0]}
    system.events = [
        Event("cruise[2].ahead_speed", "override", 10.0, np.float64(3.0), duration=2.0, every=5.0),
        Event("target.value", "freeze", -1.0),
        Event("target.value", "set", 0.1, True),
        Event("target.value", "ramp", 3.0, rate=-0.25),
        Event("target.value", "override", 4.0, 'a "text"'),
    ]
    again = loads(dump(system))
    assert again == system
    assert again.events[2].value is True
    assert loads(dump(again)) == system


def test_defaults_are_not_written_out():
    system = loads(EXAMPLE)
    system.judged.published, system.judged.references, system.events = [], [], []
    system.stepping.tolerances = {}
    text = dump(system)
    words = (
        "tolerance =",
        "tolerances",
        "extrapolation",
        "loops",
        "iterations",
        "relaxation",
        "acceleration =",
        "min_step",
    )
    for word in (*words, "isolate", "timeout", "memory", "events", "swapped"):
        assert word not in text, word


def test_published_values_are_owed_by_the_preset_they_belong_to_and_by_no_modified_system():
    nominal = loads(dump(loads(EXAMPLE))).judged
    assert ([entry["metric"] for entry in nominal.references], nominal.published) == (["settling"], [])
    gentle = loads(dump(loads(EXAMPLE, preset="gentle")))
    assert (gentle.provenance.preset, [entry["metric"] for entry in gentle.judged.published]) == ("gentle", ["gap[2]"])
    changed = loads(dump(loads(EXAMPLE, stop_time=60))).judged
    assert (changed.published, changed.references) == ([], [])


def test_a_system_made_in_python():
    system = System(stop_time=10.0, step=0.1)
    system.add("plant", "PointMassTrain", speed=np.float64(3.0), limits=np.array([1.0, 2.0]), pair=(1, 2))
    system.add("target", "Schedule", {"points": 2, "profile": {"a b": [1, {"c": "d"}]}})
    system.connect("target.value", "plant.force", delay=2, scale=-1.0)
    again = loads(dump(system))
    assert again.instances["plant"].start == {"speed": 3.0, "limits": [1.0, 2.0], "pair": [1, 2]}
    assert again.instances["target"] == system.instances["target"]
    assert again.connections == [Connection("target.value", "plant.force", 2, -1.0)]


def test_what_toml_cannot_hold():
    system = System()
    system.add("plant", "A", built=date(2020, 1, 1))
    with pytest.raises(TypeError, match=r"a scenario cannot hold datetime\.date"):
        dump(system)


@settings(max_examples=200, deadline=None)
@given(
    st.dictionaries(
        NAMES, st.tuples(st.dictionaries(TEXTS.filter(bool), VALUES, max_size=3), st.integers(0, 3)), max_size=4
    ),
    TEXTS,
    st.floats(1e-3, 1e3),
    st.integers(0, 2**63 - 1),
    st.tuples(
        st.fixed_dictionaries({}, optional=NUMERICS),
        st.fixed_dictionaries({}, optional=OPTIONS),
        st.lists(EVENTS, max_size=3),
    ),
)
def test_round_trip(families, title, step, seed, others):
    numerics, options, events = others
    system = System(title=title, stop_time=step * 8, step=step, seed=seed, **numerics)
    for name, (start, count) in families.items():
        if count == 0:
            system.instances[name] = Instance(name, "A", {"n": 3, "unit": "m/s"}, dict(start))
        for k in range(1, count + 1):
            system.instances[f"{name}[{k}]"] = Instance(f"{name}[{k}]", "A", {}, dict(start), k, count)
    for name, instance in list(system.instances.items()):
        system.instances[name] = replace(instance, **options)
        system.stepping.tolerances[f"{name}.x.y[1]"] = [step, 0.0]
        system.events += [replace(event, signal=f"{name}.{event.signal}") for event in events]
    again = loads(dump(system))
    assert again == system
    assert list(again.instances) == list(system.instances)
    assert loads(dump(again)) == again
    assert all(math.isfinite(x) for x in (again.stepping.step, again.stepping.stop_time))
