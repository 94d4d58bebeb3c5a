"""An interface that goes to another process comes back as it was."""

import dataclasses
import json

import pytest
from railcosim.fmus.annotation import Annotation
from railcosim.orchestrator.fmi import Interface, Sort, Unit, Variable
from railcosim.orchestrator.fmi.binding import plain_interface, read_interface


@pytest.fixture
def interface():
    """One with something in every field."""
    variables = [
        Variable("x[1]", 1, Sort("Real", "output", "continuous", None, "km/h"), float("inf"), "", frozenset({"u"})),
        Variable("state", 2, Sort("Enumeration", "input", "discrete", "exact", choices=(("off", 1), ("on", 2))), 1),
        Variable("m[2]", 4, Sort("Real", "local", "continuous", None), derivative="x[1]", element=("m", 1)),
        Variable("none", 3, Sort("String", "parameter", "fixed", "exact", fmi_type="String", negated=True), "a\udcff"),
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
