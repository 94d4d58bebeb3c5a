"""An FMU's binary for another machine, run under an emulator by the importer in ``c/`` on the reference signals."""

import csv
import functools
import io
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import platformdirs
import pytest
from fmpy import read_model_description
from railcosim.components import CATALOGUE
from railcosim.fmus.build import build
from railcosim.fmus.documentation.reference_signals import STEPS
from railcosim.fmus.toolchain import FLAGS, PLATFORMS, has_zig

IMPORTER = Path(__file__).parent / "c" / "importer.c"
HEADERS = Path(fmpy.__file__).parent / "c-code"
SAME = 1e-12
"""Largest deviation, relative above one unit, between a machine's binary and that of linux64."""
TYPES = ("Real", "Integer", "Boolean")


def components():
    """Every component of the catalogue: each fourth in the long tier, the others in the campaign."""
    tiers = (pytest.mark.long, *3 * [pytest.mark.campaign])
    return [pytest.param(name, marks=tiers[k % len(tiers)]) for k, name in enumerate(sorted(CATALOGUE))]


def require(found, what):
    """Skip where the emulator is missing; in CI that is a failure, because it is a hole in what is claimed."""
    reason = f"{what} is missing (.ci/install-emulators installs it)" if not found else ""
    reason = reason or ("" if has_zig() else "ziglang is missing (pip install 'railcosim[cross]')")
    if reason and os.environ.get("CI"):
        pytest.fail(reason, pytrace=False)
    if reason:
        pytest.skip(reason)


@functools.cache
def importer(platform, folder):
    """The importer as a program of a platform."""
    return compile_for(platform, folder / f"importer-{platform}{'.exe' if platform == 'win64' else ''}", IMPORTER)


def compile_for(platform, target, *sources_and_options):
    """A program of a platform."""
    command = [sys.executable, "-m", "ziglang", "cc", "-target", PLATFORMS[platform].targets[0], *FLAGS, "-Werror"]
    command += ["-I", HEADERS, *sources_and_options, "-o", target]
    subprocess.run(command, check=True, env=os.environ | zig_cache())
    return target


def zig_cache():
    """Where ziglang keeps its own C libraries: one place for all sessions, because the first Windows build is slow."""
    usual = Path(platformdirs.user_cache_dir("railcosim", appauthor=False)) / "zig"
    return {"ZIG_GLOBAL_CACHE_DIR": os.environ.get("ZIG_GLOBAL_CACHE_DIR", str(usual))}


class Machine:
    """One platform and what runs its programs here.

    Args:
        platform: a key of `toolchain.PLATFORMS`.
        launcher: the emulator's command, empty for this machine.
        folder: where programs and libraries are put.
        environment: for the emulator.
    """

    def __init__(self, platform, launcher, folder, environment=None):
        self.platform, self.launcher, self.folder = platform, launcher, folder
        self.environment = os.environ | (environment or {})

    def run(self, fmu):
        """The outputs at every communication point of the reference signals, by name."""
        folder = self.folder / f"{fmu.stem}-{self.platform}"
        with zipfile.ZipFile(fmu) as archive:
            archive.extractall(folder)
        library = Path("binaries", PLATFORMS[self.platform].folder, fmu.stem + PLATFORMS[self.platform].suffix)
        description = read_model_description(str(folder))
        inputs, outputs = (
            [[v for v in description.modelVariables if v.causality == causality and v.type == t] for t in TYPES]
            for causality in ("input", "output")
        )
        script = "\n".join(
            [
                *(
                    " ".join(map(str, [len(group), *(v.valueReference for v in group)]))
                    for group in (*inputs, *outputs)
                ),
                *self._rows(folder, fmu.stem, [v.name for group in inputs for v in group]),
            ]
        )
        step = repr(float(description.defaultExperiment.stepSize))
        done = subprocess.run(
            [*self.launcher, importer(self.platform, self.folder), library, description.guid, step, str(STEPS)],
            input=script,
            cwd=folder,
            env=self.environment,
            capture_output=True,
            text=True,
            timeout=300,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        rows = np.array([[float(x) for x in line.split()] for line in done.stdout.splitlines()])
        assert len(rows) == STEPS + 1
        return {v.name: rows[:, k] for k, v in enumerate(v for group in outputs for v in group)}

    @staticmethod
    def _rows(folder, name, columns):
        path = folder / "documentation" / f"{name}_in.csv"
        rows = list(csv.DictReader(io.StringIO(path.read_text()))) if path.is_file() else [{}] * (STEPS + 1)
        return [" ".join(row[column] for column in columns) for row in rows[:STEPS]]


def bare_host(machine, folder, name):
    """What the bare host of an unpacked real-time FMU writes on a machine, by column."""
    sources = (folder / "sources" / "all.c", folder / "resources" / "host" / "host.c")
    options = ("-DFMI2_OVERRIDE_FUNCTION_PREFIX", "-DMAX_INSTANCES=1", "-lm")
    host = compile_for(machine.platform, folder / f"host-{machine.platform}", *sources, *options)
    rows = (folder / "documentation" / f"{name}_in.csv").read_text()
    done = subprocess.run([*machine.launcher, host], input=rows, capture_output=True, text=True, check=True)
    return columns(done.stdout)


def columns(text):
    """A table of numbers by column."""
    return {key: np.array(column, dtype=float) for key, *column in zip(*csv.reader(io.StringIO(text)), strict=True)}


def compare(name, here, there):
    """Run a component's FMU on this machine and on another one; the same trajectory, and the one in its reference."""
    with pytest.MonkeyPatch.context() as patch:
        for key, value in zig_cache().items():
            patch.setenv(key, value)
        fmu = build(name, kind="native", platforms=tuple(PLATFORMS))  # in the cache for a release of all
    ours, theirs = here.run(fmu), there.run(fmu)
    with zipfile.ZipFile(fmu) as archive:
        reference = columns(archive.read(f"documentation/{name}_ref.csv").decode())
    deviation = largest(ours, theirs)
    equal = all(ours[k].tobytes() == theirs[k].tobytes() for k in ours)
    print(f"{name}, {there.platform}: {'bit-equal to' if equal else f'{deviation:.2g} from'} linux64", end=", ")
    print(f"{largest({k: reference[k] for k in theirs}, theirs):.2g} from plain Python")
    assert deviation <= SAME
    assert largest({k: reference[k] for k in theirs}, theirs) <= SAME


def largest(ours, theirs):
    """Largest deviation between two trajectories, relative above one unit."""
    return max(float(np.max(np.abs(theirs[k] - ours[k]) / np.maximum(1.0, np.abs(ours[k])))) for k in ours)
