"""The 64-bit Arm Linux binary of every component, run by qemu on Arm's own C library, against that of linux64."""

import importlib.util
import shutil
import sys
import zipfile
from pathlib import Path

import pytest
from railcosim.fmus.build import build

NAME = "railcosim_emulated"
if NAME not in sys.modules:
    spec = importlib.util.spec_from_file_location(NAME, Path(__file__).with_name("emulated.py"))
    sys.modules[NAME] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(sys.modules[NAME])
emulated = sys.modules[NAME]

QEMU = shutil.which("qemu-aarch64-static") or shutil.which("qemu-aarch64")
ROOT = Path("/usr/aarch64-linux-gnu")


@pytest.fixture(scope="module")
def machines(tmp_path_factory):
    emulated.require(QEMU, "qemu (Debian: qemu-user-static)")
    emulated.require((ROOT / "lib/ld-linux-aarch64.so.1").is_file(), "Arm's C library (Debian: libc6-arm64-cross)")
    folder = tmp_path_factory.mktemp("arm")
    here = emulated.Machine("linux64", [], folder)
    return here, emulated.Machine("aarch64-linux", [QEMU, "-L", str(ROOT)], folder)


@pytest.mark.parametrize("name", emulated.components())
def test_arm_gives_the_same_trajectory(name, machines):
    emulated.compare(name, *machines)


@pytest.mark.long
def test_the_bare_host_of_a_real_time_fmu_runs_on_arm(machines, tmp_path):
    """Host and sources as one program, without an importer and without a heap."""
    with zipfile.ZipFile(build("Cailc", kind="native", profile="real-time")) as archive:
        archive.extractall(tmp_path)
    ours, theirs = (emulated.bare_host(machine, tmp_path, "Cailc") for machine in machines)
    assert emulated.largest(ours, theirs) <= emulated.SAME
    reference = emulated.columns((tmp_path / "documentation" / "Cailc_ref.csv").read_text())
    assert emulated.largest(reference, theirs) <= emulated.SAME
