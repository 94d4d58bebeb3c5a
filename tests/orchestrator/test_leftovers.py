"""Temporary folders whose owner is gone."""

import errno
import subprocess
import sys
from pathlib import Path

import pytest
from railcosim.orchestrator import world
from railcosim.orchestrator.leftovers import own, remove_where_abandoned


def test_a_folder_is_removed_where_its_owner_is_gone_and_no_other(tmp_path):
    for name, is_owned in (("abandoned", False), ("used", True), ("elsewhere", None)):
        inside = tmp_path / name / "fmus" / "host_1"
        inside.mkdir(parents=True)
        if is_owned is not None:
            lock = own(tmp_path / name)
            if not is_owned:
                lock.release()
                (tmp_path / name / ".in-use").touch()
        remove_where_abandoned(inside)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["elsewhere", "used"]
    lock.release()


def test_so_is_one_in_which_fmus_were_built_that_no_cache_could_keep():
    code = "import os; from railcosim.fmus.build import _instead; print(_instead(), flush=True); input(); os._exit(0)"
    with subprocess.Popen([sys.executable, "-c", code], stdin=-1, stdout=-1, text=True) as builder:
        folder = Path(builder.stdout.readline().strip())
        remove_where_abandoned(folder / "some.fmu")
        assert folder.is_dir()
        builder.communicate("\n")
    remove_where_abandoned(folder / "some.fmu")
    assert not folder.exists()


def test_a_folder_that_cannot_be_owned_is_named(tmp_path, monkeypatch):
    class Lock:
        def acquire(self, timeout):
            raise OSError(errno.EIO, "Input/output error")

    monkeypatch.setattr(world, "lock", lambda _: Lock())
    with pytest.raises(OSError, match=str(tmp_path)):
        own(tmp_path)
