"""Which instances of a system run in processes of their own, and what is wrong with saying so."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path

from ..errors import FmuError, ScenarioError
from ..fmi import Interface, Model, Slave
from ..names import SignalName
from ..problems import Problem, suggestion
from ..system import TOGETHER, Instance, System
from .process import HostProcess
from .proxy import IsolatedSlave
from .seats import Guest
from .strangers import strangers

ALL, AUTO = "all", "auto"
_SPARE_CELLS = 4096
_CELLS_PER_VARIABLE = 4
"""Room in the shared memory; channels that find none send their values in messages."""


def is_isolated(model: Model, instance: Instance) -> bool:
    """Whether it runs in a process of its own; a component as Python objects is in this process by its nature."""
    return bool(instance.isolate) and model.plain is None


def instantiate(
    models: Mapping[str, Model], instances: Mapping[str, Instance], stopped: Callable[[], bool] | None = None
) -> Iterator[tuple[str, Slave]]:
    """Instances by name, in processes of their own or that they share if they ask for that.

    All that share a process are given one after the other, and are the caller's to free once the first is given.

    Args:
        models: what they are made of, by name.
        instances: how these, and perhaps others, are used.
        stopped: whether the run is to stop: isolated instances are not waited for long then.

    Raises:
        FmuError: one cannot be loaded or instantiated; of an isolated one, its first call says so.
    """
    for names in _households(models, instances):
        model, instance = models[names[0]], instances[names[0]]
        if not is_isolated(model, instance):
            yield names[0], model.instantiate(names[0])
            continue
        slaves = house(
            [(name, models[name].interface, models[name].folder) for name in names],
            step_timeout=instance.step_timeout,
            memory_limit=instance.memory_limit,
            stopped=stopped,
        )
        yield from zip(names, slaves, strict=True)


def _households(models: Mapping[str, Model], instances: Mapping[str, Instance]) -> list[list[str]]:
    """Who lives together: instances of one FMU that are to, unless that can be instantiated only once per process."""
    found: dict[object, list[str]] = {}
    for name, model in models.items():
        one = instances[name]
        shares = one.isolate == TOGETHER and is_isolated(model, one) and not model.interface.single_instance
        key = (model.folder, one.step_timeout, one.memory_limit) if shares else name
        found.setdefault(key, []).append(name)
    return list(found.values())


def house(
    instances: Iterable[tuple[str, Interface, Path]],
    *,
    step_timeout: float | None = None,
    memory_limit: float | None = None,
    stopped: Callable[[], bool] | None = None,
) -> list[IsolatedSlave]:
    """Instances in a process that they share, or in one of its own.

    Args:
        instances: their names in the system, their interfaces, where their FMUs were unpacked.
        step_timeout: wall time in s after which a call counts as hanging; None for a minute.
        memory_limit: what may be allocated there, in MiB; None for half of the machine's memory.
        stopped: whether the run is to stop: calls do not take long any more then.

    Raises:
        FmuError: no process can be started.
    """
    guests = [
        Guest(name, interface, folder, _SPARE_CELLS + _CELLS_PER_VARIABLE * len(interface.variables))
        for name, interface, folder in instances
    ]
    try:
        process = HostProcess(guests, patience=step_timeout, memory_limit=memory_limit, stopped=stopped)
    except OSError as error:
        raise FmuError(f"its process cannot be started: {error}", instance=guests[0].name) from error
    return [IsolatedSlave(guest, process) for guest in guests]


def isolate(system: System, names: Iterable[str]) -> System:
    """The system with some instances isolated.

    Args:
        system: it is not changed.
        names: of instances, or of groups of them (``"train"`` for all of ``"train[1]"`` and so on); ``"all"`` for all.
            These get a process each; ``"together"`` isolates all as well, those of one FMU in a process that they
            share, and ``"auto"`` so those whose FMUs this machine does not know.

    Raises:
        ScenarioError: there is no such instance.
    """
    wanted = list(names)
    strange = strangers(system) if AUTO in wanted else []
    groups: dict[str, list[str]] = {ALL: list(system.instances), TOGETHER: list(system.instances), AUTO: strange}
    for name in system.instances:
        groups.setdefault(SignalName(name).group, []).append(name)
    groups |= {name: [name] for name in system.instances}
    unknown = [name for name in wanted if name not in groups]
    if unknown:
        none = "the system has no such instance"
        raise ScenarioError([Problem(f"isolate {name!r}", none, suggestion(name, groups)) for name in unknown])
    alone = {member for name in wanted if name not in (TOGETHER, AUTO) for member in groups[name]}
    shared = {member for name in wanted for member in groups[name]} - alone
    instances = {
        name: replace(x, isolate=name in alone or x.isolate or (TOGETHER if name in shared else False))
        for name, x in system.instances.items()
    }
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
