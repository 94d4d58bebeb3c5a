"""CasADi functions as C.

CasADi's own generator wraps each function into an interface for CasADi (sparsity, reference counts, work memory) that
nobody calls here. This one writes the operations alone, in CasADi's order, with constants of the same bits.
"""

from __future__ import annotations

import hashlib
import math
import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from types import MappingProxyType
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
_STATEMENTS = (ca.OP_OUTPUT, ca.OP_CALL)
"""Operations without a value of their own."""
_DEEPEST = 60
"""How many choices may stand inside one another: compilers need not take more than 127 nested blocks."""
_SHORT = 200
"""Up to how many operations a function is copied to where it is called: integration then shares work between stages."""
_CALL = re.compile(r"\] = (\w+)\(")
"""A call in what CasADi prints of a function, one line for each operation: the only place where it tells the name."""
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


class Call(ABC):
    """How a call of one of CasADi's functions is written."""

    @abstractmethod
    def read(self, arguments: tuple[int, ...]) -> tuple[int, ...]:
        """Those of the arguments, all of them one after the other, that are read."""

    @abstractmethod
    def code(self, k: int, arguments: Sequence[str], results: int) -> str:
        """Statements, the last without its semicolon, whose variables have the number ``k``; or nothing.

        Args:
            k: number of the call.
            arguments: the C of those that are read.
            results: how many there are.
        """

    @abstractmethod
    def result(self, k: int, place: int) -> str:
        """The C of one of the results."""


class _Defined(Call):
    """Of a function that is written from CasADi's own."""

    def __init__(self, name: str) -> None:
        self.name = name

    def read(self, arguments: tuple[int, ...]) -> tuple[int, ...]:
        return arguments

    def code(self, k: int, arguments: Sequence[str], results: int) -> str:
        return f"const double v{k}[] = {{{', '.join(arguments)}}}; double r{k}[{results}]; {self.name}(v{k}, r{k})"

    def result(self, k: int, place: int) -> str:
        return f"r{k}[{place}]"


def function(
    name: str,
    arguments: Sequence[tuple[str, Any]],
    results: Sequence[Any],
    known: Mapping[str, Call] = MappingProxyType({}),
) -> list[str]:
    """A C function of arrays, after those that it calls: a function of one content has one name.

    Args:
        name: of the function.
        arguments: name and CasADi vector of each.
        results: scalar expressions, written to the array ``result`` in this order.
        known: how calls are written of functions that need no definition, by their names.
    """
    symbols = [symbol for _, symbol in arguments]
    compiled = ca.Function("f", symbols, [ca.densify(ca.vertcat(*results))], {"cse": True})
    names = [argument for argument, _ in arguments]
    called, lines, steps = _body(
        compiled, lambda k, place: f"{names[k]}[{place}]", f"{name.rpartition('_')[0]}_step", known
    )
    used = "".join(lines)
    unused = [f"    (void){argument};" for argument in names if f"{argument}[" not in used]
    kept_in_place = "ALWAYS_INLINE" if steps <= _SHORT else "static inline"
    return [*called, _definition(f"{kept_in_place} void {name}", names, [*unused, *lines])]


def called_in(compiled: Any) -> list[str]:
    """The names of the functions that a CasADi function calls, one for each call, in order."""
    return _CALL.findall(compiled.str(True))


def _called(compiled: Any, name: str, known: Mapping[str, Call]) -> tuple[str, list[str]]:
    """The name in C of a function that is called, and what defines it: its arguments stand in one array."""
    firsts = [0]
    for k in range(compiled.n_in()):
        firsts.append(firsts[-1] + compiled.nnz_in(k))
    called, lines, _ = _body(compiled, lambda k, place: f"values[{firsts[k] + place}]", name, known)
    name = f"{name}_{hashlib.sha256(''.join(lines).encode()).hexdigest()[:12]}"
    return name, [*called, _definition(f"static void {name}", ["values"], lines)]


def _definition(head: str, arguments: Sequence[str], lines: Sequence[str]) -> str:
    signature = ", ".join(f"const double *{argument}" for argument in arguments)
    return f"{head}({signature}, double *result)\n{{\n" + "\n".join(lines) + "\n}\n"


def _body(
    compiled: Any, value: Callable[[int, int], str], name: str, known: Mapping[str, Call]
) -> tuple[list[str], list[str], int]:
    """Of a CasADi function: definitions of those it calls, its own lines, the number of its operations.

    Args:
        compiled: the function.
        value: the C of one value of one argument.
        name: beginning of the names of those it calls.
        known: how calls are written of functions that need no definition.
    """
    unknown = [each for each in compiled.get_function() if each not in known]
    called = {each: _called(compiled.get_function(each), name, known) for each in unknown}
    written = {**known, **{each: _Defined(defined) for each, (defined, _) in called.items()}}
    calls = iter([written[each] for each in called_in(compiled)])
    steps = _steps(compiled, value, calls)
    inside: dict[Path, list[int]] = {}
    wanted = _wanted(steps)
    for k, place in enumerate(_places(steps, wanted)):
        if k in wanted:
            inside.setdefault(place, []).append(k)
    definitions = list(dict.fromkeys(text for _, texts in called.values() for text in texts))
    return definitions, list(_lines((), inside, steps)), len(steps)


class _Step(NamedTuple):
    """One operation: what it is, the numbers of the steps it takes its values from, and its C without a semicolon."""

    operation: int
    read: tuple[int, ...]
    code: str

    @property
    def is_truth(self) -> bool:
        """Whether its value is a truth in C."""
        return self.operation in _TRUTHS or self.operation in _OF_TRUTHS


def _steps(compiled: Any, value: Callable[[int, int], str], calls: Iterator[Call]) -> list[_Step]:
    """The operations of a CasADi function in order; the value of step k is the variable ``a<k>``."""
    steps: list[_Step] = []
    holds: dict[int, int] = {}  # the step whose value a place of CasADi's work memory holds
    for k in range(compiled.n_instructions()):
        operation, places = compiled.instruction_id(k), compiled.instruction_input(k)
        written = compiled.instruction_output(k)
        if operation == ca.OP_OUTPUT:
            steps.append(_Step(operation, (holds[places[0]],), f"result[{written[1]}] = a{holds[places[0]]}"))
            continue
        if operation == ca.OP_INPUT:
            steps.append(_Step(operation, (), value(*places)))
        elif operation == ca.OP_CONST:
            steps.append(_Step(operation, (), number(compiled.instruction_constant(k))))
        elif operation == ca.OP_CALL:
            steps += _call(next(calls), tuple(holds[place] for place in places), len(written), steps)
        else:
            read = tuple(holds[place] for place in places)
            steps.append(_Step(operation, read, _code(operation, read, steps)))
        for place, step in zip(reversed(written), reversed(range(len(steps))), strict=False):
            holds[place] = step
    return steps


def _call(call: Call, arguments: tuple[int, ...], results: int, steps: Sequence[_Step]) -> list[_Step]:
    """A call of a function, and its results."""
    k, read = len(steps), call.read(arguments)
    code = call.code(k, _numbers(read, steps), results)
    return [_Step(ca.OP_CALL, read, code), *(_Step(ca.OP_ASSIGN, (k,), call.result(k, n)) for n in range(results))]


def _numbers(read: Sequence[int], steps: Sequence[_Step]) -> list[str]:
    return [f"(double)a{n}" if steps[n].is_truth else f"a{n}" for n in read]


def _code(operation: int, read: tuple[int, ...], steps: Sequence[_Step]) -> str:
    """The C of an operation on the values of earlier steps."""
    numbers = _numbers(read, steps)
    truths = [f"a{n}" if steps[n].is_truth else f"(a{n} != 0.0)" for n in read]
    if operation == ca.OP_IF_ELSE_ZERO:
        return f"{truths[0]} ? {numbers[1]} : 0.0"
    if operation in _OF_TRUTHS:
        return _OF_TRUTHS[operation].format(*truths)
    template = _OPERATIONS.get(operation) or _TRUTHS.get(operation)
    if template is None:
        raise NotImplementedError(f"CasADi's operation {_NAMES.get(operation, operation)} has no C here")
    return template.format(*numbers)


def _wanted(steps: Sequence[_Step]) -> set[int]:
    """The steps that a result needs: of a look-up's derivative, which is nothing, no argument is."""
    found: set[int] = set()
    for k in reversed(range(len(steps))):
        if k in found or steps[k].operation == ca.OP_OUTPUT:
            found |= {k, *steps[k].read}
    return found


def _places(steps: Sequence[_Step], wanted: Collection[int]) -> list[Path]:
    """Where each step stands: inside all choices that alone ask for its value.

    What is not chosen is then not computed: a train that runs forwards does not pay for the equations of rolling back.
    """
    uses: list[list[Path]] = [[] for _ in steps]
    places: list[Path] = [()] * len(steps)
    for k in sorted(wanted, reverse=True):
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
        if operation in _STATEMENTS:
            yield from [f"{indent}{code};"] if code else []
        elif (*here, k) in inside:
            yield f"{indent}double a{k} = 0.0;"
            yield f"{indent}if ({code.partition(' ? ')[0]}) {{"
            yield from _lines((*here, k), inside, steps)
            yield f"{indent}    a{k} = a{read[1]};"
            yield f"{indent}}}"
        else:
            yield f"{indent}const {'bool' if steps[k].is_truth else 'double'} a{k} = {code};"
