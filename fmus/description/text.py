"""Values as a model description has them."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from ...components.component import Component
from ...components.errors import ComponentError
from ..variables import ScalarVariable


def text(value: Any) -> str:
    """A value of any type."""
    if isinstance(value, bool | np.bool_):
        return "true" if value else "false"
    return value if isinstance(value, str) else number(value)


def number(value: Any) -> str:
    """A number that is read back as the same."""
    return str(int(value)) if isinstance(value, int | np.integer) else repr(float(value))


def start_of(variable: ScalarVariable, component: Component) -> str:
    """What a scalar, or an element of an array, starts with."""
    value = component.present_values[variable.slot.name]
    return text(value if variable.element is None else np.ravel(value)[variable.element])


def starts_of(variable: ScalarVariable, component: Component) -> list[str]:
    """What all elements of an array start with, or a scalar alone."""
    return [text(each) for each in np.ravel(component.present_values[variable.slot.name])]


def attributes(variable: ScalarVariable, initial: str | None) -> dict[str, str]:
    """What every version writes of a variable beside its name, and of an array once."""
    told = {
        "description": variable.description,
        "causality": variable.causality,
        "variability": variable.variability,
        "initial": initial or "",
    }
    return {key: value for key, value in told.items() if value}


def of_type(variable: ScalarVariable) -> dict[str, str]:
    """Unit and bounds."""
    slot, found = variable.slot, {}
    if slot.type is float and slot.unit != "1":
        found["unit"] = slot.unit
    if slot.type in (float, int):
        for bound, value in (("min", slot.declaration.minimum), ("max", slot.declaration.maximum)):
            if value is not None:
                found[bound] = number(value) if slot.type is float else str(int(value))
    return found


def arguments(component: Component) -> str:
    """The build arguments as JSON.

    Raises:
        ComponentError: one is not JSON data.
    """
    try:
        return json.dumps(component.build_arguments, sort_keys=True)
    except (TypeError, ValueError) as error:
        raise ComponentError(
            f"{type(component).__name__}: build arguments are JSON data (numbers, texts, lists, dicts): {error}"
        ) from error
