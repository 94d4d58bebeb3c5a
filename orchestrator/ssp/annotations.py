"""What stands beside the standard: how a system is stepped, by OMSimulator and OSP; names and the rest, by us."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Mapping
from typing import Any

from ..errors import ScenarioError
from ..fmi import Interface
from ..names import SignalName
from ..problems import Problem
from ..system import TOGETHER, Instance, Stepping
from ..times import digits
from .documents import OWN, Document, annotated, first, local
from .network import Path
from .structure import Element

_OMS, _OSP = "org.openmodelica", "com.opensimulationplatform"


def read_stepping(document: Document, root: Element, interfaces: Mapping[Path, Interface]) -> Stepping:
    """Times, step and algorithm; a note says where each comes from that the archive does not give.

    Args:
        document: the system structure.
        root: the system in it.
        interfaces: of the components, for what they recommend.

    Raises:
        ScenarioError: a time is no number.
    """
    stepping = Stepping()
    experiment = first(document.root, "DefaultExperiment")
    stops = [one.default_stop for one in interfaces.values() if one.default_stop is not None]
    given = None if experiment is None else experiment.get("stopTime")
    if experiment is not None:
        stepping.start_time = document.number(experiment, "startTime", 0.0)
    if given is not None:
        stepping.stop_time = document.number(experiment, "stopTime")
    else:
        stepping.stop_time = max(stops, default=stepping.start_time + 1.0)
        why = "the longest that its FMUs recommend" if stops else "nothing recommends another"
        document.note(document.root, f"it gives no stop time; {digits(stepping.stop_time)} s is taken, {why}")
    step = _annotated(document, root, experiment, interfaces, stepping)
    if step is None:
        steps = [one.default_step for one in interfaces.values() if one.default_step]
        step = min(steps, default=stepping.step)
        why = "the shortest that its FMUs recommend" if steps else "nothing recommends another"
        document.note(document.root, f"it gives no step; {digits(step)} s is taken, {why}")
    stepping.step = step
    return stepping


def _annotated(
    document: Document, root: Element, experiment: Any, interfaces: Mapping[Path, Interface], stepping: Stepping
) -> float | None:
    """The step that annotations give, and the algorithm they ask for."""
    for master in annotated(root.node, _OMS, "SimulationInformation"):
        if (found := _oms(document, master, interfaces, stepping)) is not None:
            return found
    nodes = [] if experiment is None else [experiment]
    for algorithm in (one for node in nodes for one in annotated(node, _OSP, "Algorithm")):
        fixed = first(algorithm, "FixedStepAlgorithm")
        if fixed is not None:
            stepping.algorithm = "jacobi"  # all instances step at once, libcosim has no other
            return _positive(document, fixed, "baseStepSize")
        document.note(algorithm, "the algorithm of its annotation is not known here")
    return None


def _oms(
    document: Document, information: Any, interfaces: Mapping[Path, Interface], stepping: Stepping
) -> float | None:
    """What OMSimulator says: of a fixed step, or of one that follows an estimated error."""
    for one in filter(local, information):
        if local(one) == "FixedStepMaster":
            stepping.algorithm = "jacobi"
            return _positive(document, one, "stepSize")
        if local(one) == "VariableStepMaster":
            if all(face.can_save_state for face in interfaces.values()):
                stepping.algorithm = "adaptive"
                stepping.min_step = _positive(document, one, "minimumStepSize")
                stepping.tolerance = document.number(one, "relativeTolerance", 1e-4)
            else:
                stepping.algorithm = "jacobi"
                document.note(one, "steps that vary need FMUs that save their state; the longest of them is kept")
            return _positive(document, one, "maximumStepSize")
        document.note(one, f"{local(one)} of OMSimulator is for models without a solver of their own, and is left out")
    return None


def _positive(document: Document, element: Any, attribute: str) -> float:
    value = document.number(element, attribute)
    if not value > 0.0:
        raise ScenarioError(Problem(document.place(element), f"{attribute} is {value!r}, not a positive number"))
    return value


def step_of(element: Element) -> float | None:
    """The step that OSP's annotation hints at for a component.

    Raises:
        ScenarioError: it is no number.
    """
    for hint in annotated(element.node, _OSP, "StepSizeHint"):
        return _positive(element.document, hint, "value")
    return None


def scenario_of(document: Document) -> tuple[str, str]:
    """What we have written of a system that the standard has no words for, as a scenario has it, and where it stands.

    Empty where there is no such annotation.
    """
    for found in annotated(document.root, OWN, "Scenario"):
        return found.text or "", document.place(found)
    return "", ""


def own_names(elements: Mapping[Path, Element]) -> dict[Path, str]:
    """The names of instances as we have written them; of a family of which some are missing, none."""
    found: dict[Path, SignalName] = {}
    families: dict[str, list[int | None]] = defaultdict(list)
    for path, element in elements.items():
        for own in annotated(element.node, OWN, "Instance"):
            name = SignalName(own.get("name", ""))
            if re.fullmatch(r"[A-Za-z_]\w*(\[[1-9]\d{0,8}\])?", name.instance, re.ASCII):
                found[path] = name
                families[name.group].append(name.number)
    whole = {
        group
        for group, numbers in families.items()
        if numbers == [None] or (None not in numbers and set(numbers) == set(range(1, len(numbers) + 1)))
    }
    return {path: name.instance for path, name in found.items() if name.group in whole}


def set_options(instance: Instance, element: Element) -> None:
    """Give an instance what we have written of how it runs.

    Raises:
        ScenarioError: a number is none.
    """
    for own in annotated(element.node, OWN, "Instance"):
        isolate = own.get("isolate")
        instance.isolate = TOGETHER if isolate == TOGETHER else isolate == "true"
        instance.swapped = own.get("swapped") == "true"
        for key in ("step_timeout", "memory_limit"):
            if own.get(key) is not None:
                setattr(instance, key, element.document.number(own, key))
        for left in own.iterfind("{*}Left"):
            text = left.get("value")
            number = text == "true" if text in ("true", "false") else element.document.number(left, "value")
            instance.start[left.get("name", "")] = number
