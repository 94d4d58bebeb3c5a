"""What `--json` prints, as a JSON Schema made from the declared documents, and tables of them for the site.

``python docs/json_page.py`` writes the schema to ``docs/reference/json_schema.json``, which is kept beside the code so
that a change of what other programs read is seen; a test holds that it is that of the code.
"""

from __future__ import annotations

import dataclasses
import inspect
import json
import types
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

from railcosim.orchestrator.cli.documents import DOCUMENTS, Document

SCHEMA = Path(__file__).parent / "reference" / "json_schema.json"
NUMBER = {"anyOf": [{"type": "number"}, {"enum": ["nan", "inf", "-inf"]}]}
"""JSON has no number that is not finite."""
_SIMPLE: dict[Any, dict[str, Any]] = {
    str: {"type": "string"},
    int: {"type": "integer"},
    bool: {"type": "boolean"},
    float: {"$ref": "#/$defs/Number"},
    type(None): {"type": "null"},
    Any: {},
    object: {},
}
_OWNERS: dict[str, Any] = {}


def schema() -> dict[str, Any]:
    """The JSON Schema of everything that a command prints with ``--json``."""
    definitions: dict[str, Any] = {"Number": NUMBER}
    results = {command: _schema(kind, definitions) for command, kind in DOCUMENTS.items()}
    _schema(Document, definitions)
    for command, result in results.items():
        only = {"command": {"const": command}, "result": {"anyOf": [result, {"type": "null"}]}}
        results[command] = {"allOf": [{"$ref": "#/$defs/Document"}, {"properties": only}]}
    failed = {"properties": {"error": {"type": "object"}, "result": {"type": "null"}}}  # of no command, or an unknown
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "What the commands of orchestrate print with --json",
        "anyOf": [*results.values(), {"allOf": [{"$ref": "#/$defs/Document"}, failed]}],
        "$defs": dict(sorted(definitions.items())),
    }


def _schema(kind: Any, definitions: dict[str, Any]) -> dict[str, Any]:
    """The schema of a type; those of dataclasses and named tuples are added to the definitions."""
    origin, arguments = get_origin(kind), get_args(kind)
    if dataclasses.is_dataclass(kind) or hasattr(kind, "_fields"):
        return _defined(kind, definitions)
    if origin is Literal:
        return {"enum": list(arguments)}
    if origin in (Union, types.UnionType):
        return {"anyOf": [_schema(each, definitions) for each in arguments]}
    if origin is tuple and Ellipsis not in arguments:
        return {"type": "array", "prefixItems": [_schema(each, definitions) for each in arguments]}
    if isinstance(origin, type):
        key = "additionalProperties" if issubclass(origin, Mapping) else "items"
        inside = _schema(arguments[1 if key == "additionalProperties" else 0], definitions)
        return {"type": "object" if key == "additionalProperties" else "array", key: inside}
    return _SIMPLE[kind]  # or say in the document what it is


def _defined(kind: Any, definitions: dict[str, Any]) -> dict[str, Any]:
    name, hints = kind.__name__, get_type_hints(kind)
    if _OWNERS.setdefault(name, kind) is not kind:
        raise TypeError(f"two documents have a part that is called {name}")
    if name not in definitions:
        definitions[name] = {}  # for those that contain themselves
        names = [each.name for each in dataclasses.fields(kind)] if dataclasses.is_dataclass(kind) else kind._fields
        definitions[name] = {
            "type": "object",
            "description": inspect.getdoc(kind),
            "properties": {field: _schema(hints[field], definitions) for field in names},
            "required": list(names),
        }
    return {"$ref": f"#/$defs/{name}"}


def tables() -> str:
    """What stands at the end of the page: every document with its fields."""
    whole = schema()
    definitions = whole["$defs"]
    lines = [*_object("Document", definitions, "What every command prints")]
    lines += ["", "## Results", "", "| command | result |", "| --- | --- |"]
    lines += [f"| `{command}` | {_text(_schema(kind, {}))} |" for command, kind in DOCUMENTS.items()]
    for name in definitions:
        if name not in ("Document", "Number"):
            lines += _object(name, definitions)
    return "\n".join(lines) + "\n"


def _object(name: str, definitions: Mapping[str, Any], title: str = "") -> Iterator[str]:
    found = definitions[name]
    yield f"\n## {title or name} {{ #{name.lower()} }}\n"
    first, _, rest = found["description"].partition("\n\nAttributes:\n")
    yield f"{first}\n"
    if rest:
        yield f"{' '.join(line.strip() for line in rest.splitlines())}\n"
    yield "| name | type |\n| --- | --- |"
    for field, kind in found["properties"].items():
        yield f"| `{field}` | {_text(kind)} |"


def _text(kind: Mapping[str, Any]) -> str:
    """A type in words."""
    if "$ref" in kind:
        name = kind["$ref"].rpartition("/")[2]
        return "number" if name == "Number" else f"[{name}](#{name.lower()})"
    if "enum" in kind:
        return ", ".join(f"`{json.dumps(each)}`" for each in kind["enum"])
    if "anyOf" in kind:
        return " or ".join(map(_text, kind["anyOf"]))
    if kind.get("type") == "array":
        parts = kind.get("prefixItems")
        return f"list of {', '.join(map(_text, parts)) if parts else _text(kind['items'])}"
    if kind.get("type") == "object":
        return f"object of {_text(kind['additionalProperties'])} by name"
    return str(kind.get("type", "any value"))


if __name__ == "__main__":
    SCHEMA.write_text(json.dumps(schema(), indent=1) + "\n", encoding="utf-8")
