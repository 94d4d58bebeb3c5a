"""CasADi functions as C.

CasADi's own generator wraps each function into an interface for CasADi (sparsity, reference counts, work memory) that
nobody calls here. This one writes the operations alone, in CasADi's order, with constants of the same bits.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import casadi as ca

_OPERATIONS = {
    ca.OP_ASSIGN: "{0}",
    ca.OP_ADD: "{0} + {1}",
    ca.OP_SUB: "{0} - {1}",
    ca.OP_MUL: "{0} * {1}",
    ca.OP_DIV: "{0} / {1}",
    ca.OP_NEG: "-{0}",
    ca.OP_SQ: "{0} * {0}",
    ca.OP_TWICE: "2.0 * {0}",
    ca.OP_INV: "1.0 / {0}",
    ca.OP_POW: "pow({0}, {1})",
    ca.OP_CONSTPOW: "pow({0}, {1})",
    ca.OP_SQRT: "sqrt({0})",
    ca.OP_EXP: "exp({0})",
    ca.OP_LOG: "log({0})",
    ca.OP_SIN: "sin({0})",
    ca.OP_COS: "cos({0})",
    ca.OP_TAN: "tan({0})",
    ca.OP_TANH: "tanh({0})",
    ca.OP_FLOOR: "floor({0})",
    ca.OP_FABS: "fabs({0})",
    ca.OP_SIGN: "({0} > 0.0) - ({0} < 0.0)",
}
_TRUTHS = {
    ca.OP_LT: "{0} < {1}",
    ca.OP_LE: "{0} <= {1}",
    ca.OP_EQ: "{0} == {1}",
    ca.OP_NE: "{0} != {1}",
}
_OF_TRUTHS = {ca.OP_NOT: "!{0}", ca.OP_AND: "{0} && {1}", ca.OP_OR: "{0} || {1}"}
"""Operations with the result 0 or 1, of numbers and of truths: as C's own truth values compilers branch on them."""
_DEEPEST = 60
"""How many choices may stand inside one another: compilers need not take more than 127 nested blocks."""
_SHORT = 200
"""Up to how many operations a function is copied to where it is called: integration then shares work between stages."""
_NAMES = {value: name for name, value in vars(ca).items() if name.startswith("OP_")}

Path = tuple[int, ...]
"""Where an operation stands: the choices around it by number, from the outermost."""


def number(value: Any) -> str:
    """A real number as a C constant of the same bits."""
    value = float(value)
    if math.isnan(value):
        return "NAN"
    if math.isinf(value):
        return "INFINITY" if value > 0 else "-INFINITY"
    return repr(value)


def function(name: str, arguments: Sequence[tuple[str, Any]], results: Sequence[Any]) -> str:
    """A C function of arrays.

    Args:
        name: of the function.
        arguments: name and CasADi vector of each.
        results: scalar expressions, written to the array ``result`` in this order.
    """
    symbols = [symbol for _, symbol in arguments]
    compiled = ca.Function("f", symbols, [ca.densify(ca.vertcat(*results))], {"cse": True})
    steps = _steps(compiled, [argument for argument, _ in arguments])
    inside: dict[Path, list[int]] = {}
    for k, place in enumerate(_places(steps)):
        inside.setdefault(place, []).append(k)
    lines = list(_lines((), inside, steps))
    used = "".join(lines)
    unused = [f"    (void){argument};" for argument, _ in arguments if f"{argument}[" not in used]
    signature = ", ".join(f"const double *{argument}" for argument, _ in arguments)
    body = "\n".join([*unused, *lines])
    kept_in_place = "ALWAYS_INLINE" if len(steps) <= _SHORT else "static inline"
    return f"{kept_in_place} void {name}({signature}, double *result)\n{{\n{body}\n}}\n"


class _Step(NamedTuple):
    """One operation: what it is, the numbers of the steps it takes its values from, and its C without a semicolon."""

    operation: int
    read: tuple[int, ...]
    code: str

    @property
    def is_truth(self) -> bool:
        """Whether its value is a truth in C."""
        return self.operation in _TRUTHS or self.operation in _OF_TRUTHS


def _steps(compiled: Any, arguments: Sequence[str]) -> list[_Step]:
    """The operations of a CasADi function in order; the value of step k is the variable ``a<k>``."""
    steps: list[_Step] = []
    holds: dict[int, int] = {}  # the step whose value a place of CasADi's work memory holds
    for k in range(compiled.n_instructions()):
        operation, places = compiled.instruction_id(k), compiled.instruction_input(k)
        written = compiled.instruction_output(k)
        if operation == ca.OP_INPUT:
            steps.append(_Step(operation, (), f"{arguments[places[0]]}[{places[1]}]"))
        elif operation == ca.OP_CONST:
            steps.append(_Step(operation, (), number(compiled.instruction_constant(k))))
        elif operation == ca.OP_OUTPUT:
            value = holds[places[0]]
            steps.append(_Step(operation, (value,), f"result[{written[1]}] = a{value}"))
        else:
            read = tuple(holds[place] for place in places)
            steps.append(_Step(operation, read, _code(operation, read, steps)))
        if operation != ca.OP_OUTPUT:
            holds[written[0]] = k
    return steps


def _code(operation: int, read: tuple[int, ...], steps: Sequence[_Step]) -> str:
    """The C of an operation on the values of earlier steps."""
    numbers = [f"(double)a{n}" if steps[n].is_truth else f"a{n}" for n in read]
    truths = [f"a{n}" if steps[n].is_truth else f"(a{n} != 0.0)" for n in read]
    if operation == ca.OP_IF_ELSE_ZERO:
        return f"{truths[0]} ? {numbers[1]} : 0.0"
    if operation in _OF_TRUTHS:
        return _OF_TRUTHS[operation].format(*truths)
    template = _OPERATIONS.get(operation) or _TRUTHS.get(operation)
    if template is None:
        raise NotImplementedError(f"CasADi's operation {_NAMES.get(operation, operation)} has no C here")
    return template.format(*numbers)


def _places(steps: Sequence[_Step]) -> list[Path]:
    """Where each step stands: inside all choices that alone ask for its value.

    What is not chosen is then not computed: a train that runs forwards does not pay for the equations of rolling back.
    """
    uses: list[list[Path]] = [[] for _ in steps]
    places: list[Path] = [()] * len(steps)
    for k in reversed(range(len(steps))):
        operation, read, _ = steps[k]
        places[k] = here = _common(uses[k])
        for n in read:
            uses[n].append(here)
        if operation == ca.OP_IF_ELSE_ZERO and len(here) < _DEEPEST:
            uses[read[1]][-1] = (*here, k)
    return places


def _common(paths: Sequence[Path]) -> Path:
    """The innermost place that all of these are inside of."""
    if not paths:
        return ()
    low, high = min(paths), max(paths)
    same = 0
    while same < len(low) and low[same] == high[same]:
        same += 1
    return low[:same]


def _lines(here: Path, inside: Mapping[Path, Sequence[int]], steps: Sequence[_Step]) -> Iterator[str]:
    """The C of the steps that stand in a place, choices with all that stands inside them."""
    indent = "    " * (len(here) + 1)
    for k in inside[here]:
        operation, read, code = steps[k]
        if operation == ca.OP_OUTPUT:
            yield f"{indent}{code};"
        elif (*here, k) in inside:
            yield f"{indent}double a{k} = 0.0;"
            yield f"{indent}if ({code.partition(' ? ')[0]}) {{"
            yield from _lines((*here, k), inside, steps)
            yield f"{indent}    a{k} = a{read[1]};"
            yield f"{indent}}}"
        else:
            yield f"{indent}const {'bool' if steps[k].is_truth else 'double'} a{k} = {code};"
