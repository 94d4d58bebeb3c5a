"""The win64 binary of every component, loaded and run by wine, against that of linux64."""

import importlib.util
import shutil
import sys
from pathlib import Path

import pytest

NAME = "railcosim_emulated"
if NAME not in sys.modules:
    spec = importlib.util.spec_from_file_location(NAME, Path(__file__).with_name("emulated.py"))
    sys.modules[NAME] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(sys.modules[NAME])
emulated = sys.modules[NAME]

DEBIAN = "/usr/lib/wine/wine64"
"""Debian's package puts its launcher where no path leads."""
WINE = shutil.which("wine64") or shutil.which("wine") or (DEBIAN if Path(DEBIAN).is_file() else None)


@pytest.fixture(scope="module")
def machines(tmp_path_factory):
    emulated.require(WINE, "wine (Debian: wine64)")
    folder = tmp_path_factory.mktemp("windows")
    own = {"WINEPREFIX": str(folder / "prefix"), "WINEDEBUG": "-all"}
    return emulated.Machine("linux64", [], folder), emulated.Machine("win64", [WINE], folder, own)


@pytest.mark.parametrize("name", emulated.components())
def test_windows_gives_the_same_trajectory(name, machines):
    emulated.compare(name, *machines)
