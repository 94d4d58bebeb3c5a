"""What a real-time FMU brings for hosts: a bare one that is compiled and run, and how instructions are counted."""

import csv
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from lxml import etree
from railcosim.components import CATALOGUE, ComponentError
from railcosim.fmus import release, toolchain
from railcosim.fmus.build import build, native_problem
from railcosim.fmus.host import FOLDER, StepCost, bare, has_counter, step_cost
from railcosim.fmus.toolchain import CompilerError

MIXED = f"{Path(__file__).parents[1] / 'native_samples.py'}:Mixed"
pytestmark = pytest.mark.skipif(bool(native_problem(CATALOGUE["Gust"])), reason="native FMUs cannot be built here")


@pytest.fixture
def unpacked(tmp_path):
    """The folder of a component's real-time FMU, and the name of its model."""

    def make(reference):
        path = build(reference, kind="native", profile="real-time")
        with zipfile.ZipFile(path) as archive:
            archive.extractall(tmp_path / path.stem)
        return tmp_path / path.stem, path.stem

    return make


def table(text):
    names, *rows = csv.reader(text.splitlines())
    return dict(zip(names, zip(*[map(float, row) for row in rows], strict=True), strict=True))


@pytest.mark.parametrize("which", [MIXED, "ReferenceProfile"])
def test_the_bare_host_gives_the_reference_signals_to_the_bit(unpacked, run, which):
    folder, name = unpacked(which)
    place = folder / FOLDER
    host = toolchain.compile_program([folder / "sources" / "all.c", place / "host.c"], folder / "host")
    done = run(host, bare._rows(folder, name))
    expected = table((folder / "documentation" / f"{name}_ref.csv").read_text())
    assert table(done) == expected


@pytest.fixture
def run():
    """Run a host on rows; what it prints."""
    return lambda host, rows: subprocess.run([host], input=rows, capture_output=True, text=True, check=True).stdout


def test_the_host_s_files_are_whole(unpacked):
    folder, _ = unpacked(MIXED)
    place = folder / FOLDER
    assert len((place / "host.c").read_text().splitlines()) < 90
    assert etree.parse(place / "CustomFMU.xml").findtext("FmuConfiguration/ToolName") == "railcosim"
    described = etree.parse(folder / "modelDescription.xml").getroot()
    assert described.get("guid") in (place / "signals.h").read_text()
    assert {"CMakeLists.txt", "CustomFMU.xml", "host.c", "signals.h"} == {path.name for path in place.iterdir()}


@pytest.fixture
def valgrind(tmp_path, monkeypatch):
    """A valgrind that runs the program and says what each step took: 120, 340, nothing."""
    folder = tmp_path / "bin"
    folder.mkdir()
    program = folder / "valgrind"
    program.write_text(
        f"#!{sys.executable}\n"
        "import os, subprocess, sys\n"
        "output = next(a for a in sys.argv if a.startswith('--callgrind-out-file=')).partition('=')[2]\n"
        "for k, text in enumerate(('totals: 120', 'x\\nsummary: 340', 'none')):\n"
        "    open(f'{output}.{k}', 'w').write(text)\n"
        "sys.exit(int(os.environ.get('REFUSE', 0)) or subprocess.run(sys.argv[-1]).returncode)\n"
    )
    program.chmod(0o755)
    monkeypatch.setenv("PATH", str(folder), prepend=":")


@pytest.mark.usefixtures("valgrind")
def test_the_costliest_step_is_told(tmp_path, monkeypatch):
    told = []
    (path,) = release.release(["Gust"], {}, tmp_path, profile="real-time", tell=told.append)
    assert told[1].strip() == "instructions of a step: at most 340 in 2 steps over its reference signals (callgrind)"
    assert step_cost(path) == StepCost(340, 2)
    monkeypatch.setenv("REFUSE", "3")
    with pytest.raises(OSError, match=r"callgrind failed \(exit code 3\)"):
        step_cost(path)


def test_what_cannot_be_counted_is_told(tmp_path, monkeypatch):
    monkeypatch.setattr(release, "has_counter", lambda: False)
    told = []
    (path,) = release.release(["Gust"], {}, tmp_path, profile="real-time", tell=told.append)
    assert told[1].strip() == "instructions of a step: not counted, for valgrind is not installed"
    assert has_counter() == (shutil.which("valgrind") is not None)
    without = tmp_path / "Without.fmu"
    with zipfile.ZipFile(path) as old, zipfile.ZipFile(without, "w") as new:
        for name in old.namelist():
            if not name.startswith("documentation/"):
                new.writestr(name, old.read(name))
    monkeypatch.setattr(release, "has_counter", lambda: True)
    assert release._step_cost(without) == "instructions of a step: not counted, for there are no reference signals"


def test_a_python_fmu_has_no_profile(tmp_path):
    with pytest.raises(ComponentError, match="--profile real-time is for native FMUs"):
        release.release(["Gust"], {}, tmp_path, kind="python", profile="real-time")


def test_a_program_needs_a_compiler(tmp_path, monkeypatch):
    monkeypatch.setattr(toolchain, "system_compiler", lambda: "C:/cl.exe")
    with pytest.raises(CompilerError, match="no C compiler for a program"):
        toolchain.compile_program([], tmp_path / "it")
    monkeypatch.setattr(toolchain, "system_compiler", lambda: None)
    commands = []
    monkeypatch.setattr(toolchain, "_run", lambda command, folder: commands.append(command))
    monkeypatch.setattr(toolchain, "has_zig", lambda: True)
    toolchain.compile_program([], tmp_path / "it")
    assert commands[0][1:4] == ["-m", "ziglang", "cc"]


@pytest.mark.long
@pytest.mark.skipif(not has_counter(), reason="needs valgrind")
def test_callgrind_counts_the_same_for_the_same_steps():
    """A step of equal length of a model without choices takes the same instructions; none takes none."""
    path = build("ComfortCruise", kind="native", profile="real-time")
    cost = step_cost(path)
    assert cost == step_cost(path)
    assert 100 < cost.most < 100_000
    assert cost.steps == 50


@pytest.mark.long
@pytest.mark.skipif(shutil.which("cmake") is None, reason="needs CMake")
def test_cmake_makes_the_bare_host(unpacked, tmp_path, run):
    folder, name = unpacked("Cailc")
    made = tmp_path / "made"
    headers = f"-DFMI_HEADERS={toolchain._HEADERS}"
    command = ["cmake", "-S", folder / FOLDER, "-B", made, headers, "-DMAX_INSTANCES=1"]
    subprocess.run(command, check=True, capture_output=True)
    subprocess.run(["cmake", "--build", made], check=True, capture_output=True)
    expected = table((folder / "documentation" / f"{name}_ref.csv").read_text())
    assert table(run(made / "host", bare._rows(folder, name))) == expected
    command[4:] = [tmp_path / "again", f"-DFMI_HEADERS={tmp_path}"]
    refused = subprocess.run(command, check=False, capture_output=True, text=True)
    assert refused.returncode
    assert "where no fmi2Functions.h is" in " ".join(refused.stderr.split())
