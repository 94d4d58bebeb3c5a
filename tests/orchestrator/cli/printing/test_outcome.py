"""The end of a run, as it is printed."""

import pytest
from railcosim.orchestrator.cli.printing.outcome import _step_line
from railcosim.orchestrator.run import StepChange, StepCheck

CHANGE = StepChange("gap", 2, 0.5, 0.1, "m")


@pytest.mark.parametrize(
    ("found", "line"),
    [
        (StepCheck("not judged", 0.1, [], []), "is not judged: there are no metrics and no requirements"),
        (StepCheck("fine", 0.1, [], []), "is fine: half of it changes no metric and no requirement's verdict"),
        (
            StepCheck("too coarse", 0.1, [CHANGE], []),
            "is too coarse: half of it changes gap[2] by 0.5 of 0.1 m allowed",
        ),
        (StepCheck("too coarse", 0.1, [], ["a"]), "is too coarse: half of it changes the verdict of requirement a"),
    ],
)
def test_the_verdict_on_a_step(found, line):
    assert _step_line(found) == f"the step of 0.1 s {line}"
