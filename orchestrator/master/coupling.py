"""Whether the master algorithm that a system asks for can be had with its FMUs; every refusal names them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from ..fmi import Interface
from ..names import SignalName
from ..problems import Problem, suggestion
from ..system import System
from ..wiring import Wiring
from .algebraic_loops import find_loops
from .algorithms.adaptive import is_watched
from .algorithms.iterative import find_blocks

_SHOWN = 6


def check_coupling(system: System, interfaces: Mapping[str, Interface], wiring: Wiring) -> list[Problem]:
    """What is wrong with algorithm, steps and tolerances."""
    problems = [
        *_check_rates(system),
        *_check_tolerances(system, interfaces),
    ]
    if system.algorithm == "iterative":
        blocks = find_blocks(interfaces, wiring.links)
        problems += _cannot(
            [name for name in interfaces if name in blocks.cyclic and not interfaces[name].can_save_state],
            "in a cycle, and the state that iterative comes back to cannot be saved (canGetAndSetFMUstate is false)",
            "choose gauss-seidel or jacobi, or break the cycle by a delay",
        )
    elif system.algorithm == "adaptive":
        problems += _check_adaptive(system, interfaces, wiring)
    return problems


def _check_adaptive(system: System, interfaces: Mapping[str, Interface], wiring: Wiring) -> Iterable[Problem]:
    sampled = [name for name, interface in interfaces.items() if interface.vendor.get("sampled")]
    yield from _cannot(
        sampled, "sampled at points of its own, which adaptive cannot step over", "choose gauss-seidel or iterative"
    )
    others = {name: interface for name, interface in interfaces.items() if name not in sampled}
    yield from _cannot(
        [name for name, interface in others.items() if not interface.can_save_state],
        "the state that adaptive comes back to cannot be saved (canGetAndSetFMUstate is false)",
        "choose gauss-seidel",
    )
    yield from _cannot(
        [name for name, interface in others.items() if not interface.variable_step],
        "the step cannot vary (canHandleVariableCommunicationStepSize is false)",
        "choose gauss-seidel or iterative",
    )
    late = sorted({link.connection.target for link in wiring.links if link.delay})
    yield from _cannot(
        late,
        "a delay counts communication points, which adaptive sets anew at every run",
        "leave the delay out, or choose gauss-seidel",
    )


def _check_rates(system: System) -> Iterable[Problem]:
    duration = system.stop_time - system.start_time
    for instance in system.instances.values():
        if instance.step is None or instance.step == system.step:
            continue
        name = SignalName(instance.name)
        limit = ""
        if system.algorithm not in ("gauss-seidel", "jacobi"):
            limit = "which goes with gauss-seidel and jacobi only"
        elif system.algebraic_loops == "solve":
            limit = "with which algebraic_loops = 'solve' does not go"
        if limit:
            yield Problem(instance.origin, f"{name} has a step of its own, {limit}", names=(name,))
        own = f"its step = {instance.step:g} s"
        if not _is_multiple(instance.step, system.step):
            own = f"{own} is not a whole multiple of the system's, {system.step:g} s"
        elif not _is_multiple(duration, instance.step):
            own = f"{own} does not divide the run of {duration:g} s into whole steps"
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
    for signal in system.tolerances:
        if signal not in known:
            wrong, near = f"{signal!r} is no Real output", suggestion(signal, known)
            problem = Problem("simulation.tolerances", wrong, near, (SignalName.parse(signal),))
            yield problem.at(system.origins.get(f"simulation.tolerances.{signal}", ""))
    if system.min_step is not None and system.algorithm != "adaptive":
        yield Problem("", "simulation.min_step is for adaptive", f"the algorithm is {system.algorithm}")


def _cannot(names: Sequence[str], what: str, remedy: str) -> Iterable[Problem]:
    if names:
        yield Problem(_listed(names), what, remedy)


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names[:_SHOWN]) + (f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else "")


def describe_coupling(system: System, interfaces: Mapping[str, Interface], wiring: Wiring) -> list[str]:
    """What a user should know of the coupling though it is no error: loops, and inputs that are held all the same."""
    notes = []
    for loop in find_loops(interfaces, wiring.links):
        if system.algebraic_loops == "solve":
            how = "it is solved at each communication point"
        elif system.algorithm == "iterative":
            how = "it is solved by the iterations"
        else:
            how = (
                "it is solved at initialization and acts one step late from then on; algebraic_loops = 'solve' solves "
                "it at each communication point"
            )
        notes.append(f"algebraic loop through {_listed(loop)}: {how}")
    if system.algorithm == "adaptive":
        notes += _unwatched(system, interfaces)
    if system.extrapolation:
        held = [n for n, x in interfaces.items() if any(link.target[0] == n for link in wiring.links)]
        held = [n for n in held if not interfaces[n].interpolates_inputs]
        if held:
            notes.append(f"inputs of {_listed(held)} are held over a step: canInterpolateInputs is false")
    elif system.algorithm == "iterative":
        able = [n for n in find_blocks(interfaces, wiring.links).cyclic if interfaces[n].interpolates_inputs]
        if able:
            notes.append(
                f"{_listed(sorted(able))} can interpolate inputs: extrapolation = 1 makes iterative second order there"
            )
    return notes


def _unwatched(system: System, interfaces: Mapping[str, Interface]) -> Iterable[str]:
    """Tolerances that `adaptive` has no use for."""
    for signal in system.tolerances:
        instance, name = SignalName.parse(signal)
        interface = interfaces[instance]
        if not any(is_watched(interface, interface.variables[scalar]) for scalar in interface.scalars(name) or ()):
            yield f"the tolerance of {signal} has no effect: adaptive watches continuous outputs without feed-through"
