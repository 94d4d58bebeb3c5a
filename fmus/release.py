"""FMUs to keep, for other tools: built, copied to a folder whole or not at all, and listed with their checksums."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from ..components import ComponentError
from . import toolchain
from .build import package, write_whole
from .host import has_counter, step_cost
from .kinds import FmiVersion, PackagingKind, Profile
from .references import resolve

CHECKSUMS = "SHA256SUMS"
_WITH: dict[Profile, str] = {"model-exchange": " with model exchange"}


def release(
    references: Sequence[str],
    arguments: Mapping[str, Any],
    directory: Path,
    *,
    kind: PackagingKind = "auto",
    platforms: Sequence[str] = (),
    profile: Profile = "standard",
    fmi: FmiVersion = "2",
    checksums: bool = False,
    tell: Callable[[str], None] = lambda line: None,
) -> list[Path]:
    """Build components and copy their FMUs to a folder.

    Args:
        references: catalogue names or ``"file.py:Class"``.
        arguments: build arguments, for all of them.
        directory: made if it is not there.
        kind: ``"auto"`` is native where that is possible, and tells why where it is not.
        platforms: of native FMUs, keys of `toolchain.PLATFORMS` or ``all``; this machine's by default.
        profile: other than ``"standard"`` makes native FMUs; ``"real-time"`` counts the instructions of a step, too,
            where valgrind is there.
        fmi: the version of FMI; those in 3.0 are native.
        checksums: whether to write `CHECKSUMS`, which ``sha256sum -c`` checks.
        tell: takes a line on each FMU's progress.

    Returns:
        What was written.

    Raises:
        ComponentError: two components of one name, or platforms asked of a Python FMU, or what FMI 3.0 has not.
        ComponentError: a component cannot be built; what was built before it stays.
    """
    if profile != "standard" or fmi == "3":
        kind = "native" if kind == "auto" else kind  # what cannot be compiled is an error, no reason for another kind
    _check(references, kind, platforms, profile, fmi)
    chosen = toolchain.chosen(platforms)
    directory.mkdir(parents=True, exist_ok=True)
    listing = directory / CHECKSUMS
    if checksums:
        listing.unlink(missing_ok=True)  # it would not fit the new FMUs if this is interrupted
    written: list[Path] = []
    for count, reference in enumerate(references, start=1):
        begin = time.perf_counter()
        source, made, problem = package(reference, arguments, kind, platforms, profile=profile, fmi=fmi)
        target = directory / source.name
        write_whole(source.read_bytes(), target)
        written.append(target)
        note = f", not a native one: {problem}" if problem else ""
        version = _WITH.get(profile, "") + (", FMI 3.0" if fmi == "3" else "")
        what = f"native{version}, {' '.join(chosen)}" if made == "native" else f"a Python FMU{note}"
        cost = f"{time.perf_counter() - begin:.1f} s, {target.stat().st_size / 1000:.0f} kB"
        tell(f"[{count}/{len(references)}] {target.stem}: {what} ({cost})")
        if profile == "real-time":
            tell(f"    {_step_cost(target)}")
    if checksums:
        lines = (f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.name}\n" for path in sorted(written))
        listing.write_text("".join(lines), encoding="utf-8", newline="\n")
        written.append(listing)
    return written


def default_directory() -> Path:
    """``fmus/dist`` in a checkout, the current folder elsewhere."""
    checkout = Path("fmus/build.py").is_file() and Path("pyproject.toml").is_file()
    return Path("fmus/dist") if checkout else Path()


def _step_cost(fmu: Path) -> str:
    """What the costliest step took, in words."""
    if not has_counter():
        return "instructions of a step: not counted, for valgrind is not installed"
    found = step_cost(fmu)
    if found is None:
        return "instructions of a step: not counted, for there are no reference signals"
    return f"instructions of a step: at most {found.most} in {found.steps} steps over its reference signals (callgrind)"


def _check(
    references: Sequence[str], kind: PackagingKind, platforms: Sequence[str], profile: Profile, fmi: FmiVersion
) -> None:
    if fmi == "3" and profile == "real-time":
        raise ComponentError("--profile real-time is FMI 2.0, whose functions its host in C calls; leave out --fmi 3")
    if kind == "python" and profile == "model-exchange":
        raise ComponentError("--model-exchange is for native FMUs; pythonfmu's wrapper has co-simulation alone")
    if fmi == "3" and kind == "python":
        raise ComponentError("--fmi 3 is for native FMUs; Python FMUs, by pythonfmu's wrapper, are FMI 2.0")
    if kind == "python" and profile == "real-time":
        raise ComponentError("--profile real-time is for native FMUs; a Python FMU has no bounds on time or memory")
    if kind == "python" and platforms:
        raise ComponentError("--platforms is for native FMUs; a Python FMU always carries linux64 and win64")
    names: dict[str, str] = {}
    for reference in references:
        name = resolve(reference).__name__
        if names.setdefault(name, reference) != reference:
            raise ComponentError(f"{names[name]} and {reference} would both be written to {name}.fmu; build them apart")
