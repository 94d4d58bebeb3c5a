"""Compiling a native FMU: the system's C compiler for this machine, ziglang for every other platform.

Flags are chosen so that the bits do not depend on the machine: a baseline processor, and no fused multiply-add.
"""

from __future__ import annotations

import importlib.util
import os
import platform
import shutil
import subprocess
import sys
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import fmpy

from ..components.component import ComponentError

FLAGS = ("-std=c11", "-O2", "-ffp-contract=off", "-fvisibility=hidden", "-Wall", "-Wextra", "-Wconversion")
_HEADERS = Path(fmpy.__file__).parent / "c-code"


@dataclass(frozen=True)
class Platform:
    """A platform an FMU can carry a binary for.

    Attributes:
        folder: below ``binaries/``; the names of FMI 2.0, and for 64-bit Arm Linux the one importers look for.
        suffix: of the library.
        targets: what ziglang calls it; several are joined to one universal library.
    """

    folder: str
    suffix: str
    targets: tuple[str, ...]


PLATFORMS = {
    "linux64": Platform("linux64", ".so", ("x86_64-linux-gnu.2.17",)),
    "win64": Platform("win64", ".dll", ("x86_64-windows-gnu",)),
    "darwin64": Platform("darwin64", ".dylib", ("x86_64-macos", "aarch64-macos")),
    "aarch64-linux": Platform("aarch64-linux", ".so", ("aarch64-linux-gnu.2.17",)),
}


class CompilerError(ComponentError):
    """There is no compiler, or it refused; the message ends with what it said."""


def here() -> str:
    """The name of this machine's platform among `PLATFORMS`."""
    if sys.platform.startswith("win"):
        return "win64"
    if sys.platform == "darwin":
        return "darwin64"
    return "aarch64-linux" if platform.machine().lower() in ("aarch64", "arm64") else "linux64"


@cache
def system_compiler() -> str | None:
    """The system's C compiler: the one CC names, or the first of cc, gcc, clang; None if there is none."""
    for name in (os.environ.get("CC"), "cc", "gcc", "clang"):
        found = shutil.which(name) if name else None
        if found is not None:
            return found
    return None


@cache
def has_zig() -> bool:
    """Whether the ziglang package (extra ``cross``) is installed."""
    return importlib.util.find_spec("ziglang") is not None


def can_compile() -> bool:
    """Whether a binary for this machine can be made."""
    return system_compiler() is not None or has_zig()


def identity(platforms: tuple[str, ...]) -> str:
    """What determines the binaries beside the sources: compiler and flags, for the cache."""
    compiler = system_compiler() if platforms == (here(),) else None
    if compiler is None:
        version = importlib.metadata.version("ziglang") if has_zig() else "none"
        return f"ziglang {version} {FLAGS} {platforms}"
    stat = os.stat(compiler)
    return f"{os.path.realpath(compiler)} {stat.st_size} {stat.st_mtime_ns} {FLAGS}"


def compile_library(source: Path, target: Path, name: str, *, only: bool) -> None:
    """Compile one translation unit to a shared library.

    Args:
        source: the C file; what it includes stands beside it.
        target: the library to write.
        name: a key of `PLATFORMS`.
        only: whether this machine's platform is all that is asked for; then the system's compiler serves.

    Raises:
        CompilerError: no compiler for that platform, or it failed.
    """
    target.parent.mkdir(parents=True, exist_ok=True)
    compiler = system_compiler() if only and name == here() else None
    if compiler is not None:
        extra = [] if sys.platform.startswith("win") else ["-fPIC"]
        _run([compiler, *FLAGS, *extra, "-shared", "-I", str(_HEADERS), str(source), "-o", str(target), "-lm"])
        return
    if not has_zig():
        raise CompilerError(
            f"there is no C compiler for {name}: install one (cc, gcc or clang), or 'pip install railcosim[cross]', "
            "which compiles for every platform"
        )
    parts = [target.with_suffix(f".{k}") for k in range(len(PLATFORMS[name].targets))]
    for zig_target, part in zip(PLATFORMS[name].targets, parts, strict=True):
        command = [
            sys.executable,
            "-m",
            "ziglang",
            "cc",
            "-target",
            zig_target,
            *FLAGS,
            "-g0",
            "-s",
            "-fPIC",
            "-shared",
        ]
        if "windows" in zig_target:
            command = [word for word in command if word != "-fPIC"]
        math = [] if "windows" in zig_target else ["-lm"]
        _run([*command, "-I", str(_HEADERS), str(source), "-o", str(part), *math])
    if len(parts) == 1:
        os.replace(parts[0], target)
    else:
        target.write_bytes(_universal([part.read_bytes() for part in parts]))
    for part in (*parts, target.with_suffix(".lib"), target.with_suffix(".pdb")):
        part.unlink(missing_ok=True)


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


def _run(command: list[str]) -> None:
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise CompilerError(f"{command[0]} failed:\n{(done.stderr or done.stdout).strip()[-2000:]}")
