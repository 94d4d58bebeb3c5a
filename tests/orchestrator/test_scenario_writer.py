"""Systems written as scenarios load to equal systems."""

import math
from datetime import date
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from railcosim.orchestrator.scenario import dump, loads
from railcosim.orchestrator.system import Connection, Instance, System

EXAMPLE = Path(__file__).with_name("two_trains.toml").read_text(encoding="utf-8")
TEXTS = st.text(st.characters(exclude_categories=["Cs"]), max_size=8)
SCALARS = st.one_of(st.booleans(), st.integers(-(2**63), 2**63 - 1), st.floats(allow_nan=False), TEXTS)
VALUES = st.recursive(SCALARS, lambda inner: st.lists(inner, max_size=3), max_leaves=6)
NAMES = st.from_regex(r"[a-z][a-z0-9_]{0,5}", fullmatch=True).filter(
    lambda name: name not in ("as", "if", "in", "is", "or")
)


def test_a_system_of_every_feature():
    system = loads(EXAMPLE, settings=["train[2].speed=[1, 2]", 'simulation.order=["train", "cruise", "target"]'])
    system.published = []
    assert loads(dump(system)) == system


def test_published_values_are_owed_by_the_preset_they_belong_to_and_by_no_modified_system():
    assert [entry["metric"] for entry in loads(dump(loads(EXAMPLE))).published] == ["settling"]
    gentle = loads(dump(loads(EXAMPLE, preset="gentle")))
    assert (gentle.preset, [entry["metric"] for entry in gentle.published]) == ("gentle", ["gap[2]"])
    assert loads(dump(loads(EXAMPLE, stop_time=60))).published == []


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
)
def test_round_trip(families, title, step, seed):
    system = System(title=title, stop_time=step * 8, step=step, seed=seed)
    for name, (start, count) in families.items():
        if count == 0:
            system.instances[name] = Instance(name, "A", {"n": 3, "unit": "m/s"}, dict(start))
        for k in range(1, count + 1):
            system.instances[f"{name}[{k}]"] = Instance(f"{name}[{k}]", "A", {}, dict(start), k, count)
    again = loads(dump(system))
    assert again == system
    assert loads(dump(again)) == again
    assert all(math.isfinite(x) for x in (again.step, again.stop_time))
