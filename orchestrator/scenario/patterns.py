"""Connections written once for many trains: `"cruise[i].ahead_position" = "train[i-1].position"`.

An endpoint is `instance.variable`; either may carry an index of `i`. A pattern stands for every `i` for which both
ends exist. What is written without `i` beats what a pattern makes.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

from ..errors import ScenarioError
from ..names import SignalName
from ..problems import Problem, suggestion
from ..system import Connection

NAME = r"[A-Za-z_][A-Za-z0-9_]*"
# Blanks are taken possessively: a key of nothing but blanks would otherwise be tried in every possible division.
_REFERENCE = re.compile(rf"({NAME})\s*+(?:\[([^\[\]]*)\]\s*+)?(?:\.\s*+(.+))?", re.DOTALL)
_INDEX = re.compile(r"\s*+(?:(-?\d{1,9})|i\s*+(?:([+-])\s*+(\d{1,9}))?)\s*+")
# What stands in a quoted name of Modelica is part of the name.
_BRACKETS = re.compile(r"'(?:[^'\\]|\\.)*'|\[([^\[\]]*)\]", re.DOTALL)


Counts = Mapping[str, int | None]  # instances by name with their count; None for one without a count


@dataclass(frozen=True)
class Index:
    """`2`, `i` or `i - 1`: a number, or one added to `i`."""

    offset: int
    free: bool

    @classmethod
    def read(cls, text: str) -> Index | None:
        """The index a text stands for, or None where it is something else."""
        match = _INDEX.fullmatch(text)
        if not match:
            return None
        if match[1]:
            return cls(int(match[1]), free=False)
        return cls(int(f"{match[2] or '+'}{match[3] or 0}"), free=True)

    def at(self, i: int) -> int:
        """The number for one `i`."""
        return self.offset + i * self.free


@dataclass(frozen=True)
class Endpoint:
    """One end of a connection; `elements` are the parts of the variable's name, indices of `i` between text."""

    text: str
    instance: str
    index: Index | None
    elements: tuple[str | Index, ...]

    @property
    def free(self) -> bool:
        """Whether `i` occurs."""
        return bool(self.index and self.index.free) or self.element_free

    @property
    def element_free(self) -> bool:
        """Whether `i` occurs in the variable."""
        return any(isinstance(part, Index) for part in self.elements)

    def indices(self, counts: Counts) -> range:
        """The `i` for which the instance exists; empty where only the variable says `i`."""
        if not (self.index and self.index.free):
            return range(0)
        return range(max(1, 1 - self.index.offset), (counts[self.instance] or 0) - self.index.offset + 1)

    def at(self, i: int) -> str:
        """The full name for one `i`."""
        parts = [part if isinstance(part, str) else str(part.at(i)) for part in self.elements]
        place = "" if self.index is None else f"[{self.index.at(i)}]"
        return f"{self.instance}{place}.{''.join(parts)}"

    def may_lack(self, i: int) -> bool:
        """Whether an element's number is below 1 for one `i`: arrays of other makers begin anywhere."""
        return any(part.at(i) < 1 for part in self.elements if isinstance(part, Index))


@dataclass(frozen=True)
class Rule:
    """One line of `[connections]`: a target, a source, and the options of the connections it makes."""

    target: Endpoint
    source: Endpoint
    options: Connection

    @property
    def is_pattern(self) -> bool:
        """Whether it says `i`."""
        return self.target.free or self.source.free


def member(instance: str, index: int | None) -> str:
    """`train[2]`, or `gust` where there is no index."""
    return instance if index is None else f"{instance}[{index}]"


def members(signal: SignalName, counts: Counts) -> list[SignalName]:
    """The signals of single instances that one of a group stands for: of `cruise[1]`, `cruise[2]`, ..."""
    count = counts.get(signal.instance)
    if count is None:
        return [signal]
    return [SignalName(member(signal.instance, k + 1), signal.variable) for k in range(count)]


class Reference(NamedTuple):
    """`train[i].speed` as it is written: a name, what stands in its brackets, and what follows the dot."""

    name: str
    inside: str | None
    rest: str


def read_reference(text: str, counts: Counts, example: str, *, whole: bool = False) -> Reference:
    """Take a text apart; nothing of it needs to exist.

    Args:
        text: `instance.variable`.
        counts: for the message.
        example: how it is written.
        whole: whether `instance` alone will do as well; its rest is empty.

    Raises:
        ScenarioError: it is something else.
    """
    match = _REFERENCE.fullmatch(text.strip())
    if match and (match[3] or whole):
        return Reference(match[1], match[2], match[3] or "")
    near = suggestion(text, counts.keys() - {text}) or f"instances are {', '.join(counts) or 'none yet'}"
    raise ScenarioError(Problem("", f"'{text}' is not of the form instance.variable, as in {example}", near))


def read_endpoint(text: str, counts: Counts) -> Endpoint:
    """Read `instance.variable`.

    Raises:
        ScenarioError: it is something else, or there is no such instance (with the nearest one).
    """
    name, index, variable = read_reference(text, counts, "train[i].position")
    return Endpoint(text, name, check_instance(name, index, counts), _elements(variable))


def read_signal(text: str, counts: Counts) -> SignalName:
    """Read `instance.variable` where `i` means nothing: the bare name of instances that have a count means all.

    Raises:
        ScenarioError: it is something else, or there is no such instance (with the nearest one).
    """
    instance, index, variable = read_reference(text, counts, "train[4].speed or train.speed")
    parts = _elements(variable)
    if any(isinstance(part, Index) for part in parts):
        bare = "".join(part for part in parts if isinstance(part, str)).replace("[]", "")
        whole = f"{instance}{'' if index is None else f'[{index}]'}.{bare}"
        remedy = f"write {whole} for the whole array or {whole}[1] for one"
        raise ScenarioError(Problem(f"'{text}'", "i has no meaning here", remedy))
    name = "".join(map(str, parts))
    read = None
    if instance not in counts or index is not None:
        number = Index.read(index or "")
        if counts.get(instance) and (number is None or number.free):
            why = "an index is a number here" if number is None else "i has no meaning here"
            remedy = f"write {instance}.{name} for all or {instance}[1].{name} for one"
            raise ScenarioError(Problem(f"'{text}'", why, remedy))
        read = check_instance(instance, index, counts)
    return SignalName(member(instance, read.offset if read else None), name)


def check_instance(instance: str, index: str | None, counts: Counts) -> Index | None:
    """The index of an instance that is known to exist.

    Raises:
        ScenarioError: no such instance, no such member, or an index where none belongs or none where one does.
    """
    if instance not in counts:
        near = suggestion(instance, counts) or f"instances are {', '.join(counts) or 'none yet'}"
        raise ScenarioError(Problem("", f"there is no instance '{instance}'", near))
    count = counts[instance]
    if index is None:
        if count is not None:
            raise ScenarioError(
                f"'{instance}' has a count of {count}: write {instance}[i] for all or {instance}[1] for one"
            )
        return None
    if count is None:
        raise ScenarioError(f"'{instance}' has no count: write {instance} without [{index}]")
    read = Index.read(index)
    if read is None:
        remedy = f"for all of them write {instance}[i]"
        raise ScenarioError(Problem(f"'{instance}[{index}]'", "an index is a number, i, i-1 or i+1", remedy))
    if not read.free and not 1 <= read.offset <= count:
        there = f"there are {instance}[1] to {instance}[{count}]"
        raise ScenarioError(Problem("", f"there is no '{instance}[{index}]'", there))
    return read


def _elements(variable: str) -> tuple[str | Index, ...]:
    """The variable's name cut into plain text and the indices of `i` in its brackets."""
    parts: list[str | Index] = [""]
    end = 0
    for match in _BRACKETS.finditer(variable):
        if match[1] is None:
            continue
        parts += [variable[end : match.start()], "["]
        for k, item in enumerate(match[1].split(",")):
            index = Index.read(item)
            parts += ["," * bool(k), index if index and index.free else item.strip()]
        parts.append("]")
        end = match.end()
    parts.append(variable[end:])
    return _joined(parts)


def _joined(parts: list[str | Index]) -> tuple[str | Index, ...]:
    result: list[str | Index] = []
    for part in parts:
        if isinstance(part, str) and result and isinstance(result[-1], str):
            result[-1] += part
        elif part != "":
            result.append(part)
    return tuple(result)


def expand(rule: Rule, counts: Counts) -> list[Connection]:
    """The connections a line stands for.

    Raises:
        ScenarioError: `i` has no range, the input would be driven several times, or nothing exists at both ends.
    """
    ends = (rule.source, rule.target)
    return [
        replace(
            rule.options,
            source=rule.source.at(i),
            target=rule.target.at(i),
            optional=rule.options.optional or any(end.may_lack(i) for end in ends),
        )
        for i in _range(rule, counts)
    ]


def _range(rule: Rule, counts: Counts) -> range:
    ends = (rule.target, rule.source)
    if not rule.is_pattern:
        return range(1)
    if not rule.target.free:
        message = f"every i would drive the one input '{rule.target.text}'"
        raise ScenarioError(Problem("", message, "write i there too, or a number here"))
    bounded = [end.indices(counts) for end in ends if end.index and end.index.free]
    if not bounded:
        remedy = "arrays connect by their bare names, or with [:] for i"
        raise ScenarioError(Problem("", "i has no range, because no instance carries it", remedy))
    common = range(max(r.start for r in bounded), min(r.stop for r in bounded))
    if not common:
        known = ", ".join(
            f"{name} {count}" for name in dict.fromkeys(e.instance for e in ends) if (count := counts[name])
        )
        raise ScenarioError(Problem("", "there is no i for which both ends exist", f"counts are: {known}"))
    return common


def connect(rules: list[Rule], counts: Counts, problems: list[Problem]) -> list[Connection]:
    """All connections of a scenario, each target once; what is wrong is added to `problems`."""
    made: dict[str, tuple[Rule, Connection]] = {}
    for explicit in (False, True):  # so that explicit ones replace what patterns made
        for rule in rules:
            if rule.is_pattern == explicit:
                continue
            where = f'{rule.options.origin}: connections."{rule.target.text}"'
            try:
                connections = expand(rule, counts)
            except ScenarioError as error:
                problems += error.at(where)
                continue
            for connection in connections:
                earlier = made.get(connection.target)
                if earlier and earlier[0].is_pattern == rule.is_pattern:
                    driven = f"'{connection.target}' is already driven by '{earlier[1].source}' ({earlier[1].origin})"
                    ends = SignalName.parse(connection.target), SignalName.parse(earlier[1].source)
                    problems.append(Problem(where, driven, "an input has one source, remove one of the two", ends))
                made[connection.target] = (rule, connection)
    connections = [connection for _, connection in made.values()]
    problems += _overlaps(connections)
    return connections


def _overlaps(connections: list[Connection]) -> Iterator[Problem]:
    """Arrays that are driven as a whole and by element as well."""
    targets = {connection.target: connection for connection in connections}
    for text in filter(lambda text: text.endswith("]"), targets):
        target, connection = SignalName.parse(text), targets[text]
        array = SignalName(target.instance, target.array)
        if target.element and str(array) in targets:
            where = f'{connection.origin}: connections."{target}"'
            driven = f"the whole of '{array}' is driven already ({targets[str(array)].origin})"
            yield Problem(where, driven, "connect either the array or its elements", (target, array))
