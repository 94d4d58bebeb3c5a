"""Start values as single scalars of the variables' types, or what is wrong with them."""

from __future__ import annotations

import hashlib
import itertools
import math
from collections.abc import Mapping
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from ..errors import ScenarioError
from ..evaluation import evaluate_constant
from ..fmi import Interface, Variable
from ..names import SignalName
from ..problems import Problem
from ..system import Instance, System
from .links import Wiring


class Known(NamedTuple):
    """Start values of an instance as they were given once, without fault, and what they are by scalar variable."""

    given: Mapping[str, Any]
    values: Mapping[str, Any]

    def holds(self, name: str, given: Any) -> bool:
        """Whether a variable is given the same again."""
        before = self.given.get(name)
        return before is given or (
            type(before) is type(given) and isinstance(given, float | int | str) and before == given
        )


def find_starts(
    system: System, instance: Instance, interface: Interface, wiring: Wiring, known: Known | None = None
) -> dict[str, Any]:
    """The start values of one instance by scalar variable; what is wrong with them is noted in the wiring.

    Args:
        system: the instance's.
        instance: whose they are.
        interface: its model's.
        wiring: where problems, notes and what is left out go.
        known: those of the same instance of a system that has the same names of start values, if there is one.
    """
    values: dict[str, Any] = {}
    dropped = []
    hidden = _overridden(system, instance, interface)
    for name, given in instance.start.items():
        if name in hidden:
            continue
        held = interface.start_name(name)
        scalars = interface.scalars(held)
        if known is not None and scalars is not None and known.holds(name, given):
            values.update((scalar, known.values[scalar]) for scalar in scalars)
            continue
        signal = SignalName(instance.name, name)
        origin = system.provenance.origins.get(str(signal), instance.origin)
        if scalars is None and instance.swapped:
            dropped.append(name)
            wiring.left.update(_numbers(signal, given))
        elif scalars is None:
            why = interface.why_left_out(name)
            valid = (
                v.name for v in interface.variables.values() if v.settable or interface.start_name(v.name) != v.name
            )
            near = (
                ""
                if why
                else interface.elements_beside(name) or wiring.near(name, itertools.chain(valid, interface.arrays))
            )
            problem = Problem(str(signal), f"{interface.model} has no such variable{why}", near, (signal,))
            wiring.problems.append(problem.at(origin))
        else:
            try:
                if held != name and held in instance.start and held not in hidden:
                    raise ScenarioError(f"it is given twice, as {name} and as {held}")
                values.update(_elements(instance, interface, held, scalars, given))
            except ScenarioError as error:
                wiring.problems += [problem.at(origin) for problem in error.at(str(signal), signal)]
    if dropped:
        wiring.notes.append(f"{instance.name}: {interface.model} has no {', '.join(dropped)}; dropped with the swap")
    _set_runtime(system, instance, interface, values)
    _check_rising(system, instance, interface, wiring, values)
    return values


def _overridden(system: System, instance: Instance, interface: Interface) -> set[str]:
    """Start values that the scenario gives by one of a state's two names, and a user by the other."""
    found = set()
    for name in instance.start:
        held = interface.start_name(name)
        if held == name or held not in instance.start:
            continue
        origins = ((one, system.provenance.origins.get(f"{instance.name}.{one}", "")) for one in (name, held))
        written = {one for one, origin in origins if not origin.startswith("--set ")}
        found |= written if len(written) == 1 else set()
    return found


def _check_rising(
    system: System, instance: Instance, interface: Interface, wiring: Wiring, values: Mapping[str, Any]
) -> None:
    """Note arrays whose elements must rise and do not: with given values, or because none are given."""
    for name in interface.rising:
        scalars = interface.scalars(name) or ()
        if name in instance.start and not any(scalar in values for scalar in scalars):
            continue  # something else is wrong with it, and told
        row = [(scalar, values.get(scalar, interface.variables[scalar].start)) for scalar in scalars]
        wrong = next((pair for pair in itertools.pairwise(row) if pair[0][1] >= pair[1][1]), None)
        if wrong is None:
            continue
        signal = SignalName(instance.name, name)
        (_, before), (scalar, value) = wrong
        message = f"its values must rise, and {scalar} = {value:g} follows {before:g}"
        problem = Problem(str(signal), message, "" if name in instance.start else f"give {signal} values", (signal,))
        wiring.problems.append(problem.at(system.provenance.origins.get(str(signal), instance.origin)))


def _elements(
    instance: Instance, interface: Interface, name: str, scalars: tuple[str, ...], given: Any
) -> dict[str, Any]:
    """Start values by scalar; a single value is given to every element of an array.

    Raises:
        ScenarioError: what is wrong with it.
    """
    fixed = next((interface.variables[s] for s in scalars if not interface.variables[s].settable), None)
    if fixed is not None and fixed.causality == "structuralParameter":
        raise ScenarioError(f"it is a structural parameter: give it in build = {{ {name} = ... }}")
    if fixed is not None and fixed.variability == "constant":
        raise ScenarioError("it is a constant of the model and cannot be set")
    if fixed is not None:
        raise ScenarioError(f"it is computed (causality {fixed.causality}) and cannot be set")
    elements = _flatten(given)
    if isinstance(given, list | tuple | np.ndarray):
        if name in interface.variables:
            raise ScenarioError(f"takes a single value, not the list {given!r}")
        if len(elements) != len(scalars):
            raise ScenarioError(f"takes {len(scalars)} value{'s' * (len(scalars) > 1)}, {len(elements)} given")
    return {
        scalar: _typed(elements[k % len(elements)], interface.variables[scalar], instance)
        for k, scalar in enumerate(scalars)
    }


def _numbers(signal: SignalName, given: Any) -> dict[str, float | bool]:
    """The numbers of a start value that no variable takes, by full name."""
    if isinstance(given, list | tuple | np.ndarray):
        elements = {f"{signal}[{k}]": element for k, element in enumerate(_flatten(given), 1)}
    else:
        elements = {str(signal): given}
    return {name: x for name, x in elements.items() if isinstance(x, bool | int | float)}


def _flatten(given: Any) -> list[Any]:
    if not isinstance(given, list | tuple | np.ndarray):
        return [given]
    return [element for part in given for element in _flatten(part)]


def _typed(given: Any, variable: Variable, instance: Instance) -> Any:
    """A start value as the variable's type; text is an expression of ``i`` and ``count``, but for a text variable."""
    if variable.type == "String":
        return as_text(given, variable)
    choices = dict(variable.choices)
    if isinstance(given, str) and given in choices:
        return choices[given]
    if isinstance(given, str):
        given = _constant(given, instance.index, instance.count)
    is_truth = isinstance(given, bool | np.bool_)
    if variable.type == "Boolean":
        if not is_truth:
            raise ScenarioError(f"takes true or false, not {given!r}")
        return int(given)
    if is_truth or not isinstance(given, float | int | np.floating | np.integer):
        raise ScenarioError(f"takes a number, not {given!r}")
    return bounded(given, variable)


def as_text(given: Any, variable: Variable) -> str:
    """A text that a variable can take; of a Binary one its bytes, two hexadecimal digits each.

    Raises:
        ScenarioError: what is wrong with it.
    """
    if not isinstance(given, str):
        raise ScenarioError(f"takes text, not {given!r}")
    if not variable.is_binary:
        return given
    try:
        content = bytes.fromhex(given)
    except ValueError:
        raise ScenarioError(f'takes bytes as hexadecimal digits, as in "00ff7a", not {given!r}') from None
    if variable.longest is not None and len(content) > variable.longest:
        raise ScenarioError(f"takes up to {variable.longest} bytes, not {len(content)}")
    return content.hex()


@lru_cache(maxsize=4096)
def _constant(text: str, index: int | None, count: int) -> Any:
    """The value of an expression of ``i`` and ``count``: the same text stands in many instances, and in many runs."""
    return evaluate_constant(text, count=count) if index is None else evaluate_constant(text, i=index, count=count)


def bounded(given: Any, variable: Variable) -> float | int:
    """A number that a variable can take, as its type.

    Raises:
        ScenarioError: what is wrong with it.
    """
    try:
        finite = math.isfinite(given)
    except OverflowError:  # a whole number beyond all others
        finite = False
    if not finite:
        raise ScenarioError(f"takes a finite number, not {given!r}")
    if variable.type != "Real" and given != int(given):
        raise ScenarioError(f"takes a whole number, not {given!r}")
    if variable.choices and given not in dict(variable.choices).values():
        valid = ", ".join(f"{name} ({value})" for name, value in variable.choices)
        raise ScenarioError(f"takes one of {valid}, not {given!r}")
    whole = variable.whole_range
    if whole is not None and not whole[0] <= given <= whole[1]:
        raise ScenarioError(f"takes a whole number from {whole[0]} to {whole[1]}, not {given!r}")
    low, high = variable.minimum, variable.maximum
    if low is not None and given < low:
        raise ScenarioError(f"{given} is below the limit {low:g} {variable.unit or ''}".rstrip())
    if high is not None and given > high:
        raise ScenarioError(f"{given} is above the limit {high:g} {variable.unit or ''}".rstrip())
    return float(given) if variable.type == "Real" else int(given)


def _set_runtime(system: System, instance: Instance, interface: Interface, values: dict[str, Any]) -> None:
    """What the orchestrator sets by itself in our FMUs: the seed, and sample times that follow a changed step."""
    if not interface.annotation:
        return
    if "seed" in interface.variables and "seed" not in values:
        values["seed"] = instance_seed(system.seed, instance.name)
    # A sample time that was given has been rescaled where the step was changed; this is about the FMU's own.
    own = interface.variables.get("sample_time")
    if own is not None and "sample_time" not in values and own.start == system.provenance.rescaled_from:
        values["sample_time"] = system.stepping.step


def instance_seed(seed: int, name: str) -> int:
    """The seed of one instance: 31 bits of a hash of the scenario's seed and the instance's name."""
    return int.from_bytes(hashlib.sha256(f"{seed}:{name}".encode()).digest()[:4], "big") >> 1
