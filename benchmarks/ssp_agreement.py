"""SSP archives in every tool that is installed: who agrees with whom, and who departs from the standard, and where.

    python benchmarks/ssp_agreement.py                          # the tables
    python benchmarks/ssp_agreement.py --page docs/ssp.md       # into a page, between its marks
    python benchmarks/ssp_agreement.py FOLDER                   # the archives of a folder instead

Scenarios of four articles are exported by `orchestrate export`, and each tool reads the archive by itself. Real signals
are compared point by point, as they stand or one point on (*early*): a tool that reads outputs after the inputs were
set, or that records a step's results at its begin, is one row ahead of us. Then small archives, one a clause of the
standard, with the value that it gives by hand. A tool that is not installed has a row that says so.
"""

import argparse
import contextlib
import copy
import re
import shutil
import sys
import tempfile
import zipfile
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import ssp_clauses
from lxml import etree
from others import SAME, fit, put, shared, version
from railcosim.orchestrator import Event, System, load, run
from railcosim.orchestrator.errors import RailcosimError
from railcosim.orchestrator.fmi.archive import Workspace
from railcosim.orchestrator.packing import export
from railcosim.orchestrator.run.checking import check
from railcosim.orchestrator.ssp.package import DEFAULT, Package
from railcosim.orchestrator.ssp.structure import Element, StructureReader
from railcosim.orchestrator.system import Connection
from ssp_clauses import CLAUSES, Clause
from ssp_tools import STRUCTURE, TOOLS, Task, Tool, ToolError, plain, played

MARKS = ("<!-- agreement: made by benchmarks/ssp_agreement.py -->", "<!-- agreement: end -->")
SCENARIOS = {
    "comfort": ("comfort_cruise", 350.0),
    "tunable potential": ("tunable_potential", 100.0),
    "CAILC": ("cailc", 210.0),
    "fault-tolerant": ("fault_tolerant_cruise", 20.0),
}
"""By the name in the tables: a scenario of each article, and how much of it is run, in s; of CAILC a trip and more."""
OURS = "railcosim, `jacobi`"


@dataclass
class Outcome:
    """What all tools make of one archive: signals by tool, or why there are none.

    Beside each that leaves something out stand our own without it, by (values, settled) of the tool.
    """

    signals: dict[str, Mapping[str, Any]] = field(default_factory=dict)
    reasons: dict[str, str] = field(default_factory=dict)
    without: dict[tuple[bool, bool], Mapping[str, Any]] = field(default_factory=dict)


def described(archive: Path, *, stop_time: float | None = None, step: float | None = None) -> tuple[Task, System]:
    """What an archive holds, and our own system of it under `jacobi`, every point recorded.

    Args:
        archive: the file.
        stop_time, step: other times than its own, in s.
    """
    system = load(archive, algorithm="jacobi", stop_time=stop_time, step=step)
    stepping = system.stepping
    stepping.record = stepping.step
    with Workspace() as workspace, tempfile.TemporaryDirectory() as folder:
        checked = check(system, workspace)
        _, root = StructureReader().top(Package(archive, archive.name, Path(folder)), DEFAULT)
    points = round((stepping.stop_time - stepping.start_time) / stepping.step) + 1
    task = Task(str(archive), stepping.start_time, stepping.step, points)
    with zipfile.ZipFile(archive) as opened:
        structure = etree.fromstring(opened.read(DEFAULT))
    task.components = [one.get("name") for one in structure.iterfind("{*}System/{*}Elements/{*}Component")]
    for path, (name, model) in zip(_components(root, ()), checked.models.items(), strict=True):
        element = ".".join(path)
        reals = [one for one in model.interface.of("output") if one.type == "Real"]
        task.elements.append(element)
        task.outputs[element] = {one.name: one.reference for one in reals}
        task.settings[element] = dict(checked.wiring.starts[name])
    task.parameter_set = next(_sets(archive), "")
    return task, system


def _components(element: Element, path: tuple[str, ...]) -> Iterator[tuple[str, ...]]:
    if element.fmu is not None:
        yield path
    for name, inner in element.inner.items():
        yield from _components(inner, (*path, name))


def _sets(archive: Path) -> Iterator[str]:
    """The names of all sets of values."""
    with zipfile.ZipFile(archive) as opened:
        for name in opened.namelist():
            if name.endswith((".ssd", ".ssv")):
                yield from (one.get("name") for one in etree.fromstring(opened.read(name)).iter("{*}ParameterSet"))


def ours(task: Task, system: System) -> dict[str, Any]:
    """Our own results, under the names in which all are compared."""
    result = run(system)
    names = dict(zip(system.instances, task.elements, strict=False))  # what was added stands last
    found = {f"{plain(element)}.{v}": f"{name}.{v}" for name, element in names.items() for v in task.outputs[element]}
    return {name: np.asarray(result[signal]) for name, signal in found.items()}


def without(task: Task, system: System, values: bool, settled: bool) -> dict[str, Any]:
    """Our own results without the archive's values, or with nothing handed on before the first step.

    Args:
        task, system: of the archive.
        values: whether variables have the archive's values, not those that the FMUs begin with by themselves.
        settled: whether inputs begin with the values of what they are connected to; else they are 0 until then.
    """
    system = copy.deepcopy(system)
    if not values:
        with Workspace() as workspace:
            models = check(system, workspace).models
        for element, (name, instance) in zip(task.elements, system.instances.items(), strict=True):
            own = models[name].interface.variables
            kept = (name for name in task.settings[element] if own[name].causality == "input" or name == "seed")
            instance.start = {name: own[name].start for name in kept}  # what we would ask for, or choose ourselves
    if not settled:
        _hold_back(system, task)
    return ours(task, system)


def _hold_back(system: System, task: Task) -> None:
    """Let nothing be handed on before the first step has been made."""
    with Workspace() as workspace:
        models = check(system, workspace).models
    begin, held = task.start + task.step, []
    for one in system.connections:
        instance, _, variable = one.source.partition(".")
        if models[instance].interface.variables[variable].type == "Real":
            held.append(Connection("nothing.value", one.target, convert=False))
            system.events.append(Event(one.target, "connect", begin, source=one))
        else:
            held.append(one)
            system.events.append(Event(one.source, "override", task.start, value=0, duration=task.step))
    system.connections = held
    system.add("nothing", "Schedule", values=0.0)


def outcome(archive: Path, tools: Iterable[str], *, explained: bool = True, **times: float | None) -> Outcome:
    """Run an archive in tools.

    Args:
        archive: the file; tools leave files beside it.
        tools: names of some of `TOOLS`.
        explained: whether to run ours as well without what a tool leaves out.
        times: other times than its own, for `described`.

    Raises:
        RailcosimError: we cannot run it ourselves.
    """
    task, system = described(archive, **times)
    found = Outcome({OURS: ours(task, system)})
    for name in tools:
        print(f"{archive.stem}: {name}", file=sys.stderr, flush=True)
        try:
            if TOOLS[name].osp:
                export(system, archive.parent / STRUCTURE)
            found.signals[name] = played(name, task)
        except (ToolError, RailcosimError) as error:
            found.reasons[name] = str(error)
            print(f"{archive.stem}: {name}: {error}", file=sys.stderr)
            continue
        kept = TOOLS[name].values, TOOLS[name].settled
        if explained and not all(kept) and kept not in found.without:
            with contextlib.suppress(RailcosimError):  # what the FMUs begin with by themselves may be refused by us
                found.without[kept] = without(task, system, *kept)
    return found


def installed(tools: Mapping[str, Tool] = TOOLS) -> dict[str, str]:
    """Why a tool is not here, or nothing, by its name."""
    return {name: shared("conftest").why_not(tool.package) for name, tool in tools.items()}


def against_ours(outcomes: Mapping[str, Outcome]) -> Iterator[str]:
    """Lines of the table of tools over archives: how each tool's signals fit ours."""
    yield f"| tool | version | {' | '.join(outcomes)} |"
    yield "| --- " * (len(outcomes) + 2) + "|"
    for name, missing in installed().items():
        tool = TOOLS[name]
        if missing:
            yield f"| {tool.name} | not installed here |{' |' * len(outcomes)}"
            continue
        cells = [_fit(found, name, found.signals[OURS]) for found in outcomes.values()]
        yield f"| {tool.name} | {version(tool.package)} | {' | '.join(cells)} |"
        if not (tool.values and tool.settled):
            lacks = "no values of the archive" if not tool.values else ""
            lacks += " and " * (not tool.values and not tool.settled)
            lacks += "nothing handed on before the first step" if not tool.settled else ""
            cells = [_fit(found, name, found.without.get((tool.values, tool.settled))) for found in outcomes.values()]
            yield f"| its signals beside ours with {lacks} | | {' | '.join(cells)} |"


def _fit(found: Outcome, name: str, own: Mapping[str, Any] | None) -> str:
    """How a tool's signals fit some of ours."""
    if name in found.reasons:
        return "does not run"
    if own is None:
        return "ours does not run so"
    return beside(own, found.signals[name])


def beside(own: Mapping[str, Any], signals: Mapping[str, Any]) -> str:
    """How signals fit some of ours; of ours accelerations depend on states and inputs directly."""
    if not signals:
        return "shows no signal of ours"
    direct = {one for one in signals if re.fullmatch(r".*\.acceleration(\[\d+\])?", one)}
    try:
        return str(fit(own, signals, direct))
    except ValueError as error:  # it has another number of points
        return str(error)


def among_each_other(outcomes: Mapping[str, Outcome]) -> Iterator[str]:
    """Lines of the table of tools by tools: the largest deviation of a signal of both, over all archives."""
    names = [name for name in [OURS, *TOOLS] if any(name in one.signals for one in outcomes.values())]
    yield f"| | {' | '.join(_called(name) for name in names[:-1])} |"
    yield "| --- " * len(names) + "|"
    for k, name in enumerate(names[1:], 1):
        cells = [_pair(outcomes, name, other) for other in names[:k]] + [""] * (len(names) - 1 - k)
        yield f"| {_called(name)} | {' | '.join(cells)} |"


def _called(name: str) -> str:
    return TOOLS[name].name if name in TOOLS else name


def _pair(outcomes: Mapping[str, Outcome], one: str, other: str) -> str:
    worst: list[float] = []
    for found in outcomes.values():
        a, b = found.signals.get(one, {}), found.signals.get(other, {})
        worst += [deviation(np.asarray(a[name]), np.asarray(b[name])) for name in a if name in b]
    if not worst:
        return "nothing in common"
    apart = sum(not each <= SAME for each in worst)
    return f"**{max(worst):.0e}** ({apart} of {len(worst)})" if apart else f"{max(worst):.0e}"


def deviation(a: Any, b: Any) -> float:
    """Of two records of one signal, as they stand or one of them a point on; relative above one unit.

    Infinite where one of them holds what is no finite number.
    """
    if not (np.isfinite(a).all() and np.isfinite(b).all()):
        return np.inf
    length, largest = min(len(a), len(b)), max(1.0, *(float(np.max(np.abs(x))) for x in (a, b)))
    a, b = a[:length], b[:length]
    pairs = ((a, b), (a[1:], b[:-1]), (a[:-1], b[1:]))
    return min(float(np.max(np.abs(x - y))) for x, y in pairs) / largest


def shipped(folder: Path, tools: Iterable[str], scenarios: Mapping[str, tuple[str, float]]) -> dict[str, Outcome]:
    """What becomes of shipped scenarios as archives, by the names in the tables."""
    outcomes = {}
    for name, (scenario, stop) in scenarios.items():
        place = folder / scenario
        place.mkdir()
        export(load(scenario, stop_time=stop), place / f"{scenario}.ssp")
        outcomes[name] = outcome(place / f"{scenario}.ssp", tools)
    return outcomes


def clauses(folder: Path, tools: Iterable[str], chosen: Iterable[Clause] = CLAUSES) -> dict[str, list[float | str]]:
    """The last value that counts for each clause, or why there is none, by tool, ours first."""
    fmus = ssp_clauses.parts(folder)
    found: dict[str, list[float | str]] = {}
    for number, clause in enumerate(chosen):
        place = folder / f"clause_{number}"
        place.mkdir()
        made = outcome(ssp_clauses.write(clause, fmus, place / "clause.ssp"), tools, explained=False, step=0.1)
        for name in [OURS, *tools]:
            signal = made.signals.get(name, {}).get(clause.signal)
            value = float(signal[-1]) if signal is not None else made.reasons.get(name, "shows no such signal")
            found.setdefault(name, []).append(value)
    return found


def keeps(clause: Clause, value: float | str) -> bool:
    """Whether a tool gives what the clause says."""
    return not isinstance(value, str) and abs(value - clause.value) <= SAME * max(1.0, abs(clause.value))


def by_clause(found: Mapping[str, list[float | str]], chosen: Iterable[Clause] = CLAUSES) -> Iterator[str]:
    """Lines of the table of clauses by tools, and of what tools said that did not run one."""
    yield f"| section | what it says | by hand | {' | '.join(_called(name) for name in found)} |"
    yield "| --- " * (len(found) + 3) + "|"
    for number, clause in enumerate(chosen):
        cells = [_verdict(clause, values[number]) for values in found.values()]
        yield f"| {clause.heading} | {clause.says} | {clause.value:g}: {clause.why} | {' | '.join(cells)} |"
    yield ""
    for name, values in found.items():
        for reason in dict.fromkeys(value for value in values if isinstance(value, str)):
            said = reason if len(reason) <= 120 else f"{reason[:117]}..."
            count = f", {values.count(reason)} times" if values.count(reason) > 1 else ""
            yield f"- {_called(name)}: `{said.replace('`', '')}`{count}"


def _verdict(clause: Clause, value: float | str) -> str:
    if isinstance(value, str):
        return "—"
    if keeps(clause, value):
        return "yes"
    return f"{value:g}: no conversion" if value == clause.unconverted else f"**{value:g}**"


def of_folder(folder: Path, place: Path, tools: Iterable[str]) -> dict[str, Outcome]:
    """What becomes of the archives of a folder, those that we run; what is said of others goes to the error output."""
    outcomes = {}
    for number, archive in enumerate(sorted(folder.rglob("*.ssp"))):
        own = place / str(number)
        own.mkdir()
        try:
            name = archive.relative_to(folder).with_suffix("").as_posix()
            outcomes[name] = outcome(Path(shutil.copy(archive, own)), tools)
        except RailcosimError as error:
            print(f"{archive}: we do not run it: {error}", file=sys.stderr)
    return outcomes


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?", type=Path, help="whose archives to take instead of ours")
    parser.add_argument("--page", type=Path, help="a Markdown file with the marks")
    options = parser.parse_args()
    here = [name for name, missing in installed().items() if not missing]
    with tempfile.TemporaryDirectory() as name:
        place = Path(name)
        outcomes = of_folder(options.folder, place, here) if options.folder else shipped(place, here, SCENARIOS)
        lines = [*against_ours(outcomes), "", *among_each_other(outcomes)]
        if not options.folder:
            plain = [name for name in here if not name.endswith(("-given", "-osp"))]
            lines += ["", *by_clause(clauses(place, plain))]
    put(options.page, "\n".join(lines), MARKS)
    return 0


if __name__ == "__main__":
    sys.exit(main())
