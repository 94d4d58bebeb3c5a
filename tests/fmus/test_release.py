"""FMUs to keep: kinds, platforms, what is told, checksums, and that nothing half stays behind."""

import hashlib
import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import platformdirs
import pytest
from railcosim.components import CATALOGUE, ComponentError
from railcosim.components.tracing import TracingError
from railcosim.fmus import build as module
from railcosim.fmus import toolchain
from railcosim.fmus.build import native_problem, package
from railcosim.fmus.release import CHECKSUMS, default_directory, release
from railcosim.fmus.toolchain import SYSTEMS, CompilerError

COMMAND = [sys.executable, "-c", "from railcosim.orchestrator.cli.app import main; main()"]
WRONG_INPUT = 2
HERE = toolchain.here()
native = pytest.mark.skipif(bool(native_problem(CATALOGUE["Gust"])), reason="native FMUs cannot be built here")

UNTRACEABLE = """
class Branching(Base):
    u = Input("m")
    y = Output("m")

    def outputs(self):
        return {"y": float(self.u)}


class Texted(Base):
    name = Parameter("1", "a")
    y = Output("1", str)

    def outputs(self):
        return {"y": self.name + "b"}


class Needy(Base):
    requires = ("scipy",)
    y = Output("m")

    def outputs(self):
        return {"y": 1.0}
"""


def orchestrate(*arguments, folder):
    command = [*COMMAND, *map(str, arguments)]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=900, check=False)


def kind_of(path):
    with zipfile.ZipFile(path) as archive:
        return "python" if "resources/slavemodule.txt" in archive.namelist() else "native"


def folders_of(path):
    with zipfile.ZipFile(path) as archive:
        return {name.split("/")[1] for name in archive.namelist() if name.startswith("binaries/")}


@pytest.fixture
def told():
    return []


# ---------------------------------------------------------------- kinds


@native
def test_native_is_what_is_built(tmp_path, told):
    (path,) = release(["Gust"], {}, tmp_path, tell=told.append)
    assert path == tmp_path / "Gust.fmu"
    assert kind_of(path) == "native"
    assert folders_of(path) == {place for places in toolchain.folders([HERE]).values() for place in places}
    assert len(told) == 1
    assert told[0].startswith(f"[1/1] Gust: native, {HERE} (")
    assert told[0].endswith(" kB)")


@native
def test_fmi_3_is_native_or_an_error(components, tmp_path, told):
    (path,) = release(["Gust"], {}, tmp_path, fmi="3", tell=told.append)
    assert folders_of(path) == {place for places in toolchain.folders([HERE], "3").values() for place in places}
    assert told[0].startswith(f"[1/1] Gust: native, FMI 3.0, {HERE} (")
    with pytest.raises(ComponentError, match="only a Python FMU can be made of it"):
        release([components(UNTRACEABLE)("Needy")], {}, tmp_path, fmi="3")


@native
@pytest.mark.parametrize(
    ("name", "reason"),
    [("Texted", "Texted.outputs cannot be traced"), ("Needy", "Needy imports scipy")],
)
def test_what_cannot_be_native_becomes_a_python_fmu_and_says_why_in_one_line(components, tmp_path, told, name, reason):
    (path,) = release([components(UNTRACEABLE)(name)], {}, tmp_path, tell=told.append)
    assert kind_of(path) == "python"
    assert len(told) == 1
    assert f"{name}: a Python FMU, not a native one: {reason}" in told[0]
    assert "\n" not in told[0]


@native
def test_a_kind_asked_for_is_not_replaced(components, tmp_path):
    refer = components(UNTRACEABLE)
    assert kind_of(release(["Gust"], {}, tmp_path, kind="python")[0]) == "python"
    with pytest.raises(TracingError, match=r"Texted\.outputs cannot be traced"):
        release([refer("Texted")], {}, tmp_path, kind="native")
    with pytest.raises(ComponentError, match="imports scipy"):
        release([refer("Needy")], {}, tmp_path, kind="native")


def test_without_casadi_or_compiler_it_says_which(tmp_path, told, monkeypatch):
    monkeypatch.setattr(module, "native_problem", lambda component: "casadi is not installed")
    (path,) = release(["Gust"], {}, tmp_path, tell=told.append)
    assert kind_of(path) == "python"
    assert "Gust: a Python FMU, not a native one: casadi is not installed" in told[0]


def test_a_compiler_that_refuses_is_a_reason_unless_platforms_were_asked_for(tmp_path, monkeypatch):
    whole = module.build

    def build(reference, arguments, *, kind, platforms=()):
        if kind == "native":
            raise CompilerError("cc failed (exit code 1):\nmany lines")
        return whole(reference, arguments, kind=kind)

    monkeypatch.setattr(module, "build", build)
    monkeypatch.setattr(module, "native_problem", lambda component: "")
    path, kind, problem = package("Gust", {}, "auto")
    assert (kind_of(path), kind, problem) == ("python", "python", "cc failed (exit code 1):")
    with pytest.raises(CompilerError):
        package("Gust", {}, "auto", ["win64"])


# ---------------------------------------------------------------- platforms


def test_platforms_are_for_native_fmus(tmp_path):
    with pytest.raises(ComponentError, match="a Python FMU always carries linux64 and win64"):
        release(["Gust"], {}, tmp_path, kind="python", platforms=["all"])


def test_an_unknown_platform_is_refused_before_anything_is_built(tmp_path, monkeypatch):
    monkeypatch.setattr(module, "build", lambda *_, **__: pytest.fail("built"))
    with pytest.raises(CompilerError, match=r"no platform 'linux46'; did you mean 'linux64'\?"):
        release(["Gust"], {}, tmp_path / "out", platforms=["linux46"])
    assert not (tmp_path / "out").exists()


def test_every_platform_asked_for_is_built_and_told(tmp_path, told, monkeypatch):
    made = tmp_path / "cache" / "Gust.fmu"
    made.parent.mkdir()
    made.write_bytes(b"an FMU")
    asked = []
    monkeypatch.setattr(module, "build", lambda *_, **how: asked.append(how) or made)
    release(["Gust"], {}, tmp_path, platforms=["all"], tell=told.append)
    assert len(told) == 1
    assert f"Gust: native, {' '.join(SYSTEMS)} (" in told[0]
    assert asked == [{"kind": "native", "platforms": ["all"]}]


# ---------------------------------------------------------------- files


def test_checksums_fit_and_sha256sum_would_read_them(tmp_path):
    written = release(["Schedule", "Gust"], {}, tmp_path, kind="python", checksums=True)
    assert [path.name for path in written] == ["Schedule.fmu", "Gust.fmu", CHECKSUMS]
    lines = (tmp_path / CHECKSUMS).read_bytes().decode().splitlines()
    sums = {name: hashlib.sha256((tmp_path / name).read_bytes()).hexdigest() for name in ("Gust.fmu", "Schedule.fmu")}
    assert lines == [f"{digest}  {name}" for name, digest in sums.items()]
    if shutil.which("sha256sum"):
        subprocess.run(["sha256sum", "--check", "--strict", CHECKSUMS], cwd=tmp_path, check=True, capture_output=True)


def test_without_checksums_none_are_written(tmp_path):
    release(["Gust"], {}, tmp_path, kind="python")
    assert [path.name for path in tmp_path.iterdir()] == ["Gust.fmu"]


def test_two_components_of_one_name_are_refused(components, tmp_path):
    mine = components("class Gust(Base):\n    y = Output('m')\n\n    def outputs(self):\n        return {'y': 1.0}\n")(
        "Gust"
    )
    with pytest.raises(ComponentError, match=r"would both be written to Gust\.fmu; build them apart"):
        release(["Gust", mine], {}, tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("failure", [OSError("disk full"), KeyboardInterrupt()])
def test_an_interrupted_release_leaves_whole_files_and_no_stale_checksums(tmp_path, monkeypatch, failure):
    release(["Gust", "Schedule"], {}, tmp_path, kind="python", checksums=True)
    before = (tmp_path / "Schedule.fmu").read_bytes()
    whole = os.replace

    def replace(source, target):
        if Path(target) == tmp_path / "Schedule.fmu":
            raise failure
        whole(source, target)

    monkeypatch.setattr(os, "replace", replace)
    with pytest.raises(type(failure)):
        release(["Gust", "Schedule"], {}, tmp_path, kind="python", checksums=True)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["Gust.fmu", "Schedule.fmu"]
    assert (tmp_path / "Schedule.fmu").read_bytes() == before


def test_where_fmus_go_by_default(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert default_directory() == Path()
    (tmp_path / "fmus").mkdir()
    (tmp_path / "fmus" / "build.py").touch()
    (tmp_path / "pyproject.toml").touch()
    assert default_directory() == Path("fmus/dist")


# ---------------------------------------------------------------- the command


def test_the_command_prints_files_and_tells_progress_apart(tmp_path):
    done = orchestrate("build", "Gust", "Schedule", "--kind", "python", "-o", "out", folder=tmp_path)
    assert (done.returncode, done.stdout) == (0, "out/Gust.fmu\nout/Schedule.fmu\n")
    assert [line.split(" (")[0] for line in done.stderr.splitlines()] == [
        "[1/2] Gust: a Python FMU",
        "[2/2] Schedule: a Python FMU",
    ]
    assert orchestrate("build", "Gust", "--kind", "python", "-q", "-o", "out", folder=tmp_path).stderr == ""


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--kind", "python", "--platforms", "all"], "error: --platforms is for native FMUs"),
        (["--platforms", "linux64,beos"], "error: there is no platform 'beos'; it has "),
        (["--kind", "plain"], "Invalid value for '--kind'"),
        (["--fmi", "3", "--kind", "python"], "error: --fmi 3 is for native FMUs"),
        (["--fmi", "3", "--profile", "real-time"], "error: --profile real-time is FMI 2.0"),
        (["--kind", "python", "--model-exchange"], "error: --model-exchange is for native FMUs"),
        (
            ["--profile", "real-time", "--model-exchange"],
            "error: --model-exchange and --profile real-time exclude each",
        ),
    ],
)
def test_the_command_refuses_wrong_input_in_words(tmp_path, arguments, message):
    done = orchestrate("build", "Gust", *arguments, folder=tmp_path)
    assert done.returncode == WRONG_INPUT
    assert message in done.stderr
    assert list(tmp_path.iterdir()) == []


@native
@pytest.mark.skipif(not toolchain.has_zig(), reason="ziglang is not installed")
@pytest.mark.parametrize(
    "names",
    [
        pytest.param(("Cailc", "Gust", "PointMassTrain", "Sensor"), marks=pytest.mark.long, id="some"),
        pytest.param(tuple(sorted(CATALOGUE)), marks=pytest.mark.campaign, id="all"),
    ],
)
def test_a_release_for_every_platform(names, tmp_path, monkeypatch):
    """Some of it once more, in a cache of its own: the same bytes."""
    usual = Path(platformdirs.user_cache_dir("railcosim", appauthor=False)) / "zig"
    monkeypatch.setenv("ZIG_GLOBAL_CACHE_DIR", os.environ.get("ZIG_GLOBAL_CACHE_DIR", str(usual)))

    def released(folder, *names):
        done = orchestrate("build", *names, "--platforms", "all", "-o", folder, folder=tmp_path)
        assert done.returncode == 0, done.stderr
        return tmp_path / folder

    is_all = len(names) == len(CATALOGUE)
    whole = released("one", *(["--all"] if is_all else names))
    sums = (whole / CHECKSUMS).read_text().splitlines() if is_all else []
    assert [line.split("  ")[1] for line in sums] == [f"{name}.fmu" for name in names if is_all]
    monkeypatch.setenv("RAILCOSIM_CACHE", str(tmp_path / "cache"))
    for path in released("two", "Cailc", "PointMassTrain").glob("*.fmu"):
        assert path.read_bytes() == (whole / path.name).read_bytes()
    for name in names:
        path = whole / f"{name}.fmu"
        assert kind_of(path) == "python" or folders_of(path) == {"linux64", "win64", "darwin64", "aarch64-linux"}
