"""An FMU for web pages: what its module exports, and asks for (WebAssembly 1.0, section 5.5)."""

import zipfile
from pathlib import Path

import platformdirs
import pytest
from railcosim.components import CATALOGUE
from railcosim.fmus import toolchain
from railcosim.fmus.build import build, native_problem

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(not toolchain.has_zig(), reason="ziglang is not installed"),
    pytest.mark.skipif(bool(native_problem(CATALOGUE["Gust"])), reason="native FMUs cannot be built here"),
]
FUNCTIONS = ("fmi2Instantiate", "fmi2Reset", "fmi2SetReal", "fmi2GetBoolean", "fmi2DoStep", "fmi2SerializeFMUstate")


def varint(data, place):
    """A number in LEB128, and where it ends."""
    number = shift = 0
    while True:
        byte = data[place]
        number, shift, place = number | (byte & 127) << shift, shift + 7, place + 1
        if byte < 128:
            return number, place


def names(module):
    """What a module imports and exports."""
    assert module.startswith(b"\0asm\1\0\0\0")
    place, found = 8, {2: [], 7: []}
    while place < len(module):
        kind, (size, begin) = module[place], varint(module, place + 1)
        place = begin + size
        if kind not in found:
            continue
        count, at = varint(module, begin)
        for _ in range(count):
            for _ in range(2 if kind == 2 else 1):  # an import has the name of a module first
                length, at = varint(module, at)
                name, at = module[at : at + length].decode(), at + length
            found[kind].append(name)
            _, at = varint(module, at + 1)  # functions and their types alone are imported
    return found[2], found[7]


@pytest.fixture
def module(monkeypatch):
    monkeypatch.setenv(
        "ZIG_GLOBAL_CACHE_DIR", str(Path(platformdirs.user_cache_dir("railcosim", appauthor=False)) / "zig")
    )

    def read(name, **arguments):
        with zipfile.ZipFile(build(name, arguments, kind="native", platforms=["wasm"])) as archive:
            binaries = [entry for entry in archive.namelist() if entry.startswith("binaries/")]
            assert binaries == [f"binaries/wasm32-wasi/{name}.wasm"]
            return archive.read(binaries[0])

    return read


def test_it_exports_fmi_and_asks_for_nothing(module):
    content = module("ComfortCruise")
    imported, exported = names(content)
    assert imported == []
    assert {*FUNCTIONS, "memory", "malloc", "free", "_initialize", "railcosim_message"} <= set(exported)
    assert len(content) < 80_000


def test_only_a_tape_asks_for_files(module):
    imported, exported = names(module("PdIlc"))
    assert all(name.startswith(("fd_", "path_", "proc_", "environ_", "args_")) for name in imported)
    assert set(FUNCTIONS) <= set(exported)
