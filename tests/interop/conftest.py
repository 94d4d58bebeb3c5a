"""What the tests with other people's tools share: the comfort scenario plainly, its results, which tools run.

`need` skips a test whose tool is not installed. Where CI is set, fewer than four tools are a failure, not a skip.
"""

import functools
import importlib
import os
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from railcosim.fmus.build import native_problem
from railcosim.fmus.references import resolve
from railcosim.orchestrator import load, run
from railcosim.orchestrator.fmi.archive import Workspace
from railcosim.orchestrator.fmi.interface import Interface, Variable
from railcosim.orchestrator.run.checking import check

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"
TOOLS = ("fmpy", "libcosimpy", "ecospy", "fmu_manipulation_toolbox", "OMSimulator", "pyfmi")
LEAST_IN_CI = 4
SAME = 1e-9
"""Largest deviation from our own run, relative above one unit: what the tools must keep."""


@functools.cache
def why_not(tool):
    """Why a tool cannot run here; empty if it can. A library that its package lacks is an OSError."""
    try:
        importlib.import_module(tool)
    except (ImportError, OSError) as error:
        return f"{tool} cannot be imported: {error}"
    return ""


@pytest.fixture(scope="session", autouse=True)
def own_cache(session_cache):
    """The session's cache: no test may be served by what an earlier version left in the user's."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RAILCOSIM_CACHE", str(session_cache))
        yield


@pytest.fixture(scope="session", autouse=True)
def enough_tools(request):
    """In CI's long tier, a tool that is not there is a hole in what is claimed, not a test to skip."""
    if not os.environ.get("CI") or not any(item.get_closest_marker("long") for item in request.session.items):
        return
    missing = [why_not(tool) for tool in TOOLS if why_not(tool)]
    problem = native_problem(resolve("PointMassTrain"))
    if problem or len(TOOLS) - len(missing) < LEAST_IN_CI:
        reasons = "; ".join(filter(None, [problem, *missing]))
        pytest.fail(f"fewer than {LEAST_IN_CI} tools can run the native FMUs here: {reasons}", pytrace=False)


@pytest.fixture(scope="session")
def native():
    """Skip where no native FMU can be made."""
    problem = native_problem(resolve("PointMassTrain"))
    if problem:
        pytest.skip(problem)


@pytest.fixture(scope="session")
def need():
    """Give a tool's module, or skip the test."""

    def give(tool):
        if why_not(tool):
            pytest.skip(why_not(tool))
        return importlib.import_module(tool)

    return give


@dataclass(frozen=True)
class Part:
    """One instance: its FMU file, what it shows, and start values by variable."""

    name: str
    path: Path
    interface: Interface
    starts: tuple[tuple[Variable, object], ...]

    @property
    def outputs(self):
        return self.interface.of("output")


@dataclass(frozen=True)
class Link:
    """One scalar connection; `first` is the value it carries at time zero."""

    source: Part
    output: Variable
    target: Part
    input: Variable
    first: object


@dataclass(frozen=True)
class Scene:
    """A scenario as other tools need it, and what our own master makes of it by algorithm and signal."""

    parts: dict[str, Part]
    links: tuple[Link, ...]
    order: tuple[str, ...]
    step: float
    stop_time: float
    ours: dict[str, dict[str, np.ndarray]]

    @property
    def points(self):
        return round(self.stop_time / self.step) + 1

    def outputs(self, *types):
        """Names of all outputs of the given types, or of any."""
        chosen = [(part, v) for part in self.parts.values() for v in part.outputs if not types or v.type in types]
        return {f"{part.name}.{v.name}" for part, v in chosen}

    def deviation(self, algorithm, found):
        """Largest deviation of a tool's signals from ours, relative above one unit."""
        errors = {name: float(np.max(self._error(algorithm, name, values))) for name, values in found.items()}
        name = max(errors, key=errors.__getitem__)
        print(f"largest deviation from {algorithm}: {errors[name]:.3g} in {name}, {len(found)} signals")
        return errors[name]

    def _error(self, algorithm, name, values):
        ours = np.asarray(self.ours[algorithm][name], dtype=float)
        values = np.asarray(values, dtype=float)
        assert len(values) == len(ours), f"{name}: {len(values)} points, not {len(ours)}"
        return np.abs(values - ours) / np.maximum(1.0, np.abs(ours))


def make_scene(system, algorithms):
    """A system for other tools, and our own results by algorithm; its FMUs are native."""
    with Workspace() as workspace:
        checked = check(system, workspace, "native")
    ours = {name: run(system, algorithm=name, kind="native") for name in algorithms}
    parts = {
        name: Part(
            name,
            model.path,
            model.interface,
            tuple((model.interface.variables[k], v) for k, v in checked.wiring.starts[name].items()),
        )
        for name, model in checked.models.items()
    }
    links = tuple(
        Link(
            parts[link.source[0]],
            parts[link.source[0]].interface.variables[link.source[1]],
            parts[link.target[0]],
            parts[link.target[0]].interface.variables[link.target[1]],
            ours[algorithms[0]][".".join(link.source)][0],
        )
        for link in checked.wiring.links
    )
    results = {algorithm: {name: result[name] for name in result.names()} for algorithm, result in ours.items()}
    return Scene(parts, links, checked.order.sequence, system.stepping.step, system.stepping.stop_time, results)


@pytest.fixture(scope="session")
def benchmark():
    """Give a program of `benchmarks` by its name, or skip the test."""
    if not BENCHMARKS.is_dir():
        pytest.skip("the benchmarks are not here")
    before = set(sys.modules)
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(BENCHMARKS))
        yield importlib.import_module
    for name in set(sys.modules) - before:
        if str(getattr(sys.modules[name], "__file__", "")).startswith(str(BENCHMARKS)):
            sys.modules.pop(name)


@pytest.fixture(scope="session", name="make_scene")
def _make_scene():
    return make_scene


@pytest.fixture(scope="session")
def scene(native):
    """The comfort scenario (four trains, four controllers, a schedule, a gust; 350 s at 0.1 s) with native FMUs."""
    return make_scene(load("comfort_cruise"), ("jacobi", "gauss-seidel"))
