"""`Answer`: what a command has found. It is data, with two renderings: lines for people, and one JSON document."""

from __future__ import annotations

import functools
import inspect
import signal
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import takewhile
from typing import Annotated, Any, get_type_hints

import typer

from ...errors import FmuError, RailcosimError, RunError, ScenarioError
from ..lines import folded, tell
from ..options import FMU_FAILED, OK, WRONG_INPUT, interrupted
from ..streams import aside

_FLAG = "--json"
Json = Annotated[
    bool,
    typer.Option(_FLAG, help="Print one JSON document (docs/reference/json.md) and nothing else; the rest on stderr."),
]


@dataclass(frozen=True)
class Answer:
    """What a command has found.

    Attributes:
        document: makes the document, of the type that `DOCUMENTS` has for the command.
        show: prints the same for people.
        code: the exit code. error: what ended a run before its time, where something did.
    """

    document: Callable[[], object]
    show: Callable[[], object]
    code: int = OK
    error: Exception | None = None


@dataclass(frozen=True)
class _Failed:
    """What is said of an error: lines, and what they are made of."""

    lines: list[str]
    code: int
    facts: dict[str, Any] = field(default_factory=dict)


def answering(command: Callable[..., Answer], name: str = "") -> Callable[..., None]:
    """A command that takes ``--json`` as well, and prints its answer as it is asked for.

    Args:
        command: the function.
        name: of the command, if not the function's.
    """
    name = name or command.__name__

    @functools.wraps(command)
    def answered(*, as_json: bool = False, **given: Any) -> None:
        if not as_json:
            answer = command(**given)
            answer.show()
            if answer.error is not None:
                raise answer.error
            raise typer.Exit(answer.code)
        try:
            with aside():
                answer = command(**given)
                document = answer.document()
        except (typer.Exit, KeyboardInterrupt) as end:  # a signal, before there is anything to tell
            code = end.exit_code if isinstance(end, typer.Exit) else interrupted(signal.SIGINT)
            _print(name, code, _Failed(["interrupted"], code), None)
            raise typer.Exit(code) from None
        told = failed(answer.error) if answer.error is not None else None
        for line in told.lines if told else ():
            tell(f"error: {line}")
        _print(name, told.code if told else answer.code, told, document)
        raise typer.Exit(told.code if told else answer.code)

    signature, hints = inspect.signature(command), get_type_hints(command, include_extras=True)
    added = inspect.Parameter("as_json", inspect.Parameter.KEYWORD_ONLY, default=False, annotation=Json)
    parameters = [each.replace(annotation=hints[key]) for key, each in signature.parameters.items()]
    answered.__signature__ = signature.replace(parameters=[*parameters, added])  # type: ignore[attr-defined]
    answered.__annotations__ = hints | {"as_json": Json, "return": None}
    return answered


def failed(error: Exception) -> _Failed:
    """What is said of an error that is expected, and the exit code that goes with it."""
    if isinstance(error, RunError):
        what = "an FMU" if isinstance(error, FmuError) else "the run"
        of_fmu = {"instance": error.instance, "time": error.time} if isinstance(error, FmuError) else {}
        return _Failed([f"{what} failed: {error}"], FMU_FAILED, of_fmu)
    if isinstance(error, ScenarioError):
        return _Failed(folded(error.problems), WRONG_INPUT, {"problems": error.problems})
    if isinstance(error, OSError) and not isinstance(error, RailcosimError):
        return _Failed([f"{error.filename or 'a file'}: {error.strerror or error}"], WRONG_INPUT)
    return _Failed([str(error)], WRONG_INPUT)


def fail(told: _Failed | Sequence[str], code: int = WRONG_INPUT, arguments: Sequence[str] | None = None) -> int:
    """Say what went wrong, and nothing else was said: on stderr; with ``--json`` as a document as well.

    Args:
        told: what `failed` gives, or lines.
        code: the exit code of lines.
        arguments: of the command line, where a document may be wanted.

    Returns:
        The exit code.
    """
    what = told if isinstance(told, _Failed) else _Failed(list(told), code)
    for line in what.lines:
        tell(f"error: {line}")
    if arguments is not None and wants_json(arguments):
        _print(next((word for word in arguments if not word.startswith("-")), ""), what.code, what, None)
    return what.code


def wants_json(arguments: Sequence[str]) -> bool:
    """Whether a command line asks for a document, even one that cannot be read."""
    return _FLAG in takewhile(lambda word: word != "--", arguments)


def _print(command: str, code: int, told: _Failed | None, result: object) -> None:
    from .envelope import Document, Failure, Mistake
    from .plain import text_of

    failure = None
    if told is not None:
        facts = {**told.facts}
        problems = [Mistake(one.place, one.message, one.remedy) for one in facts.pop("problems", ())]
        failure = Failure("\n".join(told.lines), problems, **facts)
    print(text_of(Document(command, code, failure, result)), flush=True)
