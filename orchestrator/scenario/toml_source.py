"""Reading TOML so that later messages can name the line: `tomllib` for values, a small scan for where keys stand."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from .. import world
from ..errors import ScenarioError
from ..problems import Problem

MAX_DEPTH = 100
MAX_SIZE = 1 << 24
"""Characters of a scenario: far more than people write, and read within seconds."""
Path_ = tuple[str | int, ...]  # where a value stands: ("instances", "train", "count"), ("published", 0, "value")

_TOKEN = re.compile(
    # Possessive: what is once read is kept, or a long string costs a hundred times its size in ways back.
    r'"""(?:[^"\\]++|\\.|"(?!""))*+"{3,5}'  # multi-line strings; up to two quotes may stand just inside the end
    r"|'''(?:[^']++|'(?!''))*+'{3,5}"
    r'|"(?:[^"\\\n]++|\\.)*+"'
    r"|'[^'\n]*+'"
    r"|\#[^\n]*"
    r"|\n|[\[\]{}=.,]|[^\S\n]+|[^\s\[\]{}=.,\#\"']+",
    re.DOTALL,
)
_ENDS = frozenset("[]{}=,\n")
"""Tokens at which no key goes on."""
_UNQUOTED_INDEX = re.compile(r"^\s*[A-Za-z_][\w.-]*\[[^\]]*\][^=]*=")


class Source:
    """A TOML text, its values and the line of each key.

    Attributes:
        label: how messages call the file. text: as read. data: the values.

    Args:
        places: where values were really written, by their path; for a text that was made of another file.
    """

    def __init__(self, text: str, label: str, places: Mapping[Path_, str] | None = None) -> None:
        self.label = label
        self._places = places
        self.text = text.removeprefix("\ufeff")
        self._check_size(len(text))
        self.data = self._parse()
        self._lines = _locate(self.text)
        huge = [self.origin(*path) for path in _huge_integers(self.data, ())]
        if huge:
            beyond = Problem("", "an integer beyond 64 bits", "write it with a decimal point")
            raise ScenarioError([beyond.at(origin) for origin in huge])

    @classmethod
    def read(cls, path: Path, label: str) -> Source:
        """Read a file.

        Raises:
            ScenarioError: it cannot be read, is not UTF-8, or is not TOML (with line and column).
        """
        try:
            with world.open(path, encoding="utf-8") as stream:
                return cls(stream.read(MAX_SIZE + 1), label)
        except UnicodeDecodeError as error:
            message = f"not a text in UTF-8 ({error.reason} at byte {error.start})"
            raise ScenarioError(Problem(label, message, "save it as UTF-8")) from None
        except OSError as error:
            raise ScenarioError(Problem(label, f"cannot be read: {error.strerror or error}")) from None

    def line(self, *path: str | int) -> int | None:
        """The line (from 1) of the key at `path`, or of the nearest thing around it; None where that is unknown."""
        for length in range(len(path), 0, -1):
            if path[:length] in self._lines:
                return self._lines[path[:length]]
        return None

    def origin(self, *path: str | int) -> str:
        """``"scenario.toml:31"``, or the file alone where the line is unknown."""
        if self._places is not None:
            found = (self._places.get(path[:length]) for length in range(len(path), 0, -1))
            return next(filter(None, found), self.label)
        line = self.line(*path)
        return self.label if line is None else f"{self.label}:{line}"

    def _check_size(self, length: int) -> None:
        """Refuse what would take the memory of the machine, or hours, before a value is read."""
        if length > MAX_SIZE:
            message = f"it has more than {MAX_SIZE >> 20} million characters"
            raise ScenarioError(Problem(self.label, message, "give long profiles as JSON files, by name"))
        dots = 0
        for token, number in _tokens(self.text):
            dots = 0 if token in _ENDS else dots + (token == ".")
            if dots > MAX_DEPTH:
                message = f"a key of more than {MAX_DEPTH} parts"
                raise ScenarioError(Problem(f"{self.label}:{number}", message, "no scenario needs that"))

    def _parse(self) -> dict[str, Any]:
        try:
            data = tomllib.loads(self.text)
        except tomllib.TOMLDecodeError as error:
            raise ScenarioError(self._explain(str(error))) from None
        except RecursionError:
            raise ScenarioError(Problem(self.label, "nested too deeply", "no scenario needs that")) from None
        except ValueError as error:  # an integer of more digits than Python converts
            raise ScenarioError(Problem(self.label, str(error))) from None
        if _is_deeper(data, MAX_DEPTH):
            message = f"nested more than {MAX_DEPTH} levels deep"
            raise ScenarioError(Problem(self.label, message, "no scenario needs that"))
        return data

    def _explain(self, message: str) -> Problem:
        """A syntax error as `file:line: column n: what`, with the remedy for the mistake that is made most."""
        found = re.search(r" \(at line (\d+), column (\d+)\)$", message)
        if not found:
            what = message.removesuffix(" (at end of document)")
            return Problem(f"{self.label}:{len(self.text.splitlines()) or 1}", f"{what} at the end of the file")
        number = int(found[1])
        lines = self.text.split("\n")
        line = lines[number - 1] if number <= len(lines) else ""
        remedy = "a key stands once in its section" if message.startswith("Cannot overwrite") else ""
        if _UNQUOTED_INDEX.match(line):
            remedy = 'a key with [ ] stands in quotes: "train[1].speed" = ...'
        return Problem(f"{self.label}:{number}: column {found[2]}", message[: found.start()], remedy)


def _is_deeper(value: Any, levels: int) -> bool:
    """Whether tables and lists stand in each other more levels deep. Keys such as a.a.a... nest without brackets."""
    inner = value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
    return levels < 0 or any(_is_deeper(item, levels - 1) for item in inner)


def _huge_integers(value: Any, path: Path_) -> Iterator[Path_]:
    """Where integers stand that TOML does not promise and floating point cannot hold."""
    if isinstance(value, int) and not -(2**63) <= value < 2**63:
        yield path
    elif isinstance(value, dict | list):
        for key, inner in value.items() if isinstance(value, dict) else enumerate(value):
            yield from _huge_integers(inner, (*path, key))


def parse_value(text: str) -> Any:
    """What a text means as a TOML value; the text itself where it is none (`i > 1`)."""
    try:
        parsed = tomllib.loads(f"value = {text}")
    except (ValueError, RecursionError):
        return text
    if list(parsed) != ["value"] or _is_deeper(parsed, MAX_DEPTH) or any(_huge_integers(parsed, ())):
        return text
    return parsed["value"]


def _locate(text: str) -> dict[Path_, int]:
    """The line of every key and table of a text that is known to be TOML. Keys of inline tables are included."""
    lines: dict[Path_, int] = {}
    counts: dict[Path_, int] = {}
    table: Path_ = ()
    tokens = _tokens(text)
    for token, number in tokens:
        if token == "\n":
            continue
        if token == "[":
            header = list(_until(tokens, "\n"))
            words = [word for word, _ in header if word != "]"]
            repeated = words[0] == "["
            names = _key(words[1:] if repeated else words)
            table = _absolute(names[:-1] if repeated else names, counts)
            if repeated:
                array = (*table, names[-1])
                counts[array] = counts.get(array, -1) + 1
                table = (*array, counts[array])
                lines.setdefault(array, number)
            _mark(lines, table, number)
        else:
            path = (*table, *_key([token, *(word for word, _ in _until(tokens, "="))]))
            _mark(lines, path, number)
            _value(tokens, path, lines)
    return lines


def _tokens(text: str) -> Iterator[tuple[str, int]]:
    """Tokens with their line, without blanks and comments."""
    number = 1
    for match in _TOKEN.finditer(text.replace("\r\n", "\n")):
        token = match[0]
        if token == "\n" or not (token.isspace() or token.startswith("#")):
            yield token, number
        number += token.count("\n")


def _until(tokens: Iterator[tuple[str, int]], end: str) -> Iterator[tuple[str, int]]:
    for token, number in tokens:
        if token == end:
            return
        yield token, number


def _key(words: list[str]) -> Path_:
    return tuple(_unquoted(word) for word in words if word != ".")


def _unquoted(word: str) -> str:
    return str(tomllib.loads(f"x = {word}")["x"]) if word[:1] in "\"'" else word


def _absolute(names: Path_, counts: dict[Path_, int]) -> Path_:
    """A header's names with the number of the last element after each array of tables on the way."""
    path: Path_ = ()
    for name in names:
        path = (*path, name)
        if path in counts:
            path = (*path, counts[path])
    return path


def _mark(lines: dict[Path_, int], path: Path_, number: int) -> None:
    for length in range(1, len(path) + 1):
        lines.setdefault(path[:length], number)
    lines[path] = number


def _value(tokens: Iterator[tuple[str, int]], path: Path_, lines: dict[Path_, int]) -> None:
    """Skip a value; note the keys of inline tables on the way (but not of those inside lists)."""
    stack: list[str] = []
    prefixes: list[Path_] = []
    words: list[str] = []
    for token, number in tokens:
        in_table = bool(stack) and set(stack) == {"{"}
        if token == "\n":
            if not stack:
                return
        elif token in "[{":
            stack.append(token)
            prefixes.append(path)
            words = []
        elif token in "]}":
            stack.pop()
            path = prefixes.pop()
        elif token == "," and in_table:
            path, words = prefixes[-1], []
        elif token == "=" and in_table:
            path = (*prefixes[-1], *_key(words))
            _mark(lines, path, number)
        else:
            words.append(token)
