"""The constants, operators and element-wise functions of expressions; reducers over time stand in `metrics`.

NaN survives comparisons and logic, so that it can never pass as "false".
"""

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..problems import Problem, suggestion
from .syntax import Call, Group, Node

WINDOWS = {"span": ("after", "until", "outside"), "phase": ("after", "until")}
"""The arguments by which a user bounds what is reduced; a phase does not contain the point at its end."""
CONSTANTS = {"pi": np.pi, "inf": np.inf, "nan": np.nan, "true": True, "false": False}
Value: TypeAlias = NDArray[Any]


@dataclass(frozen=True)
class Function:
    """A function expressions may call. With `takes_signals` its first argument is the run, which the user omits.

    With a `window` it reduces the run to one number. Its first argument, which the user omits too, is then the `Span`
    that counts. It returns the rows to be looked at, shape (T,) or (n, T), and the `Fold` that looks at them. Arguments
    annotated as `float` are one number for the whole run, the others vary over time. The fold may depend on the span,
    on these numbers and on how many rows the others have, but not on their values: calls that share all that look at
    the run together, with one fold. Unless it `compares` rows with one another, what it returns has a row for each that
    they have, so that rows may as well be looked at each alone.
    """

    call: Callable[..., Any]
    unit: str = ""  # of the result: a unit, "same" as the first argument, "per s" of it, or unknown
    takes_signals: bool = False
    window: Literal["", "all", "span", "phase"] = ""
    compares: bool = False

    @property
    def reduces(self) -> bool:
        """Whether it makes one number of all time."""
        return bool(self.window)

    @cached_property
    def arguments(self) -> inspect.Signature:
        """The arguments a user writes."""
        if isinstance(self.call, np.ufunc):  # these carry no signature of their own
            names = ("x",) if self.call.nin == 1 else ("a", "b")
            return inspect.Signature([inspect.Parameter(name, inspect.Parameter.POSITIONAL_ONLY) for name in names])
        signature = inspect.signature(self.call)
        own = list(signature.parameters.values())[int(self.takes_signals or self.reduces) :]
        window = [inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=None) for name in self.bounds]
        return signature.replace(parameters=[*own, *window])

    @cached_property
    def varying(self) -> frozenset[str]:
        """The arguments of a reducer that vary over time."""
        parameters = self.arguments.parameters.values()
        return frozenset(one.name for one in parameters if one.annotation is not float) - {*WINDOWS["span"]}

    def given(self, call: Call) -> dict[str, Node]:
        """The arguments in a call of it by their names."""
        plain = len(call.arguments) - len(call.keywords)
        named = dict(zip(call.keywords, call.arguments[plain:], strict=True))
        given: dict[str, Node] = self.arguments.bind(*call.arguments[:plain], **named).arguments
        return given

    @property
    def bounds(self) -> tuple[str, ...]:
        """The arguments that bound the window in time."""
        return WINDOWS.get(self.window, ())


def logical(operation: Callable[..., Value], *operands: Value) -> Value:
    """A comparison or logical operation whose result is NaN wherever an operand is."""
    numbers = [np.asarray(x, dtype=np.float64) for x in operands]
    result = operation(*numbers)
    for x in numbers:
        unknown = np.isnan(x)
        if np.count_nonzero(unknown):
            result = np.where(unknown, np.nan, result)
    return np.asarray(result)


def where(condition: Value, then: Value, otherwise: Value) -> Value:
    """`then` where the condition holds, `otherwise` elsewhere, NaN where the condition is NaN."""
    unknown = np.isnan(np.asarray(condition, dtype=np.float64))
    result = np.where(condition, then, otherwise)
    return np.where(unknown, np.nan, result) if unknown.any() else result


ARITHMETIC: dict[str, Callable[..., Value]] = {
    "+": np.add, "-": np.subtract, "*": np.multiply, "/": np.true_divide, "**": np.power,
    "negative": np.negative, "positive": np.positive,
}  # fmt: skip
LOGIC: dict[str, Callable[..., Value]] = {
    "<": np.less, "<=": np.less_equal, ">": np.greater, ">=": np.greater_equal, "==": np.equal, "!=": np.not_equal,
    "and": np.logical_and, "or": np.logical_or, "not": np.logical_not,
}  # fmt: skip
ELEMENTWISE: dict[str, Function] = {
    "abs": Function(np.abs, unit="same"),
    "sign": Function(np.sign),
    "floor": Function(np.floor),
    "sqrt": Function(np.sqrt),
    "exp": Function(np.exp),
    "log": Function(np.log),
    "sin": Function(np.sin),
    "cos": Function(np.cos),
    "tan": Function(np.tan),
    "tanh": Function(np.tanh),
    "minimum": Function(np.minimum, unit="same"),
    "maximum": Function(np.maximum, unit="same"),
    "clip": Function(lambda x, low, high: np.minimum(np.maximum(x, low), high), unit="same"),
    "where": Function(where),
}


def call_problem(call: Call, functions: Mapping[str, Function]) -> Problem | None:
    """What is wrong with a call: an unknown function or argument, too many or too few of them, or a list among them."""
    if call.name not in functions:
        nearest = suggestion(call.name, functions) or f"there are {', '.join(sorted(functions))}"
        return Problem("", f"unknown function '{call.name}'", nearest)
    signature = functions[call.name].arguments
    for word in call.keywords:
        if word not in signature.parameters:
            return Problem("", f"{call.name} has no argument '{word}'", suggestion(word, signature.parameters))
    try:
        given = functions[call.name].given(call)
    except TypeError as error:
        return Problem(f"{call.name}({', '.join(signature.parameters)})", str(error))
    lists = [word for word, argument in given.items() if isinstance(argument, Group) and word != "outside"]
    return Problem(call.name, f"{lists[0]} takes a signal or a number, not a list") if lists else None
