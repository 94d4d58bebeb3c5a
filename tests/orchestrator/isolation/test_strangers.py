"""FMUs that this machine does not know are told from those that it has run, or built, and isolated by ``auto``."""

import shutil
import sys
from pathlib import Path

import pytest
from railcosim.fmus.build import build
from railcosim.orchestrator import System
from railcosim.orchestrator.cli.app import call
from railcosim.orchestrator.cli.studies import _isolating
from railcosim.orchestrator.errors import FmuError
from railcosim.orchestrator.isolation import AUTO, isolate, note_validation, strangers
from railcosim.orchestrator.run import record
from railcosim.orchestrator.run.execution import execute, run
from railcosim.orchestrator.scenario import load

pytestmark = [
    pytest.mark.skipif(not sys.platform.startswith("linux"), reason="FMUs by hand are compiled for Linux here"),
    pytest.mark.usefixtures("in_time", "nothing_left"),
]


@pytest.fixture(autouse=True)
def own_knowledge(tmp_path, monkeypatch):
    """A machine that knows nobody yet."""
    monkeypatch.setenv("RAILCOSIM_CACHE", str(tmp_path / "cache"))


def system_of(path, **start):
    system = System(stop_time=1.0, step=0.5)
    system.add("it", str(path), **start)
    return system


def test_who_has_come_through_a_run_is_known_until_the_file_changes(hostile):
    path = Path(hostile())
    first = isolate(system_of(path), [AUTO])
    assert first.instances["it"].isolate == "together"
    told = "in processes of their own, because this machine does not know their FMUs: it"
    assert told in execute(first).checked.notes
    again = isolate(system_of(path), [AUTO])
    assert not again.instances["it"].isolate
    assert not again.provenance.notes
    hostile("nothing")  # the same file with another content
    assert strangers(system_of(path)) == ["it"]


def test_who_crashes_stays_a_stranger(hostile):
    system = system_of(hostile(), deed="step null 0.5")
    with pytest.raises(FmuError, match="SIGSEGV"):
        run(isolate(system, [AUTO]))
    assert strangers(system) == ["it"]


def test_who_fails_validation_is_a_stranger_until_it_passes(hostile, tmp_path):
    system = system_of(hostile())
    path = Path(system.instances["it"].model)
    for _ in range(2):
        note_validation(path, passed=False)
        run(isolate(system, [AUTO]))
        assert strangers(system) == ["it"]
    note_validation(path, passed=True)
    assert strangers(system) == ["it"], "nobody has run it"
    run(isolate(system, [AUTO]))
    note_validation(path, passed=True)
    assert not strangers(system)
    note_validation(tmp_path / "none.fmu", passed=False)


def test_what_was_built_here_is_no_stranger(tmp_path):
    system = system_of(shutil.copy(build("PointMassTrain", {}, kind="python"), tmp_path / "train.fmu"))
    system.add("component", "PointMassTrain")
    system.add("missing", "missing.fmu")
    assert not strangers(system)


def test_a_cache_that_cannot_be_written_leaves_strangers(hostile, tmp_path, monkeypatch):
    (tmp_path / "file").write_text("no folder")
    monkeypatch.setenv("RAILCOSIM_CACHE", str(tmp_path / "file"))
    system = system_of(hostile())
    run(system)
    assert strangers(system) == ["it"]


def test_on_the_command_line(hostile, tmp_path, capsys, monkeypatch):
    path = hostile()
    monkeypatch.chdir(tmp_path)
    Path("own.toml").write_text(
        f'title = "One"\n[simulation]\nstop_time = 1.0\nstep = 0.5\n[instances.it]\nfmu = "{path}"\n'
    )
    for isolated in (True, False):
        assert call(["run", "own.toml", "--isolate", "auto", "--no-figures", "-o", "out"]) == 0
        told = " ".join("".join(capsys.readouterr()).split())
        assert ("this machine does not know" in told) == isolated
        assert record.read(Path("out"))["instances"]["it"]["isolated"] == isolated


def test_in_a_study_and_after_a_validation_on_the_command_line(hostile, tmp_path, monkeypatch):
    path = hostile("step fatal")
    monkeypatch.chdir(tmp_path)
    Path("own.toml").write_text(
        f'title = "One"\n[simulation]\nstop_time = 1.0\nstep = 0.5\n[instances.it]\nfmu = "{path}"\n'
        '[metrics]\nend = "final(it.x)"\n'
    )
    system = load("own.toml")
    assert _isolating(system, ["auto"]) == ["it.isolate='together'"]
    assert _isolating(system, ["it", "auto"]) == ["it.isolate='together'", "it.isolate=true"]
    assert _isolating(system, ["together"]) == ["it.isolate='together'"]
    assert _isolating(system, ["all"]) == ["it.isolate=true"]
    note = next((tmp_path / "cache").glob("known/*"), None)
    assert note is None
    assert call(["validate", path, "--quiet"]) == 1
    assert [each.read_text() for each in (tmp_path / "cache" / "known").iterdir()] == ["failed validation\n"]
