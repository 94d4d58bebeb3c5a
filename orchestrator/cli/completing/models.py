"""The variables of a model by their kind, read from what describes it; Python code of a user's is not executed."""

from __future__ import annotations

import ast
import html
import re
import zipfile
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from ... import world

_SORTS = {"Parameter": "parameter", "State": "state", "Input": "input", "Output": "output"}
_RUNTIME = {
    "sample_time": "Memory Tape Noise",
    "max_step": "State",
    "seed": "Noise",
    **dict.fromkeys(("tape_file", "tape_duration", "tape_cutoff"), "Tape"),
}
"""The parameters that the runtime adds, and to what."""
_LARGEST = 20_000_000
"""Bytes of a model description that are looked at: of more, nobody reads a list of names."""
_VARIABLE = re.compile(r"<(?:ScalarVariable|Float64|Float32|U?Int\d+|Boolean|String|Enumeration)\s([^>]*\bname=[^>]*)>")
_ATTRIBUTE = re.compile(r'\b(name|causality)\s*=\s*"([^"]*)"')


def variables_of(folder: Path, table: Mapping[str, Any], sorts: Iterable[str]) -> list[str]:
    """The variables of the model that an instance is of.

    Args:
        folder: of the scenario.
        table: of the instance, as it is written.
        sorts: some of ``"parameter"``, ``"state"``, ``"input"``, ``"output"``.
    """
    model, wanted = str(table.get("component") or table.get("fmu") or ""), set(sorts)
    if model.endswith(".fmu"):
        found = dict(_of_fmu(folder / model))
    else:
        file, _, name = model.rpartition(":")
        found = _of_class(folder / file, name) if file else _of_component(name)
    return [name for name, sort in found.items() if sort in wanted]


def _of_component(name: str) -> dict[str, str]:
    """What a class of ours declares, read from its file: to import NumPy takes longer than a completion may."""
    return _of_class(*_home(name))


def _home(name: str) -> tuple[Path, str]:
    """The file of a class that the door of `components` offers, and its name there."""
    from .... import components

    home, inside = vars(components)["homes"].get(name, (".none", name))
    return _module(Path(str(components.__file__)), home), inside


def _of_class(path: Path, name: str) -> dict[str, str]:
    """What a class in a file declares with its bases, and what the runtime adds to that."""
    found = _declared(path, name)
    kinds = set(found.values())
    found |= {each: "Parameter" if kinds & {*of.split()} else "" for each, of in _RUNTIME.items()}
    return {each: _SORTS[kind] for each, kind in found.items() if kind in _SORTS}


def _declared(path: Path, name: str) -> dict[str, str]:
    """The kind of each declaration of a class, its bases' first."""
    try:
        body = ast.parse(world.read_text(path, encoding="utf-8")).body
    except (OSError, ValueError, SyntaxError, RecursionError):  # the latter: classes that are each other's bases
        return {}
    elsewhere = {
        alias.asname or alias.name: (_module(path, "." * node.level + (node.module or "")), alias.name)
        for node in body
        if isinstance(node, ast.ImportFrom) and node.level
        for alias in node.names
    }
    found: dict[str, str] = {}
    classes = {each.name for each in body if isinstance(each, ast.ClassDef)} - {name}
    for made in (each for each in body if isinstance(each, ast.ClassDef) and each.name == name):
        for base in (each.id for each in reversed(made.bases) if isinstance(each, ast.Name) and each.id != "Component"):
            if base in elsewhere or base in classes:
                found |= _declared(*elsewhere.get(base, (path, base)))
            else:  # imported from railcosim.components
                found |= _declared(*_home(base))
        for line in made.body:
            if isinstance(line, ast.Assign) and isinstance(line.value, ast.Call):
                kind = getattr(line.value.func, "id", "")
                found |= {target.id: kind for target in line.targets if isinstance(target, ast.Name)}
    return found


def _module(path: Path, name: str) -> Path:
    """The file of a module as a file imports it, with dots before its name."""
    level = len(name) - len(name.lstrip("."))
    folder = path.parents[level - 1]
    return folder.joinpath(*name.lstrip(".").split(".")).with_suffix(".py")


def _of_fmu(path: Path) -> Iterator[tuple[str, str]]:
    try:
        with world.open(path, "rb") as stream, zipfile.ZipFile(stream) as archive:
            member = archive.getinfo("modelDescription.xml")
            text = archive.read(member).decode("utf-8", "replace") if member.file_size < _LARGEST else ""
    except (OSError, ValueError, KeyError, zipfile.BadZipFile, NotImplementedError, RuntimeError):
        return
    for found in _VARIABLE.finditer(text):
        facts = dict(_ATTRIBUTE.findall(found[1]))
        yield html.unescape(facts.get("name", "")), facts.get("causality", "local")
