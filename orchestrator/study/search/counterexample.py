"""A counterexample as a scenario that anyone can run, and its picture beside the nominal run."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ...comparison import draw_compared
from ...errors import ExpressionError, RailcosimError
from ...evaluation import FUNCTIONS, Signals, Verdict, parse
from ...fmi import Kind
from ...run import Run, execute
from ...scenario import assignment, dump, load
from ...system import System
from ..campaign import rewrite
from .keeping import copy, kept
from .space import Changes, Space

NOMINAL, COUNTEREXAMPLE = "nominal.toml", "counterexample.toml"

_TEMPORAL = re.compile(
    r"\b(?:always|eventually|finally|historically|once|since|until|rise|fall|implies|and|or|not)\b"
    r"|<=|>=|==|!=|<|>|->|=>"
)
"""What stands between the quantities of a requirement."""
_CLAUSES = re.compile(
    r"\b(?:from|until) [\w.\[\]]+$|\b(?:from|until) [\w.\[\]]+(?= (?:from|until|outside))|\boutside \[[^\]]*\]"
)
"""When a requirement counts: no quantity of it."""
_MOVED = re.compile(r"\bi ?([+-]) ?(\d+)")
_MOST_PANELS = 5


def changed_scenario(nominal: Path, space: Space, changes: Changes) -> System:
    """The scenario of a file with changes; the values of a signal are given as one list.

    Args:
        nominal: the scenario that was searched.
        space: what was varied of it.
        changes: what differs.
    """
    given = dict(changes)
    for signal in space.signals:
        if signal.shown and any(key in given for key in signal.keys):
            pairs = zip(signal.keys, signal.nominal, strict=True)
            given[signal.array] = [float(given.pop(key, value)) for key, value in pairs]
    swaps = [f"{key}={value}" for key, value in given.items() if "." not in key]
    settings = [assignment(key, value) for key, value in given.items() if "." in key]
    return load(nominal, swaps=swaps, settings=settings)


def scenario_text(system: System, comments: Sequence[str]) -> str:
    """A scenario below comments."""
    lines = [f"# {line}".rstrip() for line in comments]
    return "\n".join([*lines, "", dump(system)])


def write_scenario(path: Path, system: System, comments: Sequence[str]) -> None:
    """Write a scenario below comments, and what it names beside it."""
    system, copies = kept(system, path.parent)
    copy(copies, path.parent)
    rewrite(path, scenario_text(system, comments).encode())


def write_counterexample(
    directory: Path, space: Space, changes: Changes, requirement: str, *, kind: Kind = "auto", figure: bool = True
) -> tuple[Path, Verdict, list[Path]]:
    """Write `counterexample.toml` and its picture; both runs are run once more, with everything recorded.

    Args:
        directory: that holds the nominal scenario.
        space: what was varied.
        changes: that break the requirement.
        requirement: by name.
        kind: how components become models.
        figure: whether to draw.

    Returns:
        the scenario's file, the verdict of its run, and the figures.
    """
    nominal, path = directory / NOMINAL, directory / COUNTEREXAMPLE
    system = changed_scenario(nominal, space, changes)
    write_scenario(path, system, ())
    broken = _run(path, kind)
    verdict = next((one for one in broken.requirements if one.name == requirement), None)
    if verdict is None or verdict.verdict != "fail":
        raise RailcosimError(
            f"{path}: run by itself, it does not break {requirement}: a component's run is not repeatable"
        )
    write_scenario(path, system, _comments(system, space, changes, verdict))
    figures = []
    if figure:
        runs = {"nominal": _run(nominal, kind), "counterexample": broken}
        wanted = [figure_of(space, changes, verdict, broken)]
        figures = draw_compared(wanted, {name: run.results for name, run in runs.items()}, directory)
    return path, verdict, figures


def _run(scenario: Path, kind: Kind) -> Run:
    run = execute(load(scenario), kind=kind)
    if run.signal:
        raise KeyboardInterrupt
    return run


def _comments(system: System, space: Space, changes: Changes, verdict: Verdict) -> list[str]:
    """What breaks, where, and what was changed for it."""
    margin = "" if verdict.margin is None else f" by {abs(verdict.margin):.6g}"
    where = "" if verdict.time is None else f" at {verdict.time:g} s"
    where += "" if verdict.index is None else f", i = {verdict.index}"
    lines = [f"Breaks requirement '{verdict.name}'{margin}{where}: {verdict.text}", ""]
    lines += ["The smallest change from nominal that a search has found to break it:"]
    return [
        *lines,
        *(f"    {line}" for line in describe(space, changes)),
        "",
        f"Run it: orchestrate run {COUNTEREXAMPLE}",
    ]


def describe(space: Space, changes: Changes) -> list[str]:
    """What changes are, a line each; of a signal which of its values."""
    rest = dict(changes)
    lines = []
    for signal in space.signals:
        own = [k + 1 for k, key in enumerate(signal.keys) if key in rest]
        for key in signal.keys:
            rest.pop(key, None)
        if own:
            count = f"{len(own)} of its {signal.signal.size} values"
            lines.append(f"{signal.signal.name}: {count} ({', '.join(map(str, own))})")
    for key, value in rest.items():
        before = space.nominal.get(key)
        shown = value if not isinstance(value, float) else f"{value:.6g}"
        lines.append(f"{key}: {shown}" + ("" if before is None else f", nominal {before:g}"))
    return lines or ["nothing: it is the scenario as it stands"]


def figure_of(space: Space, changes: Changes, verdict: Verdict, run: Run) -> dict[str, Any]:
    """The picture of a counterexample, as a scenario's `[[figures]]` would say it."""
    mark: dict[str, Any] = {} if verdict.time is None else {"marks": [{"x": verdict.time, "label": "decides"}]}
    compared, bounds = quantities(verdict, run.results)
    levels = {"bands": [[bound] for bound in bounds]} if len(compared) == 1 else {}
    panels = [{"title": text, "y": [text], **levels, **mark} for text in compared]
    for signal in space.signals:
        if signal.shown and any(key in changes for key in signal.keys):
            panels.append({"title": f"{signal.signal.name}, varied", "y": [signal.shown], **mark})
    single = [line for line in describe(space, changes) if " values (" not in line]
    remark = "\n".join(filter(None, (verdict.text, "; ".join(single[:6]))))
    return {"title": f"Counterexample to {verdict.name}", "remark": remark, "panels": panels[:_MOST_PANELS]}


def quantities(verdict: Verdict, signals: Signals) -> tuple[list[str], list[str]]:
    """What a requirement compares, as expressions for the index that decides it: quantities over time, and bounds."""
    text = _CLAUSES.sub("", verdict.text)
    if verdict.index is not None:
        text = _MOVED.sub(lambda match: str((verdict.index or 0) + int(match[1] + match[2])), text)
        text = re.sub(r"\bi\b", str(verdict.index), text)
    names = [*signals.names(), *signals.parameters]
    moving: dict[str, None] = {}
    bounds: dict[str, None] = {}
    for part in _TEMPORAL.split(text):
        piece = _balanced(part.strip())
        try:
            expression = parse(piece, FUNCTIONS)
        except ExpressionError:
            continue
        if expression.check(names):
            continue
        resolved = [name for group in expression.resolve(names) for name in group]
        (moving if any(name in signals.names() for name in resolved) else bounds).setdefault(piece)
    return list(moving)[:3], list(bounds)


def _balanced(text: str) -> str:
    """A part of an expression without brackets that close or open beyond it, and without a window before it."""
    text = re.sub(r"^\[[^\]]*\]", "", text).strip()
    while text.startswith("(") and text.count("(") > text.count(")"):
        text = text[1:].strip()
    while text.endswith(")") and text.count(")") > text.count("("):
        text = text[:-1].strip()
    return text


def as_json(changes: Mapping[str, Any]) -> dict[str, Any]:
    """Changes as JSON holds them."""
    return {key: value.item() if hasattr(value, "item") else value for key, value in changes.items()}
