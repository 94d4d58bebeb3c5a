"""The place in which FMUs are unpacked."""

import errno
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest
from railcosim.orchestrator import world
from railcosim.orchestrator.errors import FmuFileError
from railcosim.orchestrator.fmi.archive import Workspace

DESCRIPTION = {"modelDescription.xml": "<x/>"}


def test_an_archive_is_unpacked_once_however_often_it_is_asked_for(workspace, tmp_path, xml):
    path = xml["write_archive"](tmp_path / "a.fmu", DESCRIPTION | {"resources/data.txt": "7"})
    copy = tmp_path / "copy.fmu"
    copy.write_bytes(path.read_bytes())
    folder, digest, notes = workspace.unpack(path)
    assert (folder / "resources" / "data.txt").read_text() == "7"
    assert workspace.unpack(copy) == (folder, digest, ())
    assert not notes
    assert len(digest) == 64
    assert folder.is_relative_to(workspace.folder)


def test_what_only_people_and_compilers_read_can_stay_in_the_archive(workspace, tmp_path, xml):
    read = {"sources/all.c": "x", "documentation/index.html": "x", "model.png": "x"}
    run = {"modelDescription.xml", "binaries/linux64/a.so", "resources/data.txt"}
    path = xml["write_archive"](tmp_path / "a.fmu", DESCRIPTION | read | dict.fromkeys(run - {*DESCRIPTION}, "x"))

    def files(folder):
        return {found.relative_to(folder).as_posix() for found in folder.rglob("*") if found.is_file()}

    lean, whole = workspace.unpack(path, to_run=True), workspace.unpack(path)
    assert files(lean.folder) == run
    assert files(whole.folder) == run | {*read}
    assert lean.digest == whole.digest


def test_a_workspace_leaves_nothing(tmp_path, xml):
    with Workspace() as workspace:
        workspace.unpack(xml["write_archive"](tmp_path / "a.fmu", DESCRIPTION))
        place = workspace.folder.parent
        assert place.name.startswith("railcosim_")
        assert place.exists()
    assert not place.exists()


def test_what_a_killed_process_has_unpacked_is_removed_at_the_next_start_and_nobody_else_s(tmp_path, monkeypatch):
    code = "import time; from railcosim.orchestrator.fmi import Workspace; w = Workspace(); print(w.folder, flush=True)"
    code += "; time.sleep(600)"
    runs = [
        subprocess.Popen(
            [sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, env=os.environ | {"TMPDIR": str(tmp_path)}
        )
        for _ in range(2)
    ]
    dead, living = (Path(run.stdout.readline().strip()).parent for run in runs)
    foreign = tmp_path / "railcosim_data"
    foreign.mkdir()
    runs[0].kill()
    runs[0].communicate()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    try:
        Workspace().close()
        assert dead.is_dir()  # so young that its owner may be about to take it
        for folder in (dead, living):
            os.utime(folder / ".in-use", (time.time() - 100.0,) * 2)
        Workspace().close()
        assert not dead.exists()
        assert living.is_dir()
        assert foreign.is_dir()
    finally:
        runs[1].kill()
        runs[1].communicate()


def test_a_folder_of_a_run_that_was_killed_before_it_took_its_lock_is_removed(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    for name in ("railcosim_dead", "railcosim_full"):
        (tmp_path / name).mkdir()
    (tmp_path / "railcosim_full" / "mine.txt").write_text("somebody else's")
    Workspace().close()
    assert len(list(tmp_path.iterdir())) == 2  # so young that its owner may be about to take the lock
    monkeypatch.setattr(world, "now", lambda: time.time() + 100.0)
    Workspace().close()
    assert [path.name for path in tmp_path.iterdir()] == ["railcosim_full"]


def test_a_place_that_cannot_be_had_leaves_nothing(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    monkeypatch.setattr(world, "mkdir", failing(errno.ENOSPC))
    with pytest.raises(OSError, match="No space left"):
        Workspace()
    assert not list(tmp_path.iterdir())


def test_a_full_disk_is_not_the_archive_s_fault(refused, tmp_path, xml, monkeypatch):
    path = xml["write_archive"](tmp_path / "a.fmu", DESCRIPTION)
    monkeypatch.setattr(world, "copyfileobj", failing(errno.ENOSPC))
    told = refused(path)
    assert told.startswith(f"{path} cannot be unpacked: No space left on device: ")
    assert told.endswith("set TMPDIR to a folder with room")


def failing(number):
    """A function that raises what the system would."""

    def fail(*_, **__):
        raise OSError(number, os.strerror(number))

    return fail


def test_no_such_file(refused, tmp_path):
    assert refused(tmp_path / "missing.fmu").endswith("cannot be read: No such file or directory")
    assert "is a folder, not an FMU file; zip what is in it" in refused(tmp_path)


def test_what_was_put_right_is_told_of_the_file_that_was_asked_for(workspace, tmp_path, xml):
    for name in ("a.fmu", "b.fmu"):
        path = xml["write_archive"](tmp_path / name, DESCRIPTION | {"resources\\a.txt": "7"})
        assert workspace.unpack(path).notes == (
            f"{path}: it has paths with backslashes, which a zip may not have; they are taken for folders",
        )


def test_fmus_are_unpacked_to_a_plain_place_whatever_the_user_s_is_called(monkeypatch, tmp_path):
    """A Python FMU crashes the process below a folder whose name a URI must encode."""
    odd = tmp_path / "größe (1) + #100%"
    odd.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(odd))
    with Workspace() as workspace:
        assert not workspace.folder.is_relative_to(odd)
        assert str(workspace.folder).isascii()
        assert not set("()+#%") & set(str(workspace.folder))


def test_without_a_plain_place_there_is_one_clear_sentence(monkeypatch, tmp_path):
    odd = tmp_path / "größe"
    odd.mkdir()
    monkeypatch.setattr(world, "mkdtemp", lambda prefix, dir: str(odd))
    monkeypatch.setattr(world, "rmdir", lambda self: None)
    with pytest.raises(FmuFileError, match="need a path of plain ASCII letters; set TMPDIR"):
        Workspace()
