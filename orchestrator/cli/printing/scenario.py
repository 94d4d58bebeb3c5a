"""A scenario at a glance: what it holds, what is judged of it, and what it can be asked for."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from rich.console import Console
from rich.text import Text

from ...names import SignalName
from ...scenario import import_notes
from ...system import Connection, Event, Instance, Provenance, System
from ...times import digits
from ..lines import counted
from .console import open_console, say, show_notes
from .tables import table

if TYPE_CHECKING:
    from ...run import Checked


def show_check(system: System, checked: Checked, lines: Iterable[str], quiet: bool) -> None:
    """How a scenario without errors would be run; when quiet, only what a user should know."""
    out, connections = open_console(), len(checked.wiring.links)
    if not quiet:
        say(out, system.provenance.title or system.provenance.name, "bold")
        step = digits(system.stepping.step)
        say(out, f"{len(system.instances)} instances, {connections} scalar connections, step {step} s", "dim")
        for line in lines:
            say(out, line)
    show_notes(out, checked.notes)
    if not quiet:
        say(out, "no errors", "green")


def show_system(out: Console, system: System) -> None:
    """Source and presets, how it steps, instances, connections, events, and what is made of the results."""
    origin, stepping, judged = system.provenance, system.stepping, system.judged
    say(out, origin.title or origin.name, "bold")
    facts = {
        "": origin.description,
        "source": origin.source,
        "file": origin.path,
        "steps": f"{stepping.algorithm}, every {digits(stepping.step)} s from {digits(stepping.start_time)} to "
        f"{digits(stepping.stop_time)} s",
        "seed": f"{system.seed}",
    }
    for label, fact in facts.items():
        if fact:
            say(out, f"{label}: {fact}" if label else fact)
    show_notes(out, import_notes(system))
    _show_rows(out, "Presets", ("name", "what it is"), _presets(origin))
    _show_rows(out, "Instances", ("name", "count", "model", "build arguments"), _instances(system.instances.values()))
    _show_rows(out, "Connections (input = output)", ("input", "output", "how"), _connections(system.connections))
    _show_rows(out, "Events", ("at", "signal", "what"), map(_event, system.events))
    _show_rows(out, "Requirements", ("name", "condition"), judged.requirements.items())
    _show_rows(out, "Metrics", ("name", "expression"), judged.metrics.items())
    origins = Counter(str(entry["origin"]) for entry in judged.published)
    if origins:
        say(out, f"\nPublished values: {', '.join(f'{count} {origin}' for origin, count in origins.items())}")
    if judged.references:
        say(out, f"\nReferences (our own integrations): {len(judged.references)}")
    if judged.figures:
        say(out, "\nFigures", "bold")
        for figure in judged.figures:
            say(out, str(figure["title"]))


def _show_rows(out: Console, title: str, columns: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """A table without the columns that nothing stands in; no table where there are no rows."""
    every = list(rows)
    used = [k for k in range(len(columns)) if any(row[k] for row in every)]
    made = table(title, [columns[k] for k in used], right=("count",), fold=columns)
    for row in every:
        made.add_row(*(Text(row[k]) for k in used))
    if every:
        out.print(made)


def _presets(origin: Provenance) -> list[tuple[str, str]]:
    texts = origin.preset_descriptions
    return [(name, "as it stands" if name == origin.default_preset else texts.get(name, "")) for name in origin.presets]


def _instances(instances: Iterable[Instance]) -> list[tuple[str, str, str, str]]:
    """One row for each group of siblings; those that differ in what they are built of have their own."""
    found: dict[tuple[str, str, str], list[Instance]] = {}
    for instance in instances:
        build = ", ".join(f"{name} = {_short(value)}" for name, value in instance.build.items())
        found.setdefault((SignalName(instance.name).group, instance.model, build), []).append(instance)
    return [
        (group if len(same) == same[0].count else ", ".join(one.name for one in same), str(len(same)), model, build)
        for (group, model, build), same in found.items()
    ]


def _short(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _connections(connections: Iterable[Connection]) -> list[tuple[str, str, str]]:
    """One row for each family: who feeds whom by name is what `check` tells of the platoon."""
    found: dict[tuple[SignalName, SignalName, str], list[Connection]] = {}
    for one in connections:
        target, source = (SignalName.parse(end).family for end in (one.target, one.source))
        found.setdefault((target, source, _changed(one)), []).append(one)
    return [
        (str(target), str(source), ", ".join(filter(None, (how, f"{len(same)} times"))))
        if len(same) > 1
        else (same[0].target, same[0].source, how)
        for (target, source, how), same in found.items()
    ]


def _changed(one: Connection) -> str:
    """What happens to a value on the way."""
    parts = [
        "" if one.scale is None or one.scale == 1.0 else f"times {one.scale:g}",
        f"plus {one.offset:g}" if one.offset else "",
        "" if one.threshold is None else f"whole by the threshold {one.threshold:g}",
        "units as they are" if not one.convert else "",
        ", ".join(f"{a} as {b}" for a, b in (one.map or {}).items()),
        f"{counted(one.delay, 'point')} later" if one.delay else "",
    ]
    return ", ".join(filter(None, parts))


def _event(event: Event) -> tuple[str, str, str]:
    source, size = event.source, {"value": event.value, "rate": event.rate}
    if source is not None:
        changed = _changed(source)
        size |= {"from": f"{source.source} ({changed})" if changed else source.source, "fade": event.fade}
    size |= {"for": event.duration, "every": event.every}
    return (
        f"{digits(event.at)} s",
        event.signal,
        " ".join([event.action, *(f"{k} {v}" for k, v in size.items() if v is not None)]),
    )
