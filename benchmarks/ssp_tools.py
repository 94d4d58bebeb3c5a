"""Tools that read SSP archives, each run in a process of its own, because some of them end it where they fail.

A `Task` says what is in an archive, `played` what a tool makes of it: its Real outputs by `element.variable`, a value
a point. Names of elements in each other are joined by `_` and brackets left out, as our own export does it.
Outputs of nested elements are given by those tools that show them.
"""

import dataclasses
import json
import logging
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from others import shared

PATIENCE = 600.0
"""Seconds that a tool may take for an archive."""
STRUCTURE = "OspSystemStructure.xml"


class ToolError(Exception):
    """A tool did not run an archive; why not, in a few words."""


@dataclass
class Task:
    """What is to be run, and what to look at.

    Attributes:
        archive: the file. start, step: in s. points: communication points, the first included.
        components: the names of those at the top, in the order of the file.
        elements: the paths of all that are FMUs, names joined by dots.
        outputs: of each, the names of its Real outputs with their value references.
        settings: of each, the start values that the archive gives, as our own reader finds them.
        parameter_set: the name of the first set of values; Ecos has to be told one.
    """

    archive: str
    start: float
    step: float
    points: int
    components: list[str] = field(default_factory=list)
    elements: list[str] = field(default_factory=list)
    outputs: dict[str, dict[str, int]] = field(default_factory=dict)
    settings: dict[str, dict[str, Any]] = field(default_factory=dict)
    parameter_set: str = ""

    @property
    def stop(self) -> float:
        return self.start + (self.points - 1) * self.step

    def signals(self) -> Iterator[tuple[str, str, str, int]]:
        """Name, element, variable and value reference of each."""
        for element, outputs in self.outputs.items():
            for variable, reference in outputs.items():
                yield f"{plain(element)}.{variable}", element, variable, reference


def plain(element: str) -> str:
    """The name of an element under which signals are compared."""
    return re.sub(r"\W", "_", element.replace("]", ""), flags=re.ASCII)


# ---------------------------------------------------------------- the tools, in a process of their own


def _fmpy(task: Task, *, given: bool) -> dict[str, Any]:
    from fmpy.ssp.simulation import simulate_ssp  # noqa: PLC0415
    from fmpy.ssp.ssd import Parameter, ParameterSet  # noqa: PLC0415

    parameters = [
        Parameter(name=f"{element}.{variable}", value=value)
        for element, values in task.settings.items()
        for variable, value in values.items()
    ]
    values = ParameterSet(name="given", parameters=parameters) if given else None
    last = task.start + (task.points - 0.5) * task.step  # it adds steps up, and takes one more where that falls short
    table = simulate_ssp(task.archive, task.start, last, task.step, parameter_set=values)
    shown = {name: f"{element}.{variable}" for name, element, variable, _ in task.signals()}
    return {name: table[column] for name, column in shown.items() if column in table.dtype.names}


def _libcosim(task: Task, *, osp: bool) -> dict[str, Any]:
    from libcosimpy._internal import get_last_error_message  # noqa: PLC0415
    from libcosimpy.CosimExecution import CosimExecution  # noqa: PLC0415

    observed = shared("test_libcosim")
    if osp:
        engine = CosimExecution.from_osp_config_file(str(Path(task.archive).parent / STRUCTURE))
    else:
        try:
            engine = CosimExecution.from_ssp_file(task.archive, round(task.step * observed.SECOND))
        except AssertionError:
            raise ToolError(get_last_error_message()) from None
    slaves = {element: engine.slave_index_from_instance_name(element) for element in task.elements}
    signals = {n: (slaves[e], reference) for n, e, _, reference in task.signals() if slaves[e] is not None}
    observer = observed.Observer(engine, signals, task.points)
    if not engine.step(task.points - 1):
        raise ToolError("a step fails")
    return dict(observer.series())


def _ecos(task: Task) -> dict[str, Any]:
    from ecospy import EcosLib, EcosSimulation  # noqa: PLC0415

    EcosLib.set_log_level("warn")
    engine = EcosSimulation(ssp_path=task.archive, step_size=task.step)
    if not engine.init(start_time=task.start, parameter_set=task.parameter_set or None):
        raise ToolError(EcosLib.get_last_error())
    names = {f"{element}.{variable}": name for name, element, variable, _ in task.signals() if "." not in element}
    signals = shared("test_ecos").recorded(engine, names, task.points - 1)
    return {names[name]: values for name, values in signals.items()}


def _toolbox(task: Task, *, given: bool) -> dict[str, Any]:
    from fmu_manipulation_toolbox.assembly import Assembly  # noqa: PLC0415

    logging.getLogger("fmu_manipulation_toolbox").disabled = True  # every unconnected input is an error to it
    archive = Path(task.archive)
    assembly = Assembly(archive.name, default_step_size=task.step, fmu_directory=archive.parent)
    names = dict(zip(task.components, assembly.root.fmu_names_list, strict=True))
    for name, element, variable, _ in task.signals():
        if element in names:
            assembly.root.add_output(names[element], variable, f"out.{name}")
    for element, values in task.settings.items() if given else ():
        for variable, value in values.items():
            text = str(value).lower() if isinstance(value, bool) else str(value)
            assembly.root.add_start_value(names[element], variable, text)
    assembly.make_fmu(filename="container.fmu")
    played = shared("test_fmu_manipulation_toolbox").played
    return dict(played(archive.parent / "container.fmu", task.step, task.stop, task.start))


def _omsimulator(task: Task) -> dict[str, Any]:
    """Not run where this was written: by the interface of version 3."""
    from OMSimulator import SSP, Capi, CRef, Settings  # noqa: PLC0415

    Settings.suppressPath = True
    model = SSP(task.archive)
    made = model.instantiate()
    made.setStopTime(task.stop)
    made.initialize()
    rows: dict[str, list[float]] = {name: [] for name, *_ in task.signals()}
    for k in range(task.points):
        if k and Capi.stepUntil("model", task.start + k * task.step) != 0:
            raise ToolError("a step fails")
        for name, element, variable, _ in task.signals():
            rows[name].append(made.getValue(CRef(made.system.name, *element.split("."), variable)))
    made.terminate()
    return rows


@dataclass(frozen=True)
class Tool:
    """One way of one tool: its name in the tables, its Python package, how it runs a task.

    Attributes:
        osp: whether it reads libcosim's own format, which stands beside the archive.
        values: whether it gives variables the values that the archive binds to them.
        settled: whether inputs have the values of what they are connected to before the first step; else they are 0.
    """

    name: str
    package: str
    run: Callable[[Task], dict[str, Any]]
    osp: bool = False
    values: bool = True
    settled: bool = True


_TOOLBOX = "fmu-manipulation-toolbox"
TOOLS = {
    "libcosim": Tool("libcosim", "libcosimpy", lambda task: _libcosim(task, osp=False)),
    "libcosim-osp": Tool(f"libcosim, `{STRUCTURE}`", "libcosimpy", lambda task: _libcosim(task, osp=True), osp=True),
    "ecos": Tool("ecos", "ecospy", _ecos),
    "fmpy": Tool("FMPy", "fmpy", lambda task: _fmpy(task, given=False), values=False, settled=False),
    "fmpy-given": Tool("FMPy, handed the values", "fmpy", lambda task: _fmpy(task, given=True), settled=False),
    "toolbox": Tool(_TOOLBOX, _TOOLBOX.replace("-", "_"), lambda task: _toolbox(task, given=False), values=False),
    "toolbox-given": Tool(
        f"{_TOOLBOX}, handed the values", _TOOLBOX.replace("-", "_"), lambda task: _toolbox(task, given=True)
    ),
    "omsimulator": Tool("OMSimulator 3", "OMSimulator", _omsimulator),
}


def played(tool: str, task: Task) -> dict[str, Any]:
    """What a tool makes of an archive.

    Raises:
        ToolError: it does not run it; why not.
    """
    with tempfile.TemporaryDirectory() as folder:
        given, results = Path(folder) / "task.json", Path(folder) / "signals.npz"
        given.write_text(json.dumps(dataclasses.asdict(task)), encoding="utf-8")
        command = [sys.executable, __file__, tool, str(given), str(results)]
        try:
            done = subprocess.run(command, check=False, capture_output=True, text=True, timeout=PATIENCE)
        except subprocess.TimeoutExpired:
            raise ToolError(f"takes over {PATIENCE:g} s") from None
        if not results.is_file():
            said = (done.stderr.strip() or done.stdout.strip() or "says nothing").splitlines()[-1]
            said = said.replace(f"{Path(task.archive).parent}/", "")
            said = re.sub(r"^(\w+\.)*(\w+: )", r"\2", said).removeprefix("ToolError: ")
            how = f"ends by signal {-done.returncode}: " if done.returncode < 0 else ""
            raise ToolError(f"{how}{said}")
        with np.load(results) as arrays:
            return {name: arrays[name] for name in arrays.files}


if __name__ == "__main__":
    name, given, results = sys.argv[1:]
    found = TOOLS[name].run(Task(**json.loads(Path(given).read_text(encoding="utf-8"))))
    np.savez(results, **{signal: np.asarray(values, dtype=float) for signal, values in found.items()})
