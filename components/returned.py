"""What a component's methods must return, out of its declarations; and where their author wrote what is wrong."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Mapping, Set
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .component import Component, Method, Slot
from .declarations import Memory, Output, State, Tape
from .errors import ComponentError

_OURS = Path(__file__).parent
_NUMPY = Path(np.__file__).parent


@dataclass(frozen=True)
class Due:
    """What a method may return, by name, and the names it must."""

    may: Mapping[str, Slot]
    must: Set[str]


def due(component: Component) -> dict[Method, Due]:
    """What is due of each method that returns values by name."""

    def slots(*kinds: type[Output | State | Memory | Tape]) -> dict[str, Slot]:
        return {slot.name: slot for slot in component.of(*kinds)}

    outputs, states = slots(Output), slots(State)
    return {
        "outputs": Due(outputs, outputs.keys()),
        "initial": Due(slots(Memory) | states, frozenset()),
        "update": Due(slots(Memory) | states | slots(Tape), slots(Memory, Tape).keys()),
        "derivatives": Due(states, states.keys()),
    }


def check_returned(component: Component, method: Method, returned: Any, owed: Due) -> None:
    """Refuse what a method returned if it is not what its component declares.

    Raises:
        ComponentError: no dict, a name too many or one too few; with the place of the method in its author's file.
    """
    function = getattr(type(component), method, None)
    name = type(component).__name__
    where = place_of(function)
    at = f" ({where})" if where else ""
    if not isinstance(returned, dict):
        raise ComponentError(f"{name}.{method} returns {returned!r}; it must return a dict{at}")
    if unknown := sorted(returned.keys() - owed.may.keys()):
        raise ComponentError(f"{name}.{method} returns {unknown}; it may return {sorted(owed.may)}{at}")
    for key, value in returned.items():
        if value is None or (isinstance(value, str) and owed.may[key].type is not str):
            kind = owed.may[key].type.__name__
            raise ComponentError(f"{name}.{method} returns {value!r} for {key!r}, which is declared {kind}{at}")
    if missing := sorted(owed.must - returned.keys()):
        if function is None:
            raise ComponentError(f"{name} has no method {method!r}, which must return {missing}")
        raise ComponentError(f"{name}.{method} returns no value of {missing}{at}")


def line_of(error: BaseException, *others: Path) -> str:
    """The innermost line of an author that an exception passed through, as ``file.py:12, 'text'``; or nothing.

    Args:
        error: as caught.
        others: further folders whose files are never to blame, beside this one and NumPy's.
    """
    for frame in reversed(traceback.extract_tb(error.__traceback__)):
        path = Path(frame.filename)
        if path.parent not in (_OURS, *others) and not path.is_relative_to(_NUMPY):
            return f"{path.name}:{frame.lineno}{f', {frame.line!r}' if frame.line else ''}"
    return ""


def place_of(function: Callable[..., Any] | None) -> str:
    """Where a method is written, as ``file.py:12``; nothing where it is not Python's."""
    code = getattr(function, "__code__", None)
    return f"{Path(code.co_filename).name}:{code.co_firstlineno}" if code else ""
