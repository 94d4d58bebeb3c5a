"""Which instances of a system run in processes of their own, and what is wrong with saying so."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace

from ..errors import ScenarioError
from ..fmi import Interface, Model, Slave
from ..names import SignalName
from ..problems import Problem, suggestion
from ..system import Instance, System
from .proxy import IsolatedSlave
from .strangers import strangers

ALL, AUTO = "all", "auto"


def is_isolated(model: Model, instance: Instance) -> bool:
    """Whether it runs in a process of its own; a component as Python objects is in this process by its nature."""
    return instance.isolate and model.plain is None


def instantiate(model: Model, instance: Instance, stopped: Callable[[], bool] | None = None) -> Slave:
    """One instance, in a process of its own if it asks for that.

    Args:
        model: its model.
        instance: how it is used.
        stopped: whether the run is to stop: an isolated instance is not waited for long then.

    Raises:
        FmuError: it cannot be loaded or instantiated; of an isolated one, its first call says so.
    """
    if not is_isolated(model, instance):
        return model.instantiate(instance.name)
    return IsolatedSlave(
        instance.name,
        model.interface,
        model.folder,
        step_timeout=instance.step_timeout,
        memory_limit=instance.memory_limit,
        stopped=stopped,
    )


def isolate(system: System, names: Iterable[str]) -> System:
    """The system with some instances isolated.

    Args:
        system: it is not changed.
        names: of instances, or of groups of them (``"train"`` for all of ``"train[1]"`` and so on); ``"all"`` for all;
            ``"auto"`` for those whose FMUs this machine does not know.

    Raises:
        ScenarioError: there is no such instance.
    """
    wanted = list(names)
    strange = strangers(system) if AUTO in wanted else []
    groups: dict[str, list[str]] = {ALL: list(system.instances), AUTO: strange}
    for name in system.instances:
        groups.setdefault(SignalName(name).group, []).append(name)
    groups |= {name: [name] for name in system.instances}
    unknown = [name for name in wanted if name not in groups]
    if unknown:
        none = "the system has no such instance"
        raise ScenarioError([Problem(f"isolate {name!r}", none, suggestion(name, groups)) for name in unknown])
    chosen = {member for name in wanted for member in groups[name]}
    instances = {name: replace(x, isolate=x.isolate or name in chosen) for name, x in system.instances.items()}
    words = tuple(word for name in wanted for word in ("--isolate", name))
    command = system.provenance.command
    changed = system.changed(instances=instances, command=command and (*command, *words))
    if strange:
        told = f"in processes of their own, because this machine does not know their FMUs: {', '.join(strange)}"
        changed.provenance = replace(changed.provenance, notes=(*changed.provenance.notes, told))
    return changed


def check_isolation(system: System) -> list[Problem]:
    """What is wrong with how instances are to be isolated."""
    useless: dict[tuple[str, str], list[str]] = {}
    problems = []
    for instance in system.instances.values():
        for key in ("step_timeout", "memory_limit"):
            value = getattr(instance, key)
            origin = system.provenance.origins.get(f"instances.{instance.name}.{key}", instance.origin)
            if value is not None and not instance.isolate:
                useless.setdefault((origin, key), []).append(instance.name)
            elif value is not None and not 0.0 < value < math.inf:
                wrong = f"{key} takes a number greater than 0, not {value!r}"
                problems.append(Problem(instance.name, wrong, names=(SignalName(instance.name),)))
    for (origin, key), names in useless.items():
        remedy = f"set isolate = true, or run with --isolate {SignalName(names[0]).group}"
        problem = Problem(", ".join(names), f"{key} is for an instance in a process of its own", remedy)
        problems.append(problem.at(origin))
    return problems


def check_once_per_process(system: System, interfaces: Mapping[str, Interface]) -> list[Problem]:
    """FMUs of which several instances share this process though they say that they cannot."""
    users: dict[str, list[str]] = {}
    for name, interface in interfaces.items():
        if interface.single_instance and not system.instances[name].isolate:
            users.setdefault(interface.guid, []).append(name)
    what = "this FMU can be instantiated only once per process"
    remedy = "give all but one of them a process of its own by isolate = true"
    return [Problem(", ".join(names), what, remedy) for names in users.values() if len(names) > 1]


def isolation_notes(system: System, models: Mapping[str, Model]) -> list[str]:
    """What a user should know of it."""
    plain = [name for name, x in system.instances.items() if x.isolate and not is_isolated(models[name], x)]
    return [f"not isolated, because plain components run in this process: {', '.join(plain)}"] if plain else []
