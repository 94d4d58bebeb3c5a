"""A boolean is true with any bit that is set, in every version of FMI and by every reader, and 0 or 1 here."""

import shutil

import fmpy
import pytest
from railcosim.orchestrator import System, run
from railcosim.orchestrator.isolation import isolate

pytestmark = pytest.mark.skipif(shutil.which("gcc") is None, reason="compiles its FMUs with gcc")

LIBRARY = f"Foreign{fmpy.sharedLibraryExtension}"


@pytest.fixture
def pair(fmu, by_hand, compile_c):
    """Two FMUs, each of which gives the negation of what it is given: now (2.0), or a step later."""

    def make(version, truth):
        if version == 2:
            path = fmu(binaries={LIBRARY: compile_c("foreign.c", f"-DTRUE={truth}")})
        else:
            path = by_hand(version, options=[f"-DTRUE={truth}"])
        system = System(stop_time=1.0, step=0.25)
        system.add("a", str(path), on=False)
        system.add("b", str(path))
        system.connect("a.off", "b.on")
        return system

    return make


def check_truths(outcome):
    assert list(outcome["a.off"][1:]) == [1.0] * 4
    assert list(outcome["b.off"][2:]) == [0.0] * 3
    assert {*outcome["a.off"], *outcome["b.off"]} <= {0.0, 1.0}


@pytest.mark.usefixtures("loop")
@pytest.mark.parametrize("algorithm", ["jacobi", "gauss-seidel"])
@pytest.mark.parametrize(("version", "truth"), [(1, 2), (1, -128), (2, 256), (2, -1), (3, 2), (3, 255)])
def test_any_bit_is_true(pair, version, truth, algorithm):
    check_truths(run(pair(version, truth), algorithm=algorithm))


@pytest.mark.parametrize(("version", "truth"), [(1, 2), (2, 256), (3, 255)])
def test_any_bit_is_true_in_other_threads_and_processes(pair, version, truth):
    check_truths(run(pair(version, truth), algorithm="jacobi", threads=2 if version == 2 else 1))
    check_truths(run(isolate(pair(version, truth), ["a", "b"])))


@pytest.mark.usefixtures("loop")
def test_an_fmu_without_outputs_runs_and_is_told(v, fmu, tmp_path):
    system = System(stop_time=1.0, step=0.25)
    system.add("a", str(fmu([v("u", 0, "input", start=0.0)])))
    outcome = run(system, output=tmp_path / "out")
    assert "Foreign has no outputs: nothing of it is recorded but what is connected" in outcome.checked.notes
    assert (list(outcome.names()), outcome.status) == ([], "completed")
    assert (tmp_path / "out" / "results.csv").read_text().splitlines() == ["time", "0.0", "0.25", "0.5", "0.75", "1.0"]
