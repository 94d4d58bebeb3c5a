"""Libraries of FMUs that nobody here wrote: without functions, under other names, beside others."""

import shutil
import sys

import fmpy
import pytest
from railcosim.orchestrator.errors import FmuError
from railcosim.orchestrator.fmi.models import load_fmu

GCC = shutil.which("gcc")
LIBRARY = f"Foreign{fmpy.sharedLibraryExtension}"

pytestmark = pytest.mark.skipif(GCC is None or sys.platform != "linux", reason="compiles its FMUs with gcc")


# -------------------------------------------------------------------- libraries


def test_a_library_without_what_nobody_calls(fmu, go):
    found = go(fmu("reals", binaries={LIBRARY: "bare"}, mode="11"), {"it": {"u": 1.0}})
    assert (found.code, found.results["it.x"][-1]) == (0, 10.0)


def test_a_library_that_cannot_say_how_far_it_got(fmu, go):
    found = go(fmu("reals", binaries={LIBRARY: "bare"}, mode="11"), {"it": {"longest": 0.2}})
    assert found.code == 3
    assert "it, t = 5 s, status discard: discarded the step and does not say how far it got" in found.errors[0]


@pytest.mark.parametrize(
    ("variables", "binaries", "message"),
    [
        ("reals", {LIBRARY: "lame"}, "it: cannot be instantiated: its library has no function fmi2DoStep"),
        ("numbers", {LIBRARY: "bare"}, "it, t = 0 s: its library has no function fmi2GetInteger"),
        (
            "reals",
            {LIBRARY: b"nothing"},
            f"it: cannot be instantiated: Failed to load shared library binaries/{fmpy.platform}/{LIBRARY}.",
        ),
    ],
)
def test_a_library_that_cannot_be_used(fmu, go, variables, binaries, message):
    found = go(fmu(variables, binaries=binaries))
    assert (found.code, found.record["status"], found.results) == (3, "failed", None)
    assert found.errors[0].startswith(f"error: an FMU failed: {message}")


def test_a_library_of_another_description(fmu, go):
    """It is asked once more with logging on: what the matter is, this FMU says only then."""
    found = go(fmu(guid="{2}"))
    assert (found.code, found.record["status"]) == (3, "failed")
    assert found.errors == [
        "error: an FMU failed: it: cannot be instantiated: it gives no instance",
        "    [error] wrong guid {2}",
    ]


@pytest.mark.parametrize(
    ("own", "others"), [("its_own.so", {}), ("its_own.so", {"libneeded.so": b"\x7fELF"}), ("FOREIGN.SO", {})]
)
def test_a_library_of_another_name(fmu, go, own, others):
    path = fmu(binaries={own: "whole", **others})
    found = go(path)
    assert (found.code, found.record["status"]) == (0, "completed")
    assert found.notes[0] == f"{path}: its library {own} is not named after its model identifier 'Foreign'"
    assert found.record["notes"][0] == found.notes[0]


@pytest.mark.parametrize("second", ["whole", b"nothing"])
def test_a_library_beside_the_right_one_is_let_be(fmu, go, second):
    assert not any("library" in note for note in go(fmu(binaries={LIBRARY: "whole", "more.so": second})).notes)


def test_no_telling_which_library(fmu, go, tmp_path):
    path = fmu(binaries={"a.so": "whole", "b.so": "bare"})
    found = go(path)
    several = f"{path} has several libraries for {fmpy.platform} (a.so, b.so) and none called {LIBRARY}"
    assert (found.code, found.errors) == (2, [f"error: {tmp_path / 's.toml'}:4: instance 'it': {several}"])
    assert found.record == {}


def test_resources_are_found(fmu, go):
    assert go(fmu(mode="3")).errors[0] == "error: an FMU failed: it, t = 5 s, status error: fmi2DoStep failed"


def test_a_state_that_is_promised_and_not_kept(fmu, workspace):
    model = load_fmu(fmu(mode="403", simulation='canGetAndSetFMUstate="true"'), workspace)
    it = model.instantiate("it")
    it.setup(0.0, 1.0)
    it.channel("Real", ["at"]).set([0.0])
    with pytest.raises(FmuError, match=r"^it, t = 0 s, status error: fmi2GetFMUstate failed"):
        it.save()
    it.free()
