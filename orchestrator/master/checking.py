"""Whether the master algorithm that a system asks for can be had with its FMUs; every refusal names them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from ..fmi import Interface, Model
from ..names import SignalName
from ..problems import Problem, suggestion
from ..system import System
from ..times import count_steps, digits
from ..wiring import Wiring
from .algebraic import find_loops
from .algorithms import ALGORITHMS
from .algorithms.refusals import listed
from .compiled import HAS_KERNEL, HAS_THREADS


def check_coupling(system: System, interfaces: Mapping[str, Interface], wiring: Wiring) -> list[Problem]:
    """What is wrong with algorithm, steps and tolerances."""
    algorithm = ALGORITHMS[system.stepping.algorithm]
    unfit = [problem for _, now in wiring.routings for problem in algorithm.fit(system, interfaces, now).problems]
    return [
        *_check_rates(system),
        *_check_tolerances(system, interfaces),
        *_check_refresh(system),
        *dict.fromkeys(unfit),
    ]


def check_threads(system: System, models: Mapping[str, Model], wiring: Wiring, threads: int) -> list[Problem]:
    """Why several threads, where they are asked for, could not step anything in parallel."""
    if threads <= 1:
        return []
    remedy = "leave threads out, or run it as FMUs under an algorithm that takes them"
    why = dict.fromkeys(_against_threads(system, models, wiring))
    return [Problem(f"threads = {threads}", f"they cannot act: {'; '.join(why)}", remedy)] if why else []


def _against_threads(system: System, models: Mapping[str, Model], wiring: Wiring) -> Iterator[str]:
    able = [name for name, one in ALGORITHMS.items() if one.takes_threads]
    algorithm = system.stepping.algorithm
    if algorithm not in able:
        yield f"the algorithm is {algorithm}, and {listed(able)} takes them"
    if not HAS_KERNEL:
        yield "this installation has no compiled kernel"
    elif not HAS_THREADS:
        yield "the kernel has no threads on this platform"
    if len(models) == 1:
        yield "there is one instance"
    if system.stepping.refresh:
        yield "feed-through is refreshed in one thread"
    interfaces = {name: model.interface for name, model in models.items()}
    if system.stepping.algebraic_loops == "solve" and find_loops(interfaces, wiring.every_link, doubtful=True):
        yield "algebraic loops are solved in one thread"
    for what, names in _without_threads(system, models).items():
        if names:
            yield f"{what}: {listed(names)}"


def _without_threads(system: System, models: Mapping[str, Model]) -> dict[str, list[str]]:
    """The instances with which no thread of the kernel has something to do, by what is in the way."""
    files = {name: model.interface for name, model in models.items() if model.plain is None}
    python = [name for name, face in files.items() if face.own_kind == "python"]
    return {
        "these are Python objects": [name for name in models if name not in files],
        "these run Python, one thread at a time": python if len(files) - len(python) < 2 else [],
        "these run in processes of their own": [name for name in files if system.instances[name].isolate],
        "these give texts": [n for n, face in files.items() if any(v.type == "String" for v in face.of("output"))],
    }


def _check_rates(system: System) -> Iterable[Problem]:
    duration = system.stepping.stop_time - system.stepping.start_time
    for instance in system.instances.values():
        if instance.step is None or instance.step == system.stepping.step:
            continue
        name = SignalName(instance.name)
        limit = ""
        if not ALGORITHMS[system.stepping.algorithm].takes_own_steps:
            able = " and ".join(name for name, one in ALGORITHMS.items() if one.takes_own_steps)
            limit = f"which goes with {able} only"
        elif system.stepping.algebraic_loops == "solve":
            limit = "with which algebraic_loops = 'solve' does not go"
        elif system.stepping.refresh:
            limit = "with which refresh does not go"
        if limit:
            yield Problem(instance.origin, f"{name} has a step of its own, {limit}", names=(name,))
        own = f"its step = {digits(instance.step)} s"
        if not _is_multiple(instance.step, system.stepping.step):
            own = f"{own} is not a whole multiple of the system's, {digits(system.stepping.step)} s"
        elif count_steps(system.stepping.start_time, system.stepping.stop_time, instance.step) is None:
            own = f"{own} does not divide the run of {digits(duration, system.stepping.stop_time)} s into whole steps"
        else:
            continue
        yield Problem(str(name), own, names=(name,)).at(instance.origin)


def _is_multiple(length: float, step: float) -> bool:
    count = length / step
    return count > 0.5 and abs(count - round(count)) <= 1e-6


def _check_tolerances(system: System, interfaces: Mapping[str, Interface]) -> Iterable[Problem]:
    known = {
        f"{name}.{variable}": None
        for name, interface in interfaces.items()
        for variable in (*(v.name for v in interface.of("output") if v.type == "Real"), *interface.arrays)
    }
    for signal in system.stepping.tolerances:
        if signal not in known:
            wrong, near = f"{signal!r} is no Real output", suggestion(signal, known)
            problem = Problem("simulation.tolerances", wrong, near, (SignalName.parse(signal),))
            yield problem.at(system.provenance.origins.get(f"simulation.tolerances.{signal}", ""))
    if system.stepping.min_step is not None and not ALGORITHMS[system.stepping.algorithm].varies_step:
        able = " and ".join(name for name, one in ALGORITHMS.items() if one.varies_step)
        yield Problem("", f"simulation.min_step is for {able}", f"the algorithm is {system.stepping.algorithm}")


def _check_refresh(system: System) -> Iterable[Problem]:
    if system.stepping.refresh and ALGORITHMS[system.stepping.algorithm].solves_loops:
        able = " and ".join(name for name, one in ALGORITHMS.items() if not one.solves_loops)
        what = f"simulation.refresh is for {able}; with {system.stepping.algorithm} what is exchanged agrees anyway"
        yield Problem("", what, "leave it out").at(system.provenance.origins.get("simulation.refresh", ""))


def describe_coupling(system: System, interfaces: Mapping[str, Interface], wiring: Wiring) -> list[str]:
    """What a user should know of the coupling though it is no error: loops, and inputs that are held all the same."""
    notes, algorithm = [], ALGORITHMS[system.stepping.algorithm]
    loops: dict[tuple[str, ...], str] = {}
    for when, now in wiring.routings:
        for loop in find_loops(interfaces, now.links):
            loops.setdefault(loop, when)
    for loop, when in loops.items():
        if system.stepping.algebraic_loops == "solve":
            how = "it is solved at each communication point"
        elif algorithm.solves_loops:
            how = "it is solved by the iterations"
        else:
            how = (
                "it is solved at initialization and acts one step late from then on; algebraic_loops = 'solve' solves "
                "it at each communication point"
            )
        notes.append(f"{when}algebraic loop through {listed(loop)}: {how}")
    notes += algorithm.fit(system, interfaces, wiring).notes
    if system.stepping.extrapolation:
        held = [n for n, x in interfaces.items() if any(link.target[0] == n for link in wiring.links)]
        held = [n for n in held if not interfaces[n].interpolates_inputs]
        if held:
            notes.append(f"inputs of {listed(held)} are held over a step: canInterpolateInputs is false")
    return notes
