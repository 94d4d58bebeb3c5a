"""What the curves of a panel are made of, for a page to make them anew of other numbers.

A track is a number (one that JSON lacks as text), ``["time"]``, ``["signal", name]``, ``["parameter", name]``, or one
of `OPERATIONS` with its operands.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

from ...evaluation import FUNCTIONS, Call, Name, Node, Number, Operation, Reference, Signals, parse
from ...figures import texts_of
from .plan import told

Track = Any
"""As above, ready for JSON; None where a page cannot make the curve, because it takes more than one point in time."""
_ARITHMETIC = ("+", "-", "*", "/", "**", "negative", "positive")
_LOGIC = ("<", "<=", ">", ">=", "==", "!=", "and", "or", "not", "if")
_FUNCTIONS = (
    *("abs", "sign", "floor", "sqrt", "exp", "log", "sin", "cos", "tan", "tanh"),
    *("minimum", "maximum", "clip", "where"),
)
OPERATIONS = frozenset((*_ARITHMETIC, *_LOGIC, *_FUNCTIONS))
"""What ``resources/live.js`` can do at one point in time."""


class _NotAtOnePointError(Exception):
    """It takes more than the numbers of one point in time."""


def tracks_of(panel: Mapping[str, Any], signals: Signals) -> list[dict[str, Track]]:
    """For each of the curves that `curves_of` makes of a panel its ``track``, and what is ``across`` if not the time.

    A curve that cannot be made has no track.
    """
    names = [*signals.names(), *signals.parameters]
    scale, x = float(panel.get("scale", 1.0)), panel.get("x")
    if isinstance(x, Mapping):  # a function, over a variable that is no signal
        return [{} for text in texts_of(panel["y"]) for _ in _entry(text, names, signals)]
    over = [] if x is None else list(_entry(x, names, signals))
    found = []
    for text in texts_of(panel["y"]):
        own = [_scaled(track, scale) for track in _entry(text, names, signals)]
        across = over * len(own) if len(over) == 1 else over
        for k, track in enumerate(own):
            known = x is None or (len(across) == len(own) and across[k] is not None)
            told = {"track": track} | ({} if x is None or not known else {"across": across[k]})
            found.append(told if known and track is not None else {})
    return found


def _scaled(track: Track, scale: float) -> Track:
    return track if track is None or scale == 1.0 else ["*", track, scale]


def _entry(text: str, names: list[str], signals: Signals) -> Iterator[Track]:
    """Those of one entry: one for each value of i and each row of a slice."""
    expression = parse(text, FUNCTIONS)
    for index in expression.instances(names):
        found = dict(zip(expression.references, expression.resolve(names, index), strict=True))
        known = {"pi": math.pi, "true": 1.0, "false": 0.0, "nan": math.nan, "inf": math.inf}
        known |= {"count": float(expression.count(names))} | ({} if index is None else {"i": float(index)})
        rows = max((len(of) for reference, of in found.items() if reference.stacked), default=1)
        for row in range(rows):
            try:
                yield _track(expression.tree, {r: of[min(row, len(of) - 1)] for r, of in found.items()}, known, signals)
            except _NotAtOnePointError:
                yield None


def _track(node: Node, found: Mapping[Reference, str], known: Mapping[str, float], signals: Signals) -> Track:
    match node:
        case Number(value=value):
            return float(value)
        case Name(name="time"):
            return ["time"]
        case Name(name=name) if name in known:
            return told([known[name]])[0]
        case Reference():
            name = found[node]
            return ["signal" if name in signals.names() else "parameter", name]
        case Operation(operator=operator, operands=operands):
            return [operator, *(_track(each, found, known, signals) for each in operands)]
        case Call(name=name, arguments=arguments, keywords=()) if name in OPERATIONS:
            return [name, *(_track(each, found, known, signals) for each in arguments)]
    raise _NotAtOnePointError
