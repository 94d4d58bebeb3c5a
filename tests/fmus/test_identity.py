"""What makes an FMU the one it is: every value, every source and every tool, and nothing else."""

import hashlib
import importlib.metadata
import json

import numpy as np
import pytest
from railcosim.components import ComfortCruise, ComponentError, PointMassTrain
from railcosim.fmus import identity
from railcosim.fmus.build import resolve
from railcosim.fmus.identity import digest_of, given_values, source_digest


def test_a_digest_is_of_names_lengths_and_contents():
    text = b"1:a2:xy2:bc0:"
    assert digest_of({"bc": b"", "a": b"xy"}) == hashlib.sha256(text).hexdigest()


@pytest.mark.parametrize(
    "other",
    [{"a": b"x", "b": b"z"}, {"a": b"xb1:y"}, {"ab": b"xy"}, {"a": b"y", "b": b"x"}, {"a": b"x", "b": b"y", "c": b""}],
)
def test_files_that_differ_differ(other):
    assert digest_of(other) != digest_of({"a": b"x", "b": b"y"})


def test_values_count_where_they_are_not_the_declared_ones():
    assert json.loads(given_values(PointMassTrain())) == {}
    assert json.loads(given_values(PointMassTrain(speed=0.0))) == {}, "as declared"
    assert json.loads(given_values(PointMassTrain(speed=5.0, mass=1e5))) == {"mass": 1e5, "speed": 5.0}


def test_build_arguments_and_arrays_count(sample):
    chain = resolve(sample("Chain"))
    assert json.loads(given_values(chain(masses=4)))["masses"] == 4
    assert given_values(chain(masses=4)) != given_values(chain(masses=5))
    state = next(slot for slot in chain().slots.values() if slot.shape)
    changed = np.array(state.start, dtype=float) + 1.0
    assert json.loads(given_values(chain(**{state.name: changed})))[state.name] == changed.tolist()


def test_the_same_component_has_the_same_digest_and_another_another():
    one = source_digest(PointMassTrain(), "python")
    assert one == source_digest(PointMassTrain(), "python")
    others = [source_digest(PointMassTrain(speed=1.0), "python"), source_digest(ComfortCruise(), "python")]
    assert len({one, *others}) == 3


def test_a_changed_file_is_another_fmu(write_component):
    body = "from railcosim.components import Component, Output\nclass C(Component):\n    y = Output('1')\n"
    body += "    def outputs(self):\n        return {'y': 1.0}\n"
    digests = [
        source_digest(resolve(write_component(text, folder=folder))(), "python")
        for folder, text in (("a", body), ("b", body), ("c", body.replace("1.0", "2.0")))
    ]
    assert digests[0] == digests[1], "wherever it stands"
    assert digests[0] != digests[2]


@pytest.mark.parametrize(("kind", "maker"), [("python", "pythonfmu"), ("native", "casadi")])
def test_the_tool_s_version_counts_and_its_absence_is_told(monkeypatch, kind, maker):
    real = importlib.metadata.version
    identity._packaging.cache_clear()
    digests = []
    for version in ("1.0", "1.1"):
        monkeypatch.setattr(importlib.metadata, "version", lambda n, v=version: v if n == maker else real(n))
        digests.append(identity._packaging(kind))
        identity._packaging.cache_clear()
    assert digests[0] != digests[1]

    def absent(name):
        raise importlib.metadata.PackageNotFoundError(name)

    monkeypatch.setattr(importlib.metadata, "version", lambda n: absent(n) if n == maker else real(n))
    with pytest.raises(ComponentError, match=rf"a {kind} FMU needs {maker}, which is not installed: pip install"):
        identity._packaging(kind)
    identity._packaging.cache_clear()
