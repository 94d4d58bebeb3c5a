"""An interface that goes to another process comes back as it was."""

import dataclasses
import json

import pytest
from railcosim.fmus.annotation import Annotation
from railcosim.orchestrator.fmi import Interface, Unit, Variable
from railcosim.orchestrator.fmi.binding import plain_interface, read_interface


@pytest.fixture
def interface():
    """One with something in every field."""
    variables = [
        Variable("x[1]", 1, "Real", "output", "continuous", None, float("inf"), "km/h", dependencies=frozenset({"u"})),
        Variable("state", 2, "Enumeration", "input", "discrete", "exact", 1, choices=(("off", 1), ("on", 2))),
        Variable("none", 3, "String", "parameter", "fixed", "exact", "a\udcff", fmi_type="String", negated=True),
    ]
    units = [Unit("km/h", (0, 1, -1, 0, 0, 0, 0, 0), 1 / 3.6), Unit("odd", None)]
    return Interface(
        "m",
        "i",
        "g",
        {v.name: v for v in variables},
        {u.name: u for u in units},
        {"x": ("x[1]",)},
        annotation=Annotation("C", {"n": [1, 2]}, kind="native", requires=("scipy",), optional_inputs=("u", "w")),
        left_out={"b": "binary"},
        warnings=("odd",),
        default_step=0.1,
    )


def test_it_comes_back_as_it_was_through_text(interface):
    assert read_interface(json.loads(json.dumps(plain_interface(interface)))) == interface


def test_so_does_one_of_another_maker(interface):
    other = dataclasses.replace(interface, annotation=None, variables={}, units={})
    assert read_interface(json.loads(json.dumps(plain_interface(other)))) == other
