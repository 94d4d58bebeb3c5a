"""How a system is stepped: what the standard says of it, and what OMSimulator and OSP write beside it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from ..errors import ScenarioError
from ..fmi import Interface
from ..problems import Problem
from ..system import Stepping
from ..times import digits
from .documents import Document, children, first, local
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
    for master in _annotation(root.node, _OMS, "SimulationInformation"):
        if (found := _oms(document, master, interfaces, stepping)) is not None:
            return found
    nodes = [] if experiment is None else [experiment]
    for algorithm in (one for node in nodes for one in _annotation(node, _OSP, "Algorithm")):
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


def _annotation(node: Any, kind: str, name: str) -> Iterator[Any]:
    """The elements of a name in the annotations of a kind, however deep."""
    for annotation in children(node, "Annotations", "Annotation"):
        if annotation.get("type") == kind:
            yield from annotation.iter(f"{{*}}{name}")


def step_of(element: Element) -> float | None:
    """The step that OSP's annotation hints at for a component.

    Raises:
        ScenarioError: it is no number.
    """
    for hint in _annotation(element.node, _OSP, "StepSizeHint"):
        return _positive(element.document, hint, "value")
    return None
