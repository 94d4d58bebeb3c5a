"""The scenario actions that Ecos keeps in an annotation, as events.

An action sets a variable of a component, ``"train::force"``, from a time on, once. As ours has it, it acts at the first
communication point at or after its time.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from typing import Any, final

from ..errors import ScenarioError
from ..fmi import Interface
from ..names import SignalName
from ..problems import Problem
from ..system import Event
from .documents import Document, annotated, children, first, local, only_child
from .network import Path
from .values import TRUTH

_ECOS = "com.github.ecos-platform.scenario"
_TYPES = {"real": ("Real",), "integer": ("Integer", "Enumeration"), "boolean": ("Boolean",), "string": ("String",)}
"""What an action calls a type, and the types that variables of it have."""


@final
class Actions:
    """The actions of a system structure.

    Args:
        document: the system structure.
        interfaces: of the components, by path; Ecos names those at the top alone.
        names: of the instances that they become.
        fed: the inputs that are connected.

    Attributes:
        events: what the actions become. problems: what is no action.
        notes: which have no counterpart, and what else a user should know.
    """

    def __init__(
        self,
        document: Document,
        interfaces: Mapping[Path, Interface],
        names: Mapping[Path, str],
        fed: Collection[str],
    ) -> None:
        self.events: list[Event] = []
        self.problems: list[Problem] = []
        self.notes: list[str] = []
        self._document, self._interfaces, self._names, self._fed = document, interfaces, names, fed
        experiment = first(document.root, "DefaultExperiment")
        scenarios = [] if experiment is None else list(annotated(experiment, _ECOS, "Scenario"))
        if len(scenarios) > 1:
            self._note(scenarios[-1], f"the actions of all {len(scenarios)} scenarios of Ecos are taken")
        for scenario in scenarios:
            self._read(scenario)

    def _note(self, element: Any, text: str) -> None:
        self.notes.append(f"{self._document.place(element)}: {text}")

    def _read(self, scenario: Any) -> None:
        if any(one.get("eps") is not None for one in scenario.iter() if local(one)):
            self._note(
                scenario, "eps is left out: an action acts at the first communication point at or after its time"
            )
        for action in children(scenario, "action"):
            try:
                at = self._document.number(action, "t")
                self.events += [event for one in children(action, "variable") for event in self._event(one, at)]
            except ScenarioError as error:
                self.problems += error.problems

    def _event(self, variable: Any, at: float) -> Iterator[Event]:
        """The event that sets a variable; a note where there is none."""
        component, _, name = variable.get("id", "").partition("::")
        typed = only_child(variable)
        kind = "" if typed is None else local(typed)
        why = self._why_not(component, name, kind)
        if why:
            self._note(variable, f"the action on {component}::{name} is left out: {why}")
            return
        signal = f"{self._names[component,]}.{name}"
        yield Event(signal, "set", at, self._value(typed, kind), origin=self._document.place(variable))

    def _why_not(self, component: str, name: str, kind: str) -> str:
        """Why an action has no counterpart; empty where it has one."""
        interface = self._interfaces.get((component,))
        if interface is None:
            return f"there is no FMU {component!r} at the top"
        found = interface.variables.get(name)
        if found is None:
            return f"{component} has no variable {name!r}"
        if found.type not in _TYPES.get(kind, ()):
            return f"it is of type {found.type}, not {kind or 'given'}"
        if f"{SignalName(self._names[component,], name)}" in self._fed:
            return "it is connected, and what it receives next takes the place of what is set"
        if found.causality != "input" and (found.causality, found.variability) != ("parameter", "tunable"):
            return (
                f"only inputs and tunable parameters can be set in a run; it is a {found.variability} {found.causality}"
            )
        return ""

    def _value(self, typed: Any, kind: str) -> float | int | bool | str:
        """The value that an action sets."""
        if kind == "real":
            return self._document.number(typed, "value")
        text = typed.get("value")
        try:
            return TRUTH[text.strip()] if kind == "boolean" else int(text) if kind == "integer" else str(text)
        except (AttributeError, LookupError, TypeError, ValueError):
            what = f"the value of an action is {text!r}, not of type {kind}"
            raise ScenarioError(Problem(self._document.place(typed), what)) from None
