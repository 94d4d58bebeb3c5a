"""What the campaign needs: its modules, FMUs, and a place."""

import ctypes
import sys
import zipfile
from pathlib import Path

import fmpy
import pytest

sys.path.insert(0, str(Path(__file__).parent))
_SET_CHILD_SUBREAPER = 36
"""Of Linux's prctl."""


@pytest.fixture(scope="session")
def small_fmus(mine, xml, tmp_path_factory, session_cache):
    """The FMUs of all cases."""
    from railcosim.fmus.build import build

    folder = tmp_path_factory.mktemp("fmus")
    for name in ("Lag", "LagWithSlope", "Keep"):
        with zipfile.ZipFile(build(mine(name), {}, kind="native")) as whole:
            needed = [x for x in whole.namelist() if x.startswith(("modelDescription", f"binaries/{fmpy.platform}"))]
            xml["write_archive"](folder / f"{name}.fmu", {x: whole.read(x) for x in needed})
    return folder


@pytest.fixture(scope="module")
def bench(small_fmus, tmp_path_factory):
    """Runs cases; what a case leaves behind becomes a child of this process."""
    from cases import Bench

    prctl = ctypes.CDLL(None).prctl
    prctl(_SET_CHILD_SUBREAPER, 1, 0, 0, 0)
    yield Bench(tmp_path_factory.mktemp("cases"), small_fmus)
    prctl(_SET_CHILD_SUBREAPER, 0, 0, 0, 0)
