"""The words that can stand for each argument and option. What cannot be read has none: completion is silent."""

from __future__ import annotations

import ast
import csv
import os
import shlex
from collections.abc import Iterable, Iterator
from itertools import islice
from pathlib import Path
from typing import Any

from ... import world

_DESIGNS = ("grid", "random", "latin-hypercube", "sobol", "saltelli")
_SCENARIOS = (".toml", ".ssp", ".ssd")
_PLATFORMS = ("all", "linux64", "win64", "darwin64", "aarch64-linux", "wasm")


def scenarios(incomplete: str) -> list[tuple[str, str]]:
    """Shipped scenarios with their titles, and files."""
    from ...scenario import shipped

    return [*shipped(), *((path, "") for path in _files(incomplete, *_SCENARIOS))]


def variants() -> list[str]:
    """Of the SSP on the command line."""
    from ...ssp import list_variants

    return [name for word in _typed() if word.endswith(_SCENARIOS[1:]) for name in list_variants(Path(word))]


def comparable(incomplete: str) -> list[tuple[str, str]]:
    """Scenarios, and files of results, by `run.RESULT_ENDINGS`."""
    endings = (".csv", ".h5", ".hdf5", ".mat", ".mtsf", ".parquet")
    return [*scenarios(incomplete), *((path, "") for path in _files(incomplete, *endings) if not path.endswith("/"))]


def cases(incomplete: str) -> list[tuple[str, str]]:
    """Shipped cases of driving with their titles, and files."""
    from ...driving import listed_cases

    shipped = [(case.name, case.title) for case in listed_cases()]
    return [*shipped, *((path, "") for path in _files(incomplete, ".toml"))]


def components(incomplete: str) -> list[str]:
    """Shipped components, and files with ones of one's own."""
    return [*_component_names(), *_files(incomplete, ".py")]


def models(incomplete: str) -> list[str]:
    """What a swap can put in: components and files."""
    return [*_component_names(), *_files(incomplete, ".fmu", ".py")]


def things(incomplete: str) -> list[tuple[str, str]]:
    """What can be described: models and scenarios."""
    return [*((name, "") for name in models(incomplete)), *scenarios(incomplete)]


def platforms(incomplete: str) -> list[str]:
    """Those of a native FMU; several are parted by commas."""
    done, comma, _ = incomplete.rpartition(",")
    return [f"{done}{comma}{name}" for name in _PLATFORMS if name not in done.split(",")]


def algorithms() -> list[tuple[str, str]]:
    """Of the master, with what they are."""
    from ...master import ALGORITHMS

    return [(name, algorithm.summary()) for name, algorithm in ALGORITHMS.items()]


def designs() -> list[str]:
    """Of studies."""
    return list(_DESIGNS)


def presets() -> list[tuple[str, str]]:
    """Of the scenario on the command line."""
    from ...scenario import presets_of

    return [(name, what) for _, data in _read() for name, what in presets_of(data).items()]


def metrics() -> list[str]:
    """Of the scenario on the command line."""
    return [name for _, data in _read() for name in data.get("metrics", {})]


def requirements() -> list[str]:
    """Of the scenario on the command line."""
    return [name for _, data in _read() for name in data.get("require", {})]


def instances(incomplete: str) -> list[str]:
    """Groups of instances of the scenario on the command line; one by one once a bracket is open."""
    return ["all", "together", "auto", *(name for _, name in _instances(incomplete))]


def swaps(incomplete: str) -> list[str]:
    """An instance, and the model that takes its place."""
    name, equals, model = incomplete.partition("=")
    if equals:
        return [f"{name}={each}" for each in models(model)]
    return [f"{each}=" for _, each in _instances(incomplete)]


def assignments(incomplete: str) -> list[str]:
    """What ``--set`` can set: parameters and start values, and settings of the simulation."""
    return [f"{name}=" for name in varied(incomplete)] if "=" not in incomplete else []


def varied(incomplete: str) -> list[str]:
    """The same without a value."""
    simulation = ("seed", "step", "stop_time", "algorithm")
    names = _variables(incomplete, ("parameter", "state", "input"))
    return [*names, *(f"simulation.{each}" for each in simulation)]


def signals(incomplete: str) -> list[str]:
    """What a run records: outputs and states."""
    return list(_variables(incomplete, ("output", "state")))


def run_signals() -> list[str]:
    """What the run on the command line has recorded."""
    for word in _typed():
        place = Path(word).parent if word.endswith((".csv", ".json")) else Path(word)
        try:
            with world.open(place / "results.csv", encoding="utf-8") as stream:
                return [name for name in next(csv.reader(islice(stream, 1)), []) if name != "time"]
        except (OSError, ValueError):
            continue
    return []


# ---------------------------------------------------------------- from files


def _component_names() -> list[str]:
    """The catalogue's, from its file: to import it would take most of the time that a completion may."""
    from .... import components

    text = world.read_text(Path(str(components.__file__)).with_name("catalogue.py"), encoding="utf-8")
    lists = (node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Tuple))
    return [each.id for each in max(lists, key=lambda node: len(node.elts)).elts if isinstance(each, ast.Name)]


def _files(incomplete: str, *endings: str) -> Iterator[str]:
    """Files below what is typed, with folders to go on with."""
    folder = Path(incomplete).parent if not incomplete.endswith("/") else Path(incomplete)
    for path in sorted(world.glob(folder, "*")):
        if path.suffix in endings:
            yield str(path)
        elif path.is_dir() and not path.name.startswith("."):
            yield f"{path}/"


def _typed() -> list[str]:
    """The words of the command line; the parser loses them where the last one is an option without its value."""
    text = os.environ.get("_TYPER_COMPLETE_ARGS") or os.environ.get("COMP_WORDS", "")
    try:
        return shlex.split(text)
    except ValueError:  # a quote is open
        return text.split()


def _read() -> Iterator[tuple[Path, dict[str, Any]]]:
    """The files of the scenarios on the command line, and what they hold."""
    from ...scenario import raw

    return filter(None, map(raw, _typed()))


def _instances(incomplete: str) -> Iterator[tuple[tuple[Path, dict[str, Any]], str]]:
    """Each group of a scenario with a name: the group's own, or those of its members once a bracket is open."""
    group, bracket, _ = incomplete.partition("[")
    for path, data in _read():
        for name, table in data.get("instances", {}).items():
            count = table.get("count", 1) if isinstance(table, dict) else 1
            if not bracket:
                yield (path, table), name
            elif name == group and isinstance(count, int):
                yield from (((path, table), f"{name}[{k}]") for k in (":", *range(1, min(count, 1000) + 1)))


def _variables(incomplete: str, sorts: Iterable[str]) -> Iterator[str]:
    from .models import variables_of

    for (path, table), name in _instances(incomplete.partition(".")[0]):
        if isinstance(table, dict) and name.startswith(incomplete.partition(".")[0]):
            yield from (f"{name}.{each}" for each in variables_of(path.parent, table, sorts))
