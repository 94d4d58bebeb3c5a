"""`[[events]]`: what happens to which signal, and when."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from ..errors import ScenarioError
from ..names import SignalName
from ..problems import Problem, suggestion
from ..system import ACTIONS, Connection, Event
from ..times import digits
from .connections import CONNECTION_KEYS, read_source
from .groups import Entry, EventDraft, choice, number, positive, shown
from .patterns import Counts, Rule, expand, members, read_endpoint, read_signal
from .reader import Reader

EVENT_KEYS = ("signal", "action", "at", "value", "rate", "from", "fade", "duration", "every")

_NEEDED = {
    "set": ("value", "say what is set: value = 1.5"),
    "override": ("value", "say what takes the signal's place: value = 1.5"),
    "bias": ("value", "say what is added: value = 1.5"),
    "ramp": ("rate", "say what is added in each second: rate = 0.1"),
    "connect": ("from", 'say what the input follows: from = "instance.output"'),
}
_NOT_TAKEN = {
    ("freeze", "value"): "it keeps the value of the beginning; take 'override' for another one",
    ("ramp", "value"): "say what is added in each second: rate = 0.1",
    ("connect", "value"): 'say what the input follows: from = "instance.output"',
    ("set", "duration"): "what is set stays; take 'override' for a value that lasts a while",
}


@dataclass(frozen=True)
class EventRule:
    """One entry of `[[events]]`: its signals as written, and what all events that it stands for have in common.

    Where it connects, there is a source for each of the signals, or one for all.
    """

    signals: tuple[Entry, ...]
    event: Event
    sources: tuple[Connection, ...] = ()


def draft_events(reader: Reader) -> list[EventDraft]:
    """The entries in the order they are written; keys that do not belong there go to the reader's problems."""
    drafts = []
    for k, table in enumerate(reader.tables("events")):
        reader.check_keys(table, EVENT_KEYS, "events", k)
        entries = {key: reader.entry(table[key], "events", k, key) for key in EVENT_KEYS if key in table}
        drafts.append(EventDraft(reader.entry(None, "events", k), entries))
    return drafts


def read_events(drafts: Sequence[EventDraft], problems: list[Problem]) -> list[EventRule]:
    """What the entries mean; what is wrong with them is added to `problems`."""
    rules = []
    for draft in drafts:
        entries, whole = draft.entries, draft.whole
        event = Event("", _action(entries, whole, problems), _begin(entries, whole, problems), origin=whole.origin)
        if event.action:
            problems += _misfits(event.action, entries, whole)
        event.value = _value(event.action, entries["value"], problems) if "value" in entries else None
        event.rate = number(entries["rate"], problems) if "rate" in entries else None
        before = len(problems)
        event.duration = positive(entries["duration"], problems) if "duration" in entries else None
        event.every = positive(entries["every"], problems) if "every" in entries else None
        event.fade = positive(entries["fade"], problems) if "fade" in entries else None
        if len(problems) == before:
            problems += _repetition(event, entries)
        signals = _signals(entries, whole, problems)
        sources = _sources(entries["from"], len(signals), problems) if "from" in entries else []
        rules.append(EventRule(tuple(signals), event, tuple(sources)))
    return rules


def _sources(entry: Entry, count: int, problems: list[Problem]) -> list[Connection]:
    """What each of so many signals is to follow."""
    if not isinstance(entry.value, list):
        return [_source(entry, problems)] * count
    if count != len(entry.value):
        problems.append(entry.problem(f"has {len(entry.value)} sources for {count} signals", "give one for each"))
        return []
    each = (Entry(value, entry.origin, f"{entry.place}[{k}]") for k, value in enumerate(entry.value, 1))
    return [_source(one, problems) for one in each]


def _source(entry: Entry, problems: list[Problem]) -> Connection:
    if not isinstance(entry.value, str | dict):
        what = f'takes "instance.output" or {{ from = "instance.output", ... }}, not {shown(entry.value)}'
        problems.append(entry.problem(what))
        return Connection("", "", origin=entry.origin)
    table = entry.value if isinstance(entry.value, dict) else {}
    entries = {key: Entry(value, entry.origin, f"{entry.place}.{key}") for key, value in table.items()}
    for key in entries.keys() - CONNECTION_KEYS:
        near = suggestion(key, CONNECTION_KEYS) or f"valid here: {', '.join(CONNECTION_KEYS)}"
        problems.append(entries[key].problem(f"unknown key '{key}'", near))
    return read_source(entry, entries, problems)


def _signals(entries: Mapping[str, Entry], whole: Entry, problems: list[Problem]) -> list[Entry]:
    if "signal" not in entries:
        problems.append(whole.problem("signal is missing", 'name what it happens to: signal = "instance.variable"'))
        return []
    entry = entries["signal"]
    if isinstance(entry.value, str):
        return [entry]
    if isinstance(entry.value, list) and entry.value and all(isinstance(text, str) for text in entry.value):
        return [Entry(text, entry.origin, f"{entry.place}[{j}]") for j, text in enumerate(entry.value, 1)]
    problems.append(entry.problem(f'takes "instance.variable", or a list of such texts, not {shown(entry.value)}'))
    return []


def _action(entries: Mapping[str, Entry], whole: Entry, problems: list[Problem]) -> str:
    """The action; empty, with a problem noted, where there is none."""
    if "action" not in entries:
        problems.append(whole.problem("action is missing", f"say what happens: {', '.join(ACTIONS)}"))
        return ""
    before = len(problems)
    action = choice(entries["action"], problems, ACTIONS, "action")
    return action if len(problems) == before else ""


def _begin(entries: Mapping[str, Entry], whole: Entry, problems: list[Problem]) -> float:
    if "at" in entries:
        return number(entries["at"], problems)
    problems.append(whole.problem("at is missing", "say when it begins, in s: at = 60.0"))
    return 0.0


def _misfits(action: str, entries: Mapping[str, Entry], whole: Entry) -> list[Problem]:
    """What the action needs and is not given, and what it is given and does not take."""
    needed, remedy = _NEEDED.get(action, ("", ""))
    problems = []
    if needed and needed not in entries:
        problems.append(whole.problem(f"{needed} is missing", remedy))
    excluded = [key for key in ("value", "rate", "from") if key != needed]
    excluded += ["duration"] * (action == "set") + ["fade"] * (action != "connect")
    for key in excluded:
        if key in entries:
            other = (
                "ramp' for an added value that grows"
                if key == "rate"
                else "connect' for an input that follows another output"
            )
            why = _NOT_TAKEN.get((action, key), f"take '{other}")
            problems.append(entries[key].problem(f"'{action}' takes no {key}", why))
    return problems


def _value(action: str, entry: Entry, problems: list[Problem]) -> Any:
    value = entry.value
    if action == "bias":
        return number(entry, problems)
    if isinstance(value, bool | str):
        return value
    if isinstance(value, int | float):
        number(entry, problems)
        return value
    each = "write an event for each element" if isinstance(value, list) else ""
    problems.append(entry.problem(f"takes a number, true or false, or a text, not {shown(value)}", each))
    return None


def _repetition(event: Event, entries: Mapping[str, Entry]) -> list[Problem]:
    """What is wrong with the period."""
    if event.every is None or event.action in ("", "set"):
        return []
    if event.duration is None:
        remedy = "give a duration, in s: duration = 5.0"
        return [entries["every"].problem("what begins again must end before", remedy)]
    if event.every < event.duration:
        shorter = (
            f"the period, {digits(event.every)} s, must not be shorter than the duration, {digits(event.duration)} s"
        )
        return [entries["every"].problem(shorter)]
    return []


def expand_events(rules: Sequence[EventRule], counts: Counts, problems: list[Problem]) -> list[Event]:
    """The events of every single signal, in the order they are written."""
    events = []
    for k, rule in enumerate(rules, 1):
        names: dict[SignalName, Connection | None] = {}
        for n, entry in enumerate(rule.signals):
            try:
                if rule.sources:
                    found = _connected(entry.value, rule.sources[n], counts)
                else:
                    found = dict.fromkeys(members(read_signal(entry.value, counts), counts))
            except ScenarioError as error:
                problems += error.at(entry.where)
                continue
            problems += [
                Problem(entry.where, f"'{name}' stands there twice", "an event happens to a signal once", (name,))
                for name in found
                if name in names
            ]
            names |= found
        events += [replace(rule.event, signal=str(name), source=source, number=k) for name, source in names.items()]
    return events


def _connected(signal: str, source: Connection, counts: Counts) -> dict[SignalName, Connection | None]:
    """The inputs that a line stands for, each with what it follows; both ends may say `i`."""
    rule = Rule(read_endpoint(signal, counts), read_endpoint(source.source, counts), source)
    return {SignalName.parse(made.target): made for made in expand(rule, counts)}
