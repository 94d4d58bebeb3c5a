"""CasADi functions as C.

CasADi's own generator wraps each function into an interface for CasADi (sparsity, reference counts, work memory) that
nobody calls here. This one writes the operations alone, in CasADi's order, with constants of the same bits.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

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
    ca.OP_LT: "{0} < {1}",
    ca.OP_LE: "{0} <= {1}",
    ca.OP_EQ: "{0} == {1}",
    ca.OP_NE: "{0} != {1}",
    ca.OP_NOT: "{0} == 0.0",
    ca.OP_AND: "{0} != 0.0 && {1} != 0.0",
    ca.OP_OR: "{0} != 0.0 || {1} != 0.0",
    ca.OP_IF_ELSE_ZERO: "{0} != 0.0 ? {1} : 0.0",
}
_NAMES = {value: name for name, value in vars(ca).items() if name.startswith("OP_")}


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
    lines = [_line(compiled, k, [argument for argument, _ in arguments]) for k in range(compiled.n_instructions())]
    used = "".join(lines)
    unused = [f"    (void){argument};" for argument, _ in arguments if f"{argument}[" not in used]
    work = sorted({compiled.instruction_output(k)[0] for k in range(len(lines)) if not _is_output(compiled, k)})
    signature = ", ".join(f"const double *{argument}" for argument, _ in arguments)
    declared = [f"    double {', '.join(f'a{slot}' for slot in work)};"] if work else []
    body = "\n".join([*declared, *unused, *lines])
    return f"static inline void {name}({signature}, double *result)\n{{\n{body}\n}}\n"


def _line(compiled: Any, k: int, arguments: Sequence[str]) -> str:
    operation, read, written = (
        compiled.instruction_id(k),
        compiled.instruction_input(k),
        compiled.instruction_output(k),
    )
    if operation == ca.OP_OUTPUT:
        return f"    result[{written[1]}] = a{read[0]};"
    if operation == ca.OP_INPUT:
        return f"    a{written[0]} = {arguments[read[0]]}[{read[1]}];"
    if operation == ca.OP_CONST:
        return f"    a{written[0]} = {number(compiled.instruction_constant(k))};"
    if operation not in _OPERATIONS:
        raise NotImplementedError(f"CasADi's operation {_NAMES.get(operation, operation)} has no C here")
    return f"    a{written[0]} = {_OPERATIONS[operation].format(*(f'a{slot}' for slot in read))};"


def _is_output(compiled: Any, k: int) -> bool:
    return bool(compiled.instruction_id(k) == ca.OP_OUTPUT)
