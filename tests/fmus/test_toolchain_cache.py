"""Cross compiling: what is told of it, and that the C libraries it needs are made once."""

import subprocess
import sys
from pathlib import Path

import platformdirs
import pytest
from railcosim.fmus import build as build_module
from railcosim.fmus import toolchain
from railcosim.fmus.toolchain import CompilerError, compile_library

needs_zig = pytest.mark.skipif(not toolchain.has_zig(), reason="ziglang is not installed")


@pytest.fixture
def write_source(tmp_path):
    def write(folder="a"):
        place = tmp_path / folder
        place.mkdir(parents=True, exist_ok=True)
        (place / "it.c").write_text("double f(double x)\n{\n    return 2.0 * x;\n}\n")
        return place / "it.c"

    return write


@pytest.fixture
def stub_zig(monkeypatch):
    """A ziglang that writes a library of four bytes; what it was told to keep where is returned."""
    asked = []

    def run(command, folder, environment):
        asked.append({name: environment.get(f"ZIG_{name}_CACHE_DIR") for name in ("GLOBAL", "LOCAL")})
        (folder / command[command.index("-o") + 1]).write_bytes(b"made")

    monkeypatch.setattr(toolchain, "has_zig", lambda: True)
    monkeypatch.setattr(toolchain.importlib.metadata, "version", lambda name: "1.0")
    monkeypatch.setattr(toolchain, "_run", run)
    monkeypatch.delenv("ZIG_GLOBAL_CACHE_DIR", raising=False)
    monkeypatch.delenv("ZIG_LOCAL_CACHE_DIR", raising=False)
    return asked


def test_each_platform_is_told_and_the_first_time_what_it_costs(stub_zig, write_source, tmp_path, caplog):
    caplog.set_level("INFO")
    for name, cache in (("win64", "c"), ("win64", "c"), ("linux64", "c"), ("win64", "d")):
        compile_library(write_source(), tmp_path / f"it{len(stub_zig)}.x", name, only=False, cache=tmp_path / cache)
    once = "; ziglang first makes that platform's C library, once, which takes"
    assert [record.getMessage() for record in caplog.records] == [
        f"it0: compiling for win64{once} minutes",
        "it1: compiling for win64",
        f"it2: compiling for linux64{once} some seconds",
        f"it3: compiling for win64{once} minutes",
    ]


def test_only_what_others_can_use_stays_in_the_cache(stub_zig, write_source, tmp_path):
    source = write_source()
    compile_library(source, tmp_path / "it.so", "linux64", only=False, cache=tmp_path / "zig")
    (kept,) = stub_zig
    assert kept["GLOBAL"] == str(tmp_path / "zig")
    assert Path(kept["LOCAL"]).is_relative_to(source.parent)


def test_a_build_that_fails_has_not_made_the_library(stub_zig, write_source, tmp_path, monkeypatch, caplog):
    def run(*_):
        raise CompilerError("no")

    caplog.set_level("INFO")
    with monkeypatch.context() as patch:
        patch.setattr(toolchain, "_run", run)
        with pytest.raises(CompilerError):
            compile_library(write_source(), tmp_path / "a.so", "linux64", only=False, cache=tmp_path / "zig")
    compile_library(write_source(), tmp_path / "b.so", "linux64", only=False, cache=tmp_path / "zig")
    assert ["C library" in record.getMessage() for record in caplog.records] == [True, True]


def test_the_cross_c_libraries_are_made_once_for_every_folder_of_fmus(tmp_path, monkeypatch):
    monkeypatch.setattr(platformdirs, "user_cache_dir", lambda *_, **__: str(tmp_path / "user"))
    for folder in ("one", "two"):
        monkeypatch.setenv("RAILCOSIM_CACHE", str(tmp_path / folder))
        assert build_module._zig_cache() == tmp_path / "user" / "zig"
    (tmp_path / "file").write_text("")
    monkeypatch.setattr(platformdirs, "user_cache_dir", lambda *_, **__: str(tmp_path / "file"))
    assert build_module._zig_cache() == tmp_path / "two" / "zig"
    monkeypatch.setenv("RAILCOSIM_CACHE", str(tmp_path / "file" / "none"))
    place = build_module._zig_cache()
    assert place == build_module._instead() / "zig"
    place.mkdir()  # it can be used
    place.rmdir()


@needs_zig
@pytest.mark.long
def test_processes_with_a_cold_cache_make_the_same_library(write_source, tmp_path):
    code = (
        "import sys; from pathlib import Path; from railcosim.fmus.toolchain import compile_library\n"
        "source, made, cache = map(Path, sys.argv[1:])\n"
        "compile_library(source, made, 'aarch64-linux', only=False, cache=cache)"
    )
    made = [tmp_path / str(k) / "it.so" for k in range(3)]
    places = [(write_source(str(k)), path, tmp_path / "zig") for k, path in enumerate(made)]
    running = [subprocess.Popen([sys.executable, "-c", code, *map(str, place)]) for place in places]
    assert [process.wait(timeout=300) for process in running] == [0, 0, 0]
    assert len({path.read_bytes() for path in made}) == 1
