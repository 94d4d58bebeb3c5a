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
import importlib.util
import logging
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, get_args

from others import fit, put, shared, version
from railcosim.components import CATALOGUE
from railcosim.fmus.build import build
from railcosim.fmus.kinds import FmiVersion
from railcosim.orchestrator import load

MARKS = ("<!-- interop: made by benchmarks/interop.py -->", "<!-- interop: end -->")
SCENARIOS = {
    "comfort": ("comfort_cruise", {}),
    "CAILC": ("cailc", {"stop_time": 420.0, "settings": ["simulation.record=0.01"]}),
    "fault-tolerant": ("fault_tolerant_cruise", {"stop_time": 60.0, "settings": ["simulation.record=0.01"]}),
}
"""By the name in the table: a shipped scenario, and how much of it is run; of CAILC two trips and the next's begin."""


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
    return module.series(module.executed(scene))


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
    for fmi in get_args(FmiVersion):
        both = [build(name, kind="native", profile="model-exchange", fmi=fmi) for name in components]
        yield f"FMI {fmi}.0, native, with model exchange", both
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


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("page", nargs="?", type=Path, help="a Markdown file with the markers")
    options = parser.parse_args()
    tables = "\n".join([*matrix(), "", *checked(sorted(CATALOGUE))])
    put(options.page, tables, MARKS)
    return 0


if __name__ == "__main__":
    sys.exit(main())
