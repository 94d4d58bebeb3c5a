"""What `orchestrate validate` makes of FMI 3.0 and 1.0 FMUs that are reset, and called as they must not be."""

import pytest
from railcosim.orchestrator.fmi.archive import Workspace
from railcosim.orchestrator.fmi.models import load_fmu
from railcosim.orchestrator.validation.probing import PROBES, try_out

EVENTS = ("<CoSimulation", '<CoSimulation hasEventMode="true"')


@pytest.fixture
def tried(by_hand):
    """What one probe finds of the FMU of fmi3.c or fmi1.c."""

    def find(probe, version=3, *changes, options=()):
        path = by_hand(version, *changes, options=options)
        with Workspace() as workspace:
            model = load_fmu(path, workspace)
            *_, finding = try_out(model.interface, model.folder, path, 60.0, (probe,))
        assert finding.check == PROBES[probe]
        return finding.verdict, finding.detail

    return find


def test_a_reset_brings_it_back(tried):
    for version in (1, 3):
        verdict, told = tried("reset", version, options=["-DRESET=0"])
        assert verdict == "pass", told
    assert told == "a run after fmi3Reset repeats the first, bit for bit"


@pytest.mark.parametrize(
    ("options", "part"),
    [
        (["-DRESET=3"], "status error: fmi3Reset failed"),
        (["-DRESET=(s->now.f64[2] = 2.0, 0)"], "other outputs after fmi3Reset"),
        ((), "its library has no function fmi3Reset"),
    ],
)
def test_a_reset_that_does_not_is_found(tried, options, part):
    verdict, told = tried("reset", options=options)
    assert verdict == "fail"
    assert part in told


def test_what_it_accepts_in_a_wrong_state_is_a_warning(tried):
    """It knows no order but that of its initialization, and takes any value reference and any step."""
    verdict, told = tried("order")
    assert verdict == "warning"
    assert told == (
        "accepted without an error: fmi3ExitInitializationMode out of turn, fmi3DoStep with a negative step, "
        "fmi3GetFloat64 of a value reference that is not there, fmi3SetFloat64 of a value reference that is not there, "
        "fmi3DoStep after fmi3Terminate\nthe standard forbids importers to make these calls"
    )


def test_one_with_an_event_mode_is_asked_for_its_states(tried):
    """It leaves no event mode that it is not in, unless it was built to take any order."""
    verdict, told = tried("order", 3, EVENTS, options=["-DEVENTS=1"])
    assert verdict == "warning"
    assert "EnterEventMode" not in told, "which it has"
    assert "StepMode" not in told
    assert "UpdateDiscreteStates" not in told
    verdict, told = tried("order", 3, EVENTS, options=["-DEVENTS=1", "-DANY_ORDER"])
    assert "fmi3UpdateDiscreteStates outside of event mode, fmi3EnterStepMode outside of event mode" in told


def test_what_it_says_it_does_not_have_it_should_refuse(tried):
    verdict, told = tried("order", options=["-DEVENTS=0", "-DANY_ORDER"])
    assert verdict == "warning"
    assert "fmi3EnterEventMode, which it says it does not have" in told


def test_one_with_tunable_structural_parameters_is_reconfigured_by_right(tried):
    size, call = 'structuralParameter" variability="', "fmi3EnterConfigurationMode while running"
    assert call in tried("order", options=["-DANY_ORDER"])[1]
    assert call not in tried("order", 3, (f"{size}fixed", f"{size}tunable"), options=["-DANY_ORDER"])[1]


def test_of_fmi_1_wrong_calls_are_not_made(tried):
    assert tried("order", 1) == ("skipped", "tried with FMI 2.0 and 3.0 only")
