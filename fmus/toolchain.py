"""Compiling a native FMU: the system's C compiler for this machine, ziglang for every other platform.

Flags are chosen so that the bits do not depend on the machine: a baseline processor, no fused multiply-add, and no
power turned into a product, which would round differently from the C library's, and with it from Python's. Nothing of
the machine gets into a library either: names are relative, and neither times nor debug information are kept.

Folders below ``binaries/``: FMI 2.0 knows ``linux64``, ``win64`` and ``darwin64`` and means 64-bit x86 by them; for
other machines FMI 2.0.5 refers to the platform tuples of FMI 3.0, hence ``aarch64-linux``. Importers differ: on an Arm
Mac they look into ``darwin64``, which therefore holds a universal library; on Arm Linux FMPy 0.3 and OpenModelica look
into ``linux64``, where an FMU for both machines has the x86 library. An FMU built for Arm Linux alone therefore carries
its library under both names. FMI 3.0 has the tuples alone.

A web page is a platform, too: ``wasm32-wasi`` holds a WebAssembly module that exports the FMI functions, ``malloc`` and
``free``, and is to be started by ``_initialize``. Since a page has no function of C to give as a logger, it asks
``railcosim_message(component)`` for what the last error was. No importer looks for it.
"""

from __future__ import annotations

import functools
import importlib.metadata
import importlib.util
import logging
import os
import platform
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import fmpy

from ..components.errors import ComponentError, nearest
from .kinds import FmiVersion

FLAGS = (
    *("-std=c11", "-O2", "-ffp-contract=off", "-fno-builtin-pow", "-fvisibility=hidden", "-g0"),
    *("-Wall", "-Wextra", "-Wconversion"),
    # The loops of the integration are short: vector loads of what was just stored singly stall (a step up to +35 %).
    "-fno-tree-vectorize",
)
CL_FLAGS = ("/nologo", "/std:c11", "/O2", "/fp:precise", "/W3", "/D_CRT_SECURE_NO_WARNINGS", "/LD")
_LOG = logging.getLogger(__name__)
_HEADERS = Path(fmpy.__file__).parent / "c-code"


@dataclass(frozen=True)
class Platform:
    """A platform an FMU can carry a binary for.

    Attributes:
        folder: below ``binaries/``.
        tuples: what FMI 3.0 calls it there; a universal library stands under both names.
        suffix: of the library.
        targets: what ziglang calls it; several are joined to one universal library.
        options: for ziglang, beside `FLAGS`.
    """

    folder: str
    tuples: tuple[str, ...]
    suffix: str
    targets: tuple[str, ...]
    options: tuple[str, ...]


_EXPORTS = tuple(f"-Wl,--export{what}" for what in ("-dynamic", "=malloc", "=free"))
PLATFORMS = {
    "linux64": Platform("linux64", ("x86_64-linux",), ".so", ("x86_64-linux-gnu.2.17",), ("-shared", "-fPIC", "-lm")),
    "win64": Platform("win64", ("x86_64-windows",), ".dll", ("x86_64-windows-gnu",), ("-shared",)),
    "darwin64": Platform(
        "darwin64",
        ("x86_64-darwin", "aarch64-darwin"),
        ".dylib",
        ("x86_64-macos.11.0", "aarch64-macos.11.0"),
        ("-shared", "-fPIC"),
    ),
    "aarch64-linux": Platform(
        "aarch64-linux", ("aarch64-linux",), ".so", ("aarch64-linux-gnu.2.17",), ("-shared", "-fPIC", "-lm")
    ),
    "wasm": Platform("wasm32-wasi", ("wasm32-wasi",), ".wasm", ("wasm32-wasi",), ("-mexec-model=reactor", *_EXPORTS)),
}
SYSTEMS = tuple(name for name in PLATFORMS if name != "wasm")
"""What ``all`` means: those that an importer runs on."""
_COSTS = {"win64": "minutes", "wasm": "half a minute"}
"""How long ziglang takes for a platform's C library where that is not some seconds."""


class CompilerError(ComponentError):
    """There is no compiler, or it refused; the message ends with what it said."""


def here() -> str:
    """The name of this machine's platform among `PLATFORMS`."""
    if sys.platform.startswith("win"):
        return "win64"
    if sys.platform == "darwin":
        return "darwin64"
    return "aarch64-linux" if platform.machine().lower() in ("aarch64", "arm64") else "linux64"


def chosen(names: Iterable[str]) -> tuple[str, ...]:
    """The platforms of those names in a fixed order; ``all`` is every one of `SYSTEMS`, nothing is this machine's.

    Raises:
        CompilerError: an unknown name; the message suggests the nearest one.
    """
    wanted = tuple(names) or (here(),)
    for name in wanted:
        if name not in (*PLATFORMS, "all"):
            raise CompilerError(f"there is no platform {nearest(name, [*PLATFORMS, 'all'])}")
    return tuple(name for name in PLATFORMS if name in wanted or ("all" in wanted and name in SYSTEMS))


def folders(platforms: Iterable[str], fmi: FmiVersion = "2") -> dict[str, tuple[str, ...]]:
    """For each of an FMU's platforms, the folders below ``binaries/`` that hold its library."""
    if fmi == "3":
        return {name: PLATFORMS[name].tuples for name in platforms}
    found: dict[str, tuple[str, ...]] = {name: (PLATFORMS[name].folder,) for name in platforms}
    if "aarch64-linux" in found and "linux64" not in found:
        found["aarch64-linux"] += ("linux64",)
    return found


@functools.cache
def system_compiler() -> str | None:
    """The system's C compiler: the one CC names, or the first of cc, gcc, clang (on Windows cl first), or None."""
    usual = ("cl", "cc", "gcc", "clang") if sys.platform.startswith("win") else ("cc", "gcc", "clang")
    for name in (os.environ.get("CC"), *usual):
        found: str | None = shutil.which(name) if name else None
        if found is not None:
            return found
    return None


@functools.cache
def has_zig() -> bool:
    """Whether the ziglang package (extra ``cross``) is installed."""
    return importlib.util.find_spec("ziglang") is not None


def can_compile() -> bool:
    """Whether a binary for this machine can be made."""
    return system_compiler() is not None or has_zig()


@functools.cache
def identity(platforms: tuple[str, ...]) -> str:
    """What determines the binaries beside the sources: compiler and flags, for the cache."""
    compiler = system_compiler() if platforms == (here(),) else None
    if compiler is None:
        version = importlib.metadata.version("ziglang") if has_zig() else "none"
        return f"ziglang {version} {FLAGS} {[PLATFORMS[name] for name in platforms]}"
    stat = os.stat(compiler)
    return f"{os.path.realpath(compiler)} {stat.st_size} {stat.st_mtime_ns} {FLAGS} {CL_FLAGS}"


def compile_library(source: Path, target: Path, name: str, *, only: bool, cache: Path | None = None) -> None:
    """Compile one translation unit to a shared library, or a module for a page; the same source gives the same bytes.

    Args:
        source: the C file; what it includes stands beside it.
        target: the library to write.
        name: a key of `PLATFORMS`.
        only: whether this machine's platform is all that is asked for; then the system's compiler serves.
        cache: where ziglang keeps what it made of its own C libraries, which takes minutes for Windows and less for
            the others; several processes may share it. Its own folder in the user's home by default;
            ``ZIG_GLOBAL_CACHE_DIR`` overrides both.

    Raises:
        CompilerError: no compiler for that platform, or it failed.
    """
    target.parent.mkdir(parents=True, exist_ok=True)
    compiler = system_compiler() if only and name == here() else None
    if compiler is None and not has_zig():
        raise CompilerError(
            f"there is no C compiler for {name}: 'pip install railcosim[cross]' brings one for every platform"
            + (", or install cc, gcc or clang" if only and name == here() else "")
        )
    # A library can bear the name and path it was written under: in a folder of its own both are always the same.
    with tempfile.TemporaryDirectory(dir=source.parent) as scratch:
        made = Path(scratch) / target.name
        relative = made.relative_to(source.parent).as_posix()
        if compiler is not None:
            _run(_system_command(compiler, source.name, relative), source.parent)
        else:
            mark = _Mark(name, cache)
            _LOG.info("%s: compiling for %s%s", target.stem, name, mark.note)
            _cross_compile(source, made, PLATFORMS[name], cache)
            mark.leave()
        os.replace(made, target)


def compile_program(sources: list[Path], target: Path, options: tuple[str, ...] = ()) -> Path:
    """Compile sources of FMUs, and what calls them, to a program for this machine; the functions of FMI have no prefix.

    Args:
        sources: C files, each a translation unit.
        target: the program to write.
        options: for the compiler, beside `FLAGS`.

    Raises:
        CompilerError: there is no compiler but Microsoft's, or it failed.
    """
    compiler = system_compiler()
    if (compiler is None and not has_zig()) or (compiler and Path(compiler).stem.lower() == "cl"):
        raise CompilerError("there is no C compiler for a program; install cc, gcc or clang, or railcosim[cross]")
    command = [compiler] if compiler else [sys.executable, "-m", "ziglang", "cc"]
    shared = [*FLAGS, "-DFMI2_OVERRIDE_FUNCTION_PREFIX", "-I", str(_HEADERS), *options]
    _run([*command, *shared, *map(str, sources), "-o", str(target), "-lm"], target.parent)
    return target


class _Mark:
    """A file that says that a cache of ziglang's has a platform's C library: what follows takes under a second."""

    def __init__(self, name: str, cache: Path | None) -> None:
        chosen = os.environ.get("ZIG_GLOBAL_CACHE_DIR")
        folder = Path(chosen) if chosen else cache
        version = importlib.metadata.version("ziglang")
        self._cost = _COSTS.get(name, "some seconds")
        self._file = folder / "railcosim" / f"{name}-{version}" if folder else None

    @property
    def note(self) -> str:
        """What to tell whoever waits."""
        if self._file is None or self._file.exists():
            return ""
        return f"; ziglang first makes that platform's C library, once, which takes {self._cost}"

    def leave(self) -> None:
        """Leave the mark; a cache that cannot be written goes without."""
        if self._file is not None:
            with suppress(OSError):
                self._file.parent.mkdir(parents=True, exist_ok=True)
                self._file.touch()


def _system_command(compiler: str, source: str, target: str) -> list[str]:
    """The command of this machine's compiler. That of cl follows its manual; it has not been tried on Windows yet."""
    if Path(compiler).stem.lower() == "cl":
        scratch = target.rpartition("/")[0]
        outputs = (f"/Fe:{target}", f"/Fo:{scratch}/", "/link", "/NOIMPLIB", "/Brepro", "/INCREMENTAL:NO")
        return [compiler, *CL_FLAGS, "/I", str(_HEADERS), source, *outputs]
    extra = {"darwin": ["-fPIC", f"-Wl,-install_name,@rpath/{Path(target).name}"], "win32": ["-s"]}
    platform_flags = extra.get(sys.platform, ["-fPIC", "-s", "-lm"])
    return [compiler, *FLAGS, "-shared", "-I", str(_HEADERS), source, "-o", target, *platform_flags]


def _cross_compile(source: Path, made: Path, machine: Platform, cache: Path | None) -> None:
    environment = dict(os.environ)
    if cache is not None:
        environment.setdefault("ZIG_GLOBAL_CACHE_DIR", str(cache))
        environment.setdefault("ZIG_LOCAL_CACHE_DIR", str(made.parent / "zig"))  # what no other build could use
    parts = []
    for target in machine.targets:
        part = made.parent / target / made.name
        part.parent.mkdir()
        extra = [f"-Wl,-install_name,@rpath/{made.name}"] if "macos" in target else []
        output = part.relative_to(source.parent).as_posix()
        command = [sys.executable, "-m", "ziglang", "cc", "-target", target, *FLAGS, "-s"]
        headers = ["-I", str(_HEADERS)]
        _run([*command, *headers, source.name, "-o", output, *machine.options, *extra], source.parent, environment)
        parts.append(part)
    made.write_bytes(parts[0].read_bytes() if len(parts) == 1 else _universal([part.read_bytes() for part in parts]))


def _universal(libraries: list[bytes]) -> bytes:
    """Several Mach-O libraries as one universal file (the format of Apple's ``fat.h``; slices aligned to 16 KiB)."""
    align = 14
    header = (0xCAFEBABE).to_bytes(4, "big") + len(libraries).to_bytes(4, "big")
    offset = 1 << align
    entries, body = b"", b""
    for content in libraries:
        cpu_type, cpu_subtype = content[4:8][::-1], content[8:12][::-1]
        entries += cpu_type + cpu_subtype
        entries += b"".join(n.to_bytes(4, "big") for n in (offset + len(body), len(content), align))
        body += content + b"\0" * (-len(content) % (1 << align))
    head = header + entries
    return head + b"\0" * (offset - len(head)) + body


def _run(command: list[str], folder: Path, environment: dict[str, str] | None = None) -> None:
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        what = "ziglang" if "ziglang" in command else command[0]
        said = (done.stderr or done.stdout).strip().splitlines()
        raise CompilerError("\n".join([f"{what} failed (exit code {done.returncode}):", *said[-20:]]))
