"""Connections written once for many trains: `"cruise[i].ahead_position" = "train[i-1].position"`.

An endpoint is `instance.variable`; either may carry an index of `i`. A pattern stands for every `i` for which both
ends exist. What is written without `i` beats what a pattern makes.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

from ..errors import ScenarioError, did_you_mean
from ..system import Connection

NAME = r"[A-Za-z_][A-Za-z0-9_]*"
# Blanks are taken possessively: a key of nothing but blanks would otherwise be tried in every possible division.
_ENDPOINT = re.compile(rf"({NAME})\s*+(?:\[([^\[\]]*)\]\s*+)?\.\s*+(.+)", re.DOTALL)
_INDEX = re.compile(r"\s*+(?:(\d{1,9})|i\s*+(?:([+-])\s*+(\d{1,9}))?)\s*+")
_BRACKETS = re.compile(r"\[([^\[\]]*)\]")
_ELEMENT = re.compile(r"(.*)\[\d+(?:,\d+)*\]", re.DOTALL)

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

    def at(self, i: int) -> str | None:
        """The full name for one `i`; None where an element's number would be below 1."""
        parts = [part if isinstance(part, str) else part.at(i) for part in self.elements]
        if any(isinstance(part, int) and part < 1 for part in parts):
            return None
        place = "" if self.index is None else f"[{self.index.at(i)}]"
        return f"{self.instance}{place}.{''.join(map(str, parts))}"


@dataclass(frozen=True)
class Signal:
    """A signal of one instance or of all of a name; `index` is None for all, and where there is no count."""

    instance: str
    index: int | None
    variable: str

    def names(self, counts: Counts) -> list[str]:
        """The full names: `cruise[1].speed`, `cruise[2].speed`, ..."""
        count = counts[self.instance]
        if self.index is None and count is not None:
            return [f"{member(self.instance, k + 1)}.{self.variable}" for k in range(count)]
        return [f"{member(self.instance, self.index)}.{self.variable}"]

    def covers(self, other: Signal) -> bool:
        """Whether it stands for all that the other stands for: all instances for one, an array for its elements."""
        return (
            self.instance == other.instance
            and self.index in (None, other.index)
            and (other.variable == self.variable or other.variable.startswith(f"{self.variable}["))
        )


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


def read_endpoint(text: str, counts: Counts) -> Endpoint:
    """Read `instance.variable`.

    Raises:
        ScenarioError: it is something else, or there is no such instance (with the nearest one).
    """
    match = _ENDPOINT.fullmatch(text.strip())
    if not match:
        near = did_you_mean(text, counts.keys() - {text}) or f"; instances are {', '.join(counts) or 'none yet'}"
        raise ScenarioError(f"'{text}' is not of the form instance.variable, as in train[i].position{near}")
    instance, index, variable = match.groups()
    read = check_instance(instance, index, counts)
    return Endpoint(text, instance, read, _elements(variable))


def read_signal(text: str, counts: Counts) -> Signal:
    """Read `instance.variable` where `i` means nothing: the bare name of instances that have a count means all.

    Raises:
        ScenarioError: it is something else, or there is no such instance (with the nearest one).
    """
    match = _ENDPOINT.fullmatch(text.strip())
    if not match:
        near = did_you_mean(text, counts.keys() - {text}) or f"; instances are {', '.join(counts) or 'none yet'}"
        raise ScenarioError(f"'{text}' is not of the form instance.variable, as in train[4].speed or train.speed{near}")
    instance, index, variable = match.groups()
    parts = _elements(variable)
    if any(isinstance(part, Index) for part in parts):
        whole = f"{match.string[: match.start(3)].strip()}{_BRACKETS.sub('', variable)}"
        raise ScenarioError(f"'{text}': i has no meaning here; write {whole} for the whole array or {whole}[1] for one")
    name = "".join(map(str, parts))
    read = None
    if instance not in counts or index is not None:
        number = Index.read(index or "")
        if counts.get(instance) and (number is None or number.free):
            why = "an index is a number here" if number is None else "i has no meaning here"
            raise ScenarioError(f"'{text}': {why}; write {instance}.{name} for all or {instance}[1].{name} for one")
        read = check_instance(instance, index, counts)
    return Signal(instance, read.offset if read else None, name)


def check_instance(instance: str, index: str | None, counts: Counts) -> Index | None:
    """The index of an instance that is known to exist.

    Raises:
        ScenarioError: no such instance, no such member, or an index where none belongs or none where one does.
    """
    if instance not in counts:
        near = did_you_mean(instance, counts) or f"; instances are {', '.join(counts) or 'none yet'}"
        raise ScenarioError(f"there is no instance '{instance}'{near}")
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
        raise ScenarioError(
            f"'{instance}[{index}]': an index is a number, i, i-1 or i+1; for all of them write {instance}[i]"
        )
    if not read.free and not 1 <= read.offset <= count:
        raise ScenarioError(f"there is no '{instance}[{index}]'; there are {instance}[1] to {instance}[{count}]")
    return read


def _elements(variable: str) -> tuple[str | Index, ...]:
    """The variable's name cut into plain text and the indices of `i` in its brackets."""
    parts: list[str | Index] = [""]
    end = 0
    for match in _BRACKETS.finditer(variable):
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
    return [
        replace(rule.options, source=source, target=target)
        for i in _range(rule, counts)
        if (source := rule.source.at(i)) and (target := rule.target.at(i))
    ]


def _range(rule: Rule, counts: Counts) -> range:
    ends = (rule.target, rule.source)
    if not rule.is_pattern:
        return range(1)
    if not rule.target.free:
        raise ScenarioError(
            f"every i would drive the one input '{rule.target.text}'; write i there too, or a number here"
        )
    bounded = [end.indices(counts) for end in ends if end.index and end.index.free]
    if not bounded:
        raise ScenarioError("i has no range, because no instance carries it; whole arrays connect by their bare names")
    common = range(max(r.start for r in bounded), min(r.stop for r in bounded))
    shifts = [part.offset for end in ends for part in end.elements if isinstance(part, Index)]
    common = range(max([common.start, *(1 - shift for shift in shifts)]), common.stop)
    if not common:
        known = ", ".join(
            f"{name} {count}" for name in dict.fromkeys(e.instance for e in ends) if (count := counts[name])
        )
        raise ScenarioError(f"there is no i for which both ends exist; counts are: {known}")
    return common


def connect(rules: list[Rule], counts: Counts, problems: list[str]) -> list[Connection]:
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
                problems += [f"{where}: {problem}" for problem in error.problems]
                continue
            for connection in connections:
                earlier = made.get(connection.target)
                if earlier and earlier[0].is_pattern == rule.is_pattern:
                    problems.append(
                        f"{where}: '{connection.target}' is already driven by '{earlier[1].source}' "
                        f"({earlier[1].origin}); an input has one source, remove one of the two"
                    )
                made[connection.target] = (rule, connection)
    connections = [connection for _, connection in made.values()]
    problems += _overlaps(connections)
    return connections


def _overlaps(connections: list[Connection]) -> Iterator[str]:
    """Arrays that are driven as a whole and by element as well."""
    targets = {connection.target: connection for connection in connections}
    for target, connection in targets.items():
        match = _ELEMENT.fullmatch(target)
        if match and "." in match[1] and match[1] in targets:
            yield (
                f'{connection.origin}: connections."{target}": '
                f"the whole of '{match[1]}' is driven already "
                f"({targets[match[1]].origin}); connect either the array or its elements"
            )
