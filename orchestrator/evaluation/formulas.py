"""The text of an expression read: Python's grammar, and the words of logic over time, which that does not have.

A word such as `always` takes everything to its right, up to the end of the brackets it stands in. A formula with such a
word is read first and leaves a hole in the text around it, which Python's parser reads then.
"""

import re
from collections.abc import Iterator
from typing import NamedTuple

from ..errors import ExpressionError
from ..problems import Problem
from .syntax import CHANGES, HOLE, MAX_DEPTH, MAX_LENGTH, Group, Node, Operation, Reader, Temporal

PREFIXES = ("always", "eventually", "historically", "once")
BETWEEN = ("until", "since")
_IMPLIES = "implies"
_BRACKETS = {"(": ")", "[": "]", "{": "}"}
_TOKEN = re.compile(r"\"[^\"]*\"|'[^']*'|->|[\w.]+|\S")
_AMBIGUOUS = ("and", "or", "if", "else", "not")


class Token(NamedTuple):
    """A piece of a text, and where it stands."""

    text: str
    start: int
    end: int


def read(text: str) -> tuple[str, Node]:
    """The text as it will be shown, and its tree.

    Raises:
        ExpressionError: for anything that is not an expression of this language, with the column and the remedy.
    """
    text = re.sub(r"\s", " ", text).strip()
    if not text:
        remedy = "write a signal or a formula, such as train[1].speed"
        raise ExpressionError(Problem("", "an expression is empty", remedy))
    if len(text) > MAX_LENGTH:
        message = f"longer than {MAX_LENGTH} characters"
        raise ExpressionError(Problem(f"'{text[:40]}...'", message, "split the expression"))
    try:
        formulas = _Formulas(text)
        return text, formulas.read(0, len(formulas.tokens), 0)
    except ExpressionError:
        raise
    except (RecursionError, MemoryError):
        raise ExpressionError(Problem(f"'{text}'", "nested too deeply", "split the expression")) from None
    except (ValueError, OverflowError) as error:
        raise ExpressionError(Problem(f"'{text}'", str(error), "write plain names and numbers")) from None


def tokens_of(text: str) -> list[Token]:
    """The pieces of a text; a quoted name is one."""
    return [Token(match[0], match.start(), match.end()) for match in _TOKEN.finditer(text)]


def says_when(text: str) -> bool:
    """Whether some word of logic over time stands in a text."""
    formulas = _Formulas(text)
    return any(formulas.word(k) not in ("", _IMPLIES) or formulas.changes(k) for k in range(len(formulas.tokens)))


class _Formulas:
    """Reads one text from its tokens; `first` and `last` are the numbers of such, the last one excluded."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.tokens = tokens_of(text)
        self.closing = self._closing()

    def _closing(self) -> dict[int, int]:
        """Where each bracket is closed. If one is not, Python's parser will tell."""
        closing: dict[int, int] = {}
        open_: list[int] = []
        for k, token in enumerate(self.tokens):
            if token.text in _BRACKETS:
                open_.append(k)
            elif open_ and token.text == _BRACKETS[self.tokens[open_[-1]].text]:
                closing[open_.pop()] = k
        return closing

    def error(self, k: int, message: str, remedy: str) -> ExpressionError:
        start = self.tokens[k].start if k < len(self.tokens) else len(self.text)
        return ExpressionError(Problem(f"'{self.text}', column {start + 1}", message, remedy))

    def at(self, k: int) -> str:
        return self.tokens[k].text if 0 <= k < len(self.tokens) else ""

    def word(self, k: int) -> str:
        """The word of logic that a token is; nothing if it is a name or the name of an argument."""
        text = self.at(k)
        if text == "->":
            return text
        if text not in (*PREFIXES, *BETWEEN, _IMPLIES) or self.at(k - 1).endswith(".") or self.at(k + 1)[:1] == ".":
            return ""
        if self.at(k + 1) == "=" and self.at(k + 2) != "=":
            return ""
        after = self.closing.get(k + 1, -2) + 1 if self.at(k + 1) == "[" else -1
        return "" if self.at(after)[:1] in (".", "[") and after > 0 else text

    def changes(self, k: int) -> bool:
        """Whether a token is the name of `rise` or `fall`, called."""
        return self.at(k) in CHANGES and self.at(k + 1) == "("

    def level(self, first: int, last: int) -> Iterator[int]:
        """The tokens outside brackets, with those that open one."""
        k = first
        while k < last:
            yield k
            k = self.closing.get(k, k) + 1

    def has_words(self, first: int, last: int) -> bool:
        return any(self.word(k) for k in range(first, last))

    def read(self, first: int, last: int, depth: int) -> Node:
        if depth > MAX_DEPTH:
            raise self.error(first, f"nested more than {MAX_DEPTH} levels deep", "split the expression")
        if first >= last:
            raise self.error(first, "a condition is missing", "write one, as in always[0, 70] (train[1].speed > 20)")
        words = [k for k in self.level(first, last) if self.word(k)]
        prefix = next((k for k in words if self.word(k) in PREFIXES), last)
        before = [k for k in words if k < prefix]
        for k in before:
            if self.word(k) == "->":
                raise self.error(k, "'->' is not understood", "write 'implies'")
        implies = next((k for k in before if self.word(k) == _IMPLIES), None)
        if implies is not None:
            reason, follows = self.read(first, implies, depth + 1), self.read(implies + 1, last, depth + 1)
            return Operation("or", (Operation("not", (reason,)), follows))
        if before:
            return self.between(before, first, prefix, last, depth)
        if prefix == first:
            return self.prefixed(first, last, depth)
        return self.plain(first, prefix, last, depth)

    def between(self, words: list[int], first: int, prefix: int, last: int, depth: int) -> Node:
        k, word = words[0], self.word(words[0])
        interval, after = self.interval(k)
        mixed = any(
            self.at(j) in _AMBIGUOUS and not (self.at(j) == "not" and j == after) for j in self.level(first, prefix)
        )
        if len(words) > 1 or mixed:
            message = f"what '{word}' stands between can be read in two ways"
            raise self.error(k, message, f"put it in brackets, as in (a and b) {word}[0, 5] (c or d)")
        if interval is None and word == "until":
            remedy = "write until[0, inf] (...); the last time of a requirement stands behind its condition"
            raise self.error(k, "'until' needs its interval", remedy)
        operands = self.read(first, k, depth + 1), self.read(after, last, depth + 1)
        return Temporal(word, operands, interval, self.tokens[k].start + 1)

    def prefixed(self, first: int, last: int, depth: int) -> Node:
        interval, after = self.interval(first)
        follows = self.closing.get(after, last) + 1 if self.at(after) == "(" else last
        if follows < last and (self.at(follows) in ("and", "or", "if") or self.word(follows)):
            word = self.text[self.tokens[first].start : self.tokens[after].start].strip()
            remedy = f"write ({word} (...)) {self.at(follows)} ..., or {word} ((...) {self.at(follows)} ...)"
            raise self.error(first, f"how far '{word}' reaches can be read in two ways", remedy)
        operand = self.read(after, last, depth + 1)
        return Temporal(self.at(first), (operand,), interval, self.tokens[first].start + 1)

    def interval(self, k: int) -> tuple[tuple[Node, Node] | None, int]:
        """The interval behind a word, if it has one, and the token behind that."""
        if self.at(k + 1) != "[" or k + 1 not in self.closing:
            return None, k + 1
        start, end = self.tokens[k + 1].start, self.tokens[self.closing[k + 1]].end
        reader = Reader(self.text, self.text[start:end], start)
        group = reader.argument(reader.tree(), 0)
        if not isinstance(group, Group) or len(group.items) != 2 or any(isinstance(x, Group) for x in group.items):
            word = self.at(k)
            written = self.text[self.tokens[k].start : end]
            remedy = f"write its first and its last time in s, as in {word}[0, 30] or {word}[10, inf]"
            raise self.error(k, f"'{written}' has no interval", remedy)
        return (group.items[0], group.items[1]), self.closing[k + 1] + 1

    def plain(self, first: int, prefix: int, last: int, depth: int) -> Node:
        """What Python's parser can read, once the formulas in it are."""
        begin, end = self.tokens[first].start, self.tokens[last - 1].end
        source, holes = self.text[begin:end], dict[int, Node]()
        for start, stop in self.formulas(first, prefix, last):
            a, b = self.tokens[start].start, self.tokens[stop - 1].end
            holes[a + 1] = self.read(start, stop, depth + 1)
            source = source[: a - begin] + HOLE.ljust(b - a) + source[b - begin :]
        reader = Reader(self.text, source, begin, holes)
        return reader.read(reader.tree(), depth)

    def formulas(self, first: int, prefix: int, last: int) -> Iterator[tuple[int, int]]:
        """The formulas in brackets, and the one at the end."""
        for k in self.level(first, prefix):
            close = self.closing.get(k, k)
            if close > k + 1 and self.at(k) == "(" and self.has_words(k + 1, close):
                commas = [j for j in self.level(k + 1, close) if self.at(j) == ","]
                for a, b in zip([k, *commas], [*commas, close], strict=True):
                    if self.has_words(a + 1, b):
                        yield a + 1, b
        if prefix < last:
            yield prefix, last
