"""Scenarios in other people's tools, and checkers over the exports of all components: the tables of a page of the docs.

    python benchmarks/interop.py docs/use_in_other_tools.md

Each tool runs each scenario, wired by its own interface as in `tests/interop`, and what it gives is compared with our
own master point by point, with whichever algorithm it follows. An output that a tool reads after the inputs were set is
that of the next point: where a signal fits one point on, and not as it stands, it is counted as early. A tool
that is not installed has a row that says so. The tables stand between two markers in the page; without a page they are
printed.
"""

import argparse
import functools
import importlib.metadata
import importlib.util
import logging
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping, Set
from dataclasses import dataclass
from pathlib import Path
from typing import Any, get_args

import numpy as np
from railcosim.components import CATALOGUE
from railcosim.fmus.build import build
from railcosim.fmus.kinds import FmiVersion
from railcosim.orchestrator import load

TESTS = Path(__file__).parents[1] / "tests" / "interop"
MARKS = ("<!-- interop: made by benchmarks/interop.py -->", "<!-- interop: end -->")
SAME = 1e-9
"""Largest deviation of a signal that fits, relative to its largest value where that is above one unit."""
SCENARIOS = {
    "comfort": ("comfort_cruise", {}),
    "CAILC": ("cailc", {"stop_time": 420.0, "settings": ["simulation.record=0.01"]}),
    "fault-tolerant": ("fault_tolerant_cruise", {"stop_time": 60.0, "settings": ["simulation.record=0.01"]}),
}
"""By the name in the table: a shipped scenario, and how much of it is run; of CAILC two trips and the next's begin."""


@functools.cache
def shared(name: str) -> Any:
    """A file of the tests with other tools."""
    sys.path.insert(0, str(TESTS))
    return importlib.import_module(name)


@dataclass(frozen=True)
class Tool:
    """One way of one tool: its row, its Python package, our algorithm that it follows, how it runs a scene."""

    name: str
    package: str
    algorithm: str
    run: Callable[[Any, Path], Mapping[str, Any]]
    reason: str
    """Why outputs come early, or what has to be minded."""


def _libcosim(scene: Any, _: Path) -> Mapping[str, Any]:
    module = shared("test_libcosim")
    return module.series(module.executed(scene), scene)


def _container(scene: Any, folder: Path, *, sequential: bool) -> Mapping[str, Any]:
    module = shared("test_fmu_manipulation_toolbox")
    return module.simulate(scene, module.package(scene, folder, sequential=sequential))


def _fmpy(scene: Any, folder: Path, *, late: bool) -> Mapping[str, Any]:
    module = shared("test_fmpy_container")
    links = module.plants_last(scene)[:: 1 if late else -1]
    return module.simulate(scene, module.mended(module.package(scene, folder, links, first_inputs=late)))


TOOLS = (
    Tool("ecos", "ecospy", "jacobi", lambda scene, _: shared("test_ecos").simulate(scene),
         "reads outputs after the inputs were set"),
    Tool("libcosim", "libcosimpy", "jacobi", _libcosim, "hands outputs on after all have stepped"),
    Tool("fmu-manipulation-toolbox, container", "fmu_manipulation_toolbox", "jacobi",
         functools.partial(_container, sequential=False), "hands outputs on after all have stepped"),
    Tool("the same, `sequential`", "fmu_manipulation_toolbox", "gauss-seidel",
         functools.partial(_container, sequential=True), "steps one by one, in our order"),
    Tool("FMPy's container, forces first", "fmpy", "jacobi", functools.partial(_fmpy, late=True),
         "reads an output when its connection's turn comes: what was set before is seen early"),
    Tool("the same, forces last", "fmpy", "gauss-seidel", functools.partial(_fmpy, late=False),
         "the same, so that a force acts in the step that it belongs to"),
    Tool("OMSimulator 3", "OMSimulator", "gauss-seidel",
         lambda scene, folder: shared("test_omsimulator").simulate(scene, folder), "sorts by dependencies"),
    Tool("PyFMI, initialization by blocks", "pyfmi", "jacobi",
         lambda scene, folder: shared("test_pyfmi").simulate(scene, folder), "hands outputs on after all have stepped"),
)  # fmt: skip


@dataclass(frozen=True)
class Fit:
    """How a tool's signals fit ours: how many do as they stand, one point early, and not; the largest deviation.

    ``mixed`` are those that fit neither and depend on states and inputs directly: read after the inputs were set, they
    are of the states of this point and the inputs of the next, a row that none of ours is.
    """

    plain: int
    early: int
    mixed: int
    off: Mapping[str, float]
    largest: float

    def __str__(self) -> str:
        parts = [f"{self.largest:.0e}", f"{self.plain + self.early} signals"]
        parts += [f"{self.early} of them early"] if self.early else []
        parts += [f"{self.mixed} more mixed"] if self.mixed else []
        if self.off:
            worst = max(self.off, key=self.off.__getitem__)
            parts += [f"**{len(self.off)} more depart**, `{worst}` most: {self.off[worst]:.0e}"]
        return ", ".join(parts)


def fit(ours: Mapping[str, Any], found: Mapping[str, Any], direct: Set[str] = frozenset()) -> Fit:
    """Compare a tool's signals with ours.

    Args:
        ours: signals by name, shape (points,).
        found: those of the tool, by the same names.
        direct: the signals that depend directly on an input and on a state that moves on with the point.
    """
    plain, early, mixed, largest = 0, 0, 0, 0.0
    off = {}
    for name, values in found.items():
        own, got = (np.asarray(each, dtype=float) for each in (ours[name], values))
        if own.shape != got.shape:
            raise ValueError(f"{name}: {len(got)} points, not {len(own)}")
        stands, ahead = _deviation(own, got), _deviation(own[1:], got[:-1])
        if min(stands, ahead) > SAME:
            mixed += name in direct
            if name not in direct:
                off[name] = stands
        elif stands <= SAME:
            plain, largest = plain + 1, max(largest, stands)
        else:
            early, largest = early + 1, max(largest, ahead)
    return Fit(plain, early, mixed, off, largest)


def _deviation(own: Any, got: Any) -> float:
    return float(np.max(np.abs(got - own))) / max(1.0, float(np.max(np.abs(own))))


def version(package: str) -> str:
    """Of an installed distribution."""
    return importlib.metadata.version(package.replace("_", "-"))


def matrix(tools: tuple[Tool, ...] = TOOLS, scenarios: Mapping[str, Any] = SCENARIOS) -> Iterator[str]:
    """Lines of the table of tools over scenarios."""
    conftest = shared("conftest")
    scenes = {}
    for name, (scenario, changes) in scenarios.items():
        scenes[name] = conftest.make_scene(load(scenario, **changes), ("jacobi", "gauss-seidel"))
    yield f"| tool | version | as our | {' | '.join(scenarios)} | what it does |"
    yield "| --- " * (len(scenarios) + 4) + "|"
    for tool in tools:
        missing = conftest.why_not(tool.package)
        if missing:
            yield f"| {tool.name} | not installed here |{' |' * (len(scenarios) + 2)}"
            continue
        cells = []
        for name, scene in scenes.items():
            print(f"{tool.name}: {name}", file=sys.stderr, flush=True)
            with tempfile.TemporaryDirectory() as folder:
                try:
                    found = tool.run(scene, Path(folder))
                except Exception as error:
                    cells.append(f"does not run: {type(error).__name__}")
                    print(f"{tool.name}, {name}: {error}", file=sys.stderr)
                    continue
            shown = {signal: values for signal, values in found.items() if signal in scene.outputs("Real")}
            direct = {name for name in shown if name.rpartition(".")[2].partition("[")[0] == "acceleration"}
            cells.append(str(fit(scene.ours[tool.algorithm], shown, direct)))
        yield f"| {tool.name} | {version(tool.package)} | `{tool.algorithm}` | {' | '.join(cells)} | {tool.reason} |"


# ---------------------------------------------------------------- checkers


def by_fmpy(path: Path) -> list[str]:
    """FMPy's validator: the schema, and rules beyond it."""
    from fmpy.validation import validate_fmu  # noqa: PLC0415

    return [str(problem) for problem in validate_fmu(str(path))]


def by_toolbox(path: Path) -> list[str]:
    """The generic check of fmu-manipulation-toolbox: the schema, by xmlschema."""
    from fmu_manipulation_toolbox.checker import OperationGenericCheck  # noqa: PLC0415
    from fmu_manipulation_toolbox.operations import FMU  # noqa: PLC0415

    told: list[str] = []
    logger = logging.getLogger("fmu_manipulation_toolbox")
    handler = logging.Handler(logging.WARNING)
    handler.emit = lambda record: told.append(record.getMessage())  # type: ignore[method-assign]
    was, logger.disabled = logger.disabled, False
    logger.addHandler(handler)
    try:
        check = OperationGenericCheck()
        FMU(str(path)).apply_operation(check)
    finally:
        logger.removeHandler(handler)
        logger.disabled = was
    return told if check.compliant_with_version or told else ["it is not compliant"]


def by_program(program: str, *options: str) -> Callable[[Path], list[str]]:
    """A checker that is a program: what it says where it does not end with 0."""

    def check(path: Path) -> list[str]:
        done = subprocess.run([program, *options, str(path)], check=False, capture_output=True, text=True, timeout=300)
        return [(done.stderr or done.stdout).strip()] if done.returncode else []

    return check


CHECKERS: dict[str, tuple[Callable[[], bool], Callable[[Path], list[str]]]] = {
    "FMPy": (lambda: importlib.util.find_spec("fmpy") is not None, by_fmpy),
    "fmu-manipulation-toolbox": (
        lambda: importlib.util.find_spec("fmu_manipulation_toolbox") is not None, by_toolbox,
    ),
    "FMUChecker": (lambda: bool(shutil.which("fmuCheck.linux64")), by_program("fmuCheck.linux64", "-l", "2")),
    "fmusim": (lambda: bool(shutil.which("fmusim")), by_program("fmusim")),
}  # fmt: skip


def exports(components: list[str]) -> Iterator[tuple[str, list[Path]]]:
    """Every form in which components can be exported, with their files."""
    for fmi in get_args(FmiVersion):
        print(f"FMI {fmi}", file=sys.stderr, flush=True)
        yield f"FMI {fmi}.0, native", [build(name, kind="native", fmi=fmi) for name in components]
    yield "FMI 2.0, Python", [build(name, kind="python") for name in components]


def checked(components: list[str]) -> Iterator[str]:
    """Lines of the table of checkers over forms of export."""
    yield f"| export of | {' | '.join(CHECKERS)} |"
    yield "| --- " * (len(CHECKERS) + 1) + "|"
    for form, files in exports(components):
        cells = []
        for name, (here, check) in CHECKERS.items():
            if not here():
                cells.append("not installed here")
                continue
            findings = [f"{path.stem}: {finding}" for path in files for finding in check(path)]
            for finding in findings:
                print(f"{name}, {form}: {finding}", file=sys.stderr)
            cells.append(f"{len(findings)} findings")
        yield f"| {len(files)} components, {form} | {' | '.join(cells)} |"


def written(page: str, tables: str) -> str:
    """The page with the tables between its markers.

    Raises:
        ValueError: it has no markers.
    """
    before, begin, rest = page.partition(MARKS[0])
    _, end, after = rest.partition(MARKS[1])
    if not (begin and end):
        raise ValueError(f"the page has no {MARKS[0]} or no {MARKS[1]}")
    return f"{before}{begin}\n\n{tables}\n\n{end}{after}"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("page", nargs="?", type=Path, help="a Markdown file with the markers")
    options = parser.parse_args()
    tables = "\n".join([*matrix(), "", *checked(sorted(CATALOGUE))])
    if options.page is None:
        print(tables)
    else:
        options.page.write_text(written(options.page.read_text(encoding="utf-8"), tables), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
