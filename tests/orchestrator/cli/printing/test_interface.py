"""The tables of an interface."""

from railcosim.fmus.annotation import Annotation
from railcosim.orchestrator.cli.printing import show_interface
from railcosim.orchestrator.fmi import Interface, Sort, Variable


def test_an_interface_stands_by_causality_with_what_each_output_depends_on(shown):
    variables = [
        Variable("gain", 0, Sort("Real", "parameter", "tunable", "exact", "1/s"), 0.5, "of the loop"),
        Variable("on", 1, Sort("Boolean", "input", "discrete", None), True),
        Variable("u", 2, Sort("Real", "input", "continuous", None, "m"), 0.0, "what comes in"),
        Variable("y", 3, Sort("Real", "output", "continuous", None, "m"), dependencies=frozenset({"u", "on"})),
        Variable("z", 4, Sort("Real", "output", "continuous", None), dependencies=frozenset()),
        Variable("w", 5, Sort("Real", "output", "continuous", None)),
    ]
    interface = Interface(
        "M",
        "M",
        "{1}",
        {v.name: v for v in variables},
        {},
        {},
        annotation=Annotation(optional_inputs=("u",), unused_inputs=("on", "u")),
    )
    lines = [" ".join(line.split()) for line in shown(show_interface, interface)]
    assert [line for line in lines if line in ("Parameters", "Inputs", "Outputs")] == [
        "Parameters",
        "Inputs",
        "Outputs",
    ]
    assert "gain Real 1/s 0.5 of the loop (tunable)" in lines
    assert "on Boolean true (not used)" in lines
    assert "u Real m 0 what comes in (optional, not used)" in lines
    assert "y Real m on, u" in lines
    assert "z Real no input" in lines
    assert "w Real not said" in lines
