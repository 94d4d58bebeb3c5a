"""One instance as it is written for other tools."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from ..fmi import Interface, Variable
from ..system import Instance


@dataclass(frozen=True)
class Part:
    """One instance under a name that every tool takes.

    Attributes:
        name: such as ``"train_1"``. instance: as the system has it. interface: its FMU's.
        source: the file name of its FMU. starts: start values by scalar variable.
        left: numbers that a scenario gives to variables which the model that was swapped in does not have.
    """

    name: str
    instance: Instance
    interface: Interface
    source: str
    starts: Mapping[str, Any]
    left: Mapping[str, float | bool]

    def values(self) -> Iterator[tuple[Variable, str]]:
        """The start values as XML has them."""
        for name, value in self.starts.items():
            variable = self.interface.variables[name]
            yield variable, xml_value(variable, value)


def xml_value(variable: Variable, value: Any) -> str:
    """A start value as XML has it: of an enumeration the name of an item."""
    match variable.type:
        case "Boolean":
            return "true" if value else "false"
        case "Real":
            return repr(float(value))
        case "Enumeration":
            return next((name for name, number in variable.choices if number == value), str(value))
    return str(value)
