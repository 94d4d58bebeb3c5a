"""A live page's part, out of the record of a run: the system it was, its plan, its models compiled for a page."""

from __future__ import annotations

import base64
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ....fmus.build import build
from ....fmus.toolchain import PLATFORMS
from ... import world
from ...errors import ScenarioError
from ...fmi import Kind, Model, Workspace, is_fmu_name, load_fmu, load_models
from ...problems import Problem
from ...run import Checked, assembled, check, read_record
from ...scenario import untrusted_code
from ...system import Connection, Event, Instance, Judged, Provenance, Stepping, System
from .controls import controls_of
from .plan import plan_of, refusals

_WASM = PLATFORMS["wasm"]
_RESOURCES = Path(__file__).parents[1] / "resources"


@dataclass(frozen=True)
class Live:
    """What a live page has beside what every page has.

    Attributes:
        data: for its script: the plan, the controls, and all parameters of the run.
        modules: base64 of the compressed (RFC 1951) WebAssembly modules, each once.
    """

    data: dict[str, Any]
    modules: list[str]

    @property
    def section(self) -> str:
        """Where the controls go, with the modules and the thread's script, neither of which a browser takes for one."""
        worker = _resource("master.js") + _resource("worker.js")
        return (
            f"<style>{_resource('live.css')}</style>"
            '<section id="live"><h2>Live</h2><noscript><p>Live models need JavaScript.</p></noscript></section>'
            f'<script type="text/plain" id="worker">{worker}</script>'
            + "".join(f'<script type="text/plain" data-module>{text}</script>' for text in self.modules)
        )


def _resource(name: str) -> str:
    return world.read_text(_RESOURCES / name, encoding="utf-8")


def check_live(system: System, kind: Kind) -> None:
    """Refuse what a live page could not do, before a system runs; compile its models for a page.

    Args:
        system: what is to run.
        kind: as which kind of model.

    Raises:
        ScenarioError: it cannot be checked, or done; all reasons together.
        ComponentError: a model cannot be compiled for a page.
    """
    with Workspace() as workspace:
        checked = check(system, workspace, kind)
        kinds: dict[str, str] = {name: model.kind for name, model in checked.models.items()}
        if problems := [*_unable(kinds), *refusals(system, checked)]:
            raise ScenarioError(problems)
        _modules(checked, workspace)


def make_live(directory: Path, *, trust: bool = False) -> Live:
    """Make it.

    Args:
        directory: of a run.
        trust: whether FMU files that the run names are loaded, and Python code from outside of its scenario's folder
            is imported: the plan is that of a master with instances.

    Raises:
        ScenarioError: a page cannot do what the run did, or the models are no longer those of the run; all reasons
            together, before anything is compiled.
        ComponentError: a model cannot be compiled for a page.
    """
    record = read_record(directory)
    problems = _unrepeatable(record)
    if problems:
        raise ScenarioError(problems)
    system = _system(record, directory)
    strange = [] if trust else [*untrusted_code(system), *_untrusted_files(system)]
    if strange:
        raise ScenarioError(strange)
    with Workspace() as workspace:
        _tell_truth_values(system, load_models(system, workspace, "native"))
        checked = check(system, workspace, "native")
        problems = [*refusals(system, checked), *_changed(record, checked)]
        if problems:
            raise ScenarioError(problems)
        modules = _modules(checked, workspace)
        with assembled(checked) as master:
            plan = plan_of(checked, master)
    distinct = list(dict.fromkeys(modules.values()))
    for instance in plan["instances"]:
        name = instance["name"]
        instance |= {"module": distinct.index(modules[name]), "guid": checked.models[name].interface.guid}
    parameters = {name: value for name, value in record["parameters"].items() if isinstance(value, int | float)}
    data = {"plan": plan, "controls": controls_of(checked), "parameters": parameters}
    return Live(data, [_packed(content) for content in distinct])


def _unrepeatable(record: Mapping[str, Any]) -> list[Problem]:
    """Why a page cannot do again what was recorded."""
    problems = _unable({name: told["kind"] for name, told in record["instances"].items()})
    if record.get("status") != "completed":
        problems.append(Problem("", f"the run is {record.get('status')}", "a live page is made of one that completed"))
    return problems


def _unable(kinds: Mapping[str, str]) -> list[Problem]:
    """Instances of kinds that a browser cannot run."""
    return [
        Problem(name, f"it runs as a {kind} model, which a browser cannot", "make it a native FMU: --kind native")
        for name, kind in kinds.items()
        if kind not in ("native", "fmu")
    ]


def _untrusted_files(system: System) -> list[Problem]:
    """FMUs that are not made here."""
    return [
        Problem(name, f"{instance.model} would be loaded, which executes its code", "--trust loads it")
        for name, instance in system.instances.items()
        if is_fmu_name(instance.model)
    ]


def _changed(record: Mapping[str, Any], checked: Checked) -> list[Problem]:
    """Instances whose models are no longer those of the run."""
    return [
        Problem(name, "its model is no longer the one of the run", "run the scenario again")
        for name, model in checked.models.items()
        if model.interface.guid != record["instances"][name]["guid"]
    ]


def _system(record: Mapping[str, Any], directory: Path) -> System:
    """The system of a run; its start values and its order are those that were found then.

    One that a program made has no scenario, and nothing is beside it: what it names is as strange as the record.
    """
    same = ("start_time", "stop_time", "step", "record", "algorithm", "extrapolation", "algebraic_loops", "refresh")
    return System(
        instances={
            name: Instance(name, told["model"], told["build"], told["start"], step=record["steps"].get(name))
            for name, told in record["instances"].items()
        },
        connections=[Connection(**each) for each in record["connections"]],
        events=[Event(**each) for each in record["events"]],
        seed=record["seed"],
        stepping=Stepping(**{key: record[key] for key in same}, order=record["order"] or []),
        judged=Judged(),
        provenance=Provenance(
            name=record["scenario"], path=record["path"] or str(directory / "run.json"), text=record["scenario_text"]
        ),
    )


def _tell_truth_values(system: System, models: Mapping[str, Model]) -> None:
    """Start values that are true or false, which a record has as 1 and 0, as a system has them."""
    for name, instance in system.instances.items():
        variables = models[name].interface.variables
        for what, value in instance.start.items():
            if variables[what].type == "Boolean":
                instance.start[what] = bool(value)


def _modules(checked: Checked, workspace: Workspace) -> dict[str, bytes]:
    """The WebAssembly of every instance."""
    return {name: _module(checked.system.instances[name], model, workspace) for name, model in checked.models.items()}


def _module(instance: Instance, model: Model, workspace: Workspace) -> bytes:
    """The WebAssembly of a model.

    Raises:
        ScenarioError: an FMU that was given has none.
        ComponentError: a component cannot be compiled.
    """
    if not is_fmu_name(instance.model):
        model = load_fmu(build(instance.model, instance.build, kind="native", platforms=["wasm"]), workspace)
    path = model.folder / "binaries" / _WASM.folder / f"{model.interface.identifier}{_WASM.suffix}"
    if not Path(path).is_file():
        remedy = "of ours, 'orchestrate build --platforms linux64,wasm' makes one that runs here and in a page"
        raise ScenarioError(
            Problem(instance.name, f"{instance.model} has no {path.relative_to(model.folder).as_posix()}", remedy)
        )
    return world.read_bytes(path)


def _packed(content: bytes) -> str:
    squeeze = zlib.compressobj(9, wbits=-15)
    return base64.b64encode(squeeze.compress(content) + squeeze.flush()).decode()
