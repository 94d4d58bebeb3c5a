"""What the eigenvalues of a linear model say: whether it is stable, and how fast."""

from __future__ import annotations

import functools
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import networkx as nx
import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from ..names import SignalName
from .blocks import Array
from .closed_loop import Linearization

Complex = NDArray[np.complex128]
Verdict = Literal["stable", "drifts", "undamped", "unstable"]

NEUTRAL = 1e-7
"""Growth in 1/s below which a mode counts as neutral: it would take 100 days to notice."""
_SAME = 1e-6
_SHARE = 0.1
_SINGULAR = 1e-9
_GONE = 1e-9
"""Of a deviation, what a discrete mode leaves after one step: less than this is nothing."""


@dataclass(frozen=True)
class Mode:
    """One eigenvalue, or a conjugate pair, as many times as it occurs.

    ``pole`` is s in 1/s; for a discrete model s = ln(z) / step. ``states`` take part most; ``seen`` says whether it can
    reach an output.
    """

    pole: complex
    count: int
    states: tuple[str, ...]
    seen: bool

    @property
    def frequency(self) -> float:
        """Natural frequency |s| in rad/s."""
        return abs(self.pole)

    @property
    def damping(self) -> float:
        """Damping ratio -Re(s) / |s|; NaN for a neutral mode."""
        return -self.pole.real / abs(self.pole) if NEUTRAL < abs(self.pole) < np.inf else np.nan

    @property
    def time_constant(self) -> float:
        """Time in s in which it decays to 1/e (negative: grows by e); inf where it stays."""
        return np.inf if self.is_neutral else -1.0 / self.pole.real

    @property
    def is_neutral(self) -> bool:
        """Whether it neither grows nor decays."""
        return abs(self.pole.real) <= NEUTRAL


@dataclass(frozen=True)
class Stability:
    """Whether the loop is stable, and how fast.

    Attributes:
        verdict: ``"stable"`` where every seen mode decays, but for those that nothing pulls anywhere (all trains moved
            by the same distance); ``"drifts"`` where such a one grows with time; ``"undamped"``; ``"unstable"``.
        modes: all of them, slowest first. text: the verdict in words.
    """

    verdict: Verdict
    modes: tuple[Mode, ...]
    text: str

    @property
    def slowest(self) -> Mode | None:
        """The slowest of the seen modes that decay."""
        return next((m for m in self.modes if m.seen and not m.is_neutral and m.pole.real < 0.0), None)

    @property
    def slowest_by_variable(self) -> dict[str, Mode]:
        """The same for each variable: the slowest decaying mode in which it moves most (``speed``, ``position``)."""
        found: dict[str, Mode] = {}
        for mode in self.modes:
            if mode.seen and not mode.is_neutral and -np.inf < mode.pole.real < 0.0:
                found.setdefault(SignalName.parse(mode.states[0]).array, mode)
        return found


@functools.lru_cache(maxsize=4)
def stability(model: Linearization) -> Stability:
    """Eigenvalues, and what they mean together; remembered, because figures and responses ask again."""
    modes = _modes(model)
    growing = [m for m in modes if m.pole.real > NEUTRAL]
    ringing = [m for m in modes if m.is_neutral and m.seen and m.frequency > 10.0 * NEUTRAL]
    neutral = [m for m in modes if m.is_neutral and m.seen and m not in ringing]
    if growing:
        text = f"unstable: {_count(growing)} grow{_s(growing)}, the fastest by e in {-growing[0].time_constant:.4g} s"
        return Stability("unstable", tuple(modes), f"{text} ({_listed(growing[0].states)})")
    if ringing:
        text = f"undamped: {_count(ringing)} neither growing nor decaying, at {ringing[0].frequency:.4g} rad/s"
        return Stability("undamped", tuple(modes), f"{text} ({_listed(ringing[0].states)})")
    if sum(m.count for m in neutral) > _nullity(model):
        names = ", ".join(dict.fromkeys(name for m in neutral for name in m.states))
        return Stability("drifts", tuple(modes), f"drifts: a push sends it off for ever, nothing slows it ({names})")
    text = "stable: every deviation decays"
    if neutral:
        text += f", but for {_count(neutral)} that nothing pulls back ({_listed(neutral[0].states)})"
    return Stability("stable", tuple(modes), text)


def _count(modes: Sequence[Mode]) -> str:
    number = sum(m.count for m in modes)
    return f"{number} mode{'s' * (number > 1)}"


def _s(modes: Sequence[Mode]) -> str:
    return "s" if sum(m.count for m in modes) == 1 else ""


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names)


def _graph(model: Linearization) -> Any:
    """What acts on what: the states by number, -1 for all outputs together."""
    graph = nx.DiGraph()
    graph.add_nodes_from(range(-1, len(model.states)))
    graph.add_edges_from((int(j), int(i)) for i, j in np.argwhere(model.a))
    graph.add_edges_from((int(j), -1) for _, j in np.argwhere(model.c))
    return graph


def _modes(model: Linearization) -> list[Mode]:
    """Modes of the whole: those of its strongly connected parts, which keeps chains of delays free of rounding."""
    graph = _graph(model)
    reaching = nx.ancestors(graph, -1)
    graph.remove_node(-1)
    found: list[tuple[complex, dict[str, float], bool]] = []
    for part in nx.strongly_connected_components(graph):
        members = sorted(part)
        found += _of_part(model, members, members[0] in reaching)
    modes: list[Mode] = []
    for seen in (True, False):
        groups: list[list[tuple[complex, dict[str, float], bool]]] = []
        for each in sorted((f for f in found if f[2] == seen), key=lambda f: (f[0].real, f[0].imag)):
            alike = [g for g in groups if _is_same(g[0][0], each[0])]
            alike[0].append(each) if alike else groups.append([each])
        modes += [_mode(group) for group in groups]
    return sorted(modes, key=lambda m: (-m.pole.real, m.frequency, not m.seen))


def _is_same(a: complex, b: complex) -> bool:
    return a == b or abs(a - b) <= _SAME * abs(b)


def _mode(group: Sequence[tuple[complex, dict[str, float], bool]]) -> Mode:
    shares: dict[str, float] = {}
    for _, part, _ in group:
        for name, share in part.items():
            shares[name] = max(share, shares.get(name, 0.0))
    names = [n for n in sorted(shares, key=lambda n: -shares[n]) if shares[n] > _SHARE * max(shares.values())]
    pole = group[0][0]
    return Mode(pole, (2 if pole.imag else 1) * len(group), _families(names), group[0][2])


def _of_part(
    model: Linearization, members: Sequence[int], seen: bool
) -> Iterator[tuple[complex, dict[str, float], bool]]:
    """Pole, shares of the states, and whether it is seen, of each mode of one part; one for a conjugate pair."""
    poles, vectors = np.linalg.eig(model.a[np.ix_(members, members)])
    shares = _shares(vectors)
    for k, value in enumerate(poles):
        pole = complex(value)
        if model.step is not None:
            size = abs(pole)
            pole = complex(np.log(size), np.angle(pole)) / model.step if size > _GONE else complex(-np.inf, 0.0)
        if abs(pole) < NEUTRAL:
            pole = 0j
        if pole.imag >= 0.0:
            yield pole, {model.states[i]: float(shares[row, k]) for row, i in enumerate(members)}, seen


def _shares(vectors: Complex) -> Array:
    """How much each state (row) takes part in each mode (column)."""
    try:
        left = np.linalg.inv(vectors)
    except np.linalg.LinAlgError:
        left = np.linalg.pinv(vectors)
    shares = np.abs(vectors * left.T)
    return np.asarray(shares / np.maximum(shares.sum(axis=0), 1e-300))


def _families(names: Sequence[str]) -> tuple[str, ...]:
    """At most three names; several of a family as ``train[1, 3–5].speed``."""
    found: dict[str, list[int]] = {}
    for name in names:
        index = re.search(r"\[(\d+)\]", name)
        found.setdefault(re.sub(r"\[\d+\]", "[]", name, count=1), []).extend([int(index[1])] if index else [])
    texts = [family.replace("[]", f"[{_ranges(numbers)}]", 1) for family, numbers in found.items()]
    return (*texts[:3], *(["..."] if len(texts) > 3 else []))


def _ranges(numbers: Sequence[int]) -> str:
    """1, 3, 4, 5 as ``1, 3–5``."""
    runs: list[list[int]] = []
    for number in sorted(set(numbers)):
        if runs and number == runs[-1][-1] + 1:
            runs[-1].append(number)
        else:
            runs.append([number])
    return ", ".join(f"{run[0]}–{run[-1]}" if len(run) > 2 else ", ".join(map(str, run)) for run in runs)


def _nullity(model: Linearization) -> int:
    """How many independent directions of what is seen stay where they are put."""
    reaching = sorted(nx.ancestors(_graph(model), -1))
    matrix = model.a[np.ix_(reaching, reaching)]
    if not reaching:
        return 0
    if model.step is not None:
        matrix = (matrix - np.eye(len(matrix))) / model.step
    sizes = np.linalg.svd(linalg.matrix_balance(matrix)[0], compute_uv=False)
    return int((sizes <= max(_SINGULAR * sizes[0], NEUTRAL)).sum())
