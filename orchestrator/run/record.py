"""The record of a run: ``run.json``, ``metrics.json`` and ``units.json`` beside the results."""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import importlib.metadata
import json
import math
import platform
import shlex
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Any

import orjson

from .. import world
from ..errors import ScenarioError, naming
from ..evaluation import count_values
from ..figures import remove_drawn
from ..isolation import is_isolated
from ..master import ALGORITHMS
from ..system import System
from .checking import Checked
from .checkpoint import CHECKPOINT_FILE
from .directory import RunDirectory
from .outcome import Run
from .recording import CSV_FILE, ROWS_FILE, SEEN_FILE, read_json, remove_rows
from .step_check import StepCheck

_PACKAGES = ("railcosim", "fmpy", "pythonfmu", "numpy", "scipy")
_version = functools.cache(importlib.metadata.version)  # which reads a file of 20 kB each time


def write(place: RunDirectory, checked: Checked, kind: str, *, anew: bool = True) -> None:
    """Write what is known before the first step, so that a run that is killed can be read.

    Args:
        place: where.
        checked: what runs.
        kind: as which kind of model.
        anew: whether what an earlier run left there goes, so that it is not taken for this one's.
    """
    directory = place.path
    if anew:
        remove_drawn(directory / "run.json")
        for name in (CSV_FILE, "metrics.json", CHECKPOINT_FILE):
            world.unlink(directory / name, missing_ok=True)
        for name in (ROWS_FILE, SEEN_FILE):
            remove_rows(directory / name)
    _dump(directory / "run.json", place.marks | _describe(checked.system, checked, kind) | {"status": "running"})
    _dump(directory / "units.json", {"time": "s"} | checked.units)


def identity_of(checked: Checked, kind: str) -> str:
    """A digest of all that rows follow from, but for their number: runs that share it have the same rows."""
    told = _describe(checked.system, checked, kind)
    for key in ("stop_time", "modified", "command"):
        del told[key]
    text = json.dumps(_plain(told), sort_keys=True)
    return hashlib.sha256(text.encode(errors="surrogatepass")).hexdigest()[:32]


def abandon(directory: Path, error: BaseException) -> None:
    """Let the record of a run that never began not say "running" for ever."""
    add(directory, status="failed", error=str(error))


def finish(place: RunDirectory, outcome: Run, kind: str, rows: Sequence[int], *, resumed: float | None = None) -> None:
    """Write the end of the run, and what was evaluated.

    Args:
        place: where.
        outcome: the run.
        kind: as which kind of model.
        rows: how many results there are, and their checksum, which tells whether they are this run's own.
        resumed: the time in s of the checkpoint from which it went on, if it did.
    """
    directory = place.path
    record = place.marks | _describe(outcome.system, outcome.checked, kind)
    record["rows"] = dict(zip(("count", "crc32"), rows, strict=True))
    record["status"] = outcome.status
    record["error"] = None if outcome.error is None else str(outcome.error)
    record["resumed"] = resumed
    record["time_reached"] = outcome.time_reached
    record["seconds"] = outcome.seconds
    record["coupling"] = outcome.coupling
    record["notes"] += outcome.notes
    record["findings"] = [dataclasses.asdict(finding) for finding in outcome.findings]
    record["values"] = count_values([*outcome.published, *outcome.references])
    _dump(directory / "run.json", record)
    _dump(
        directory / "metrics.json",
        {
            "run": place.identity,
            "scenario": outcome.system.provenance.name,
            "preset": outcome.system.provenance.preset,
            "modified": outcome.system.provenance.modified,
            "status": outcome.status,
            "metrics": {
                m.name: {
                    "values": {"" if i is None else str(i): v for i, v in m.values.items()},
                    "unit": m.unit,
                    "expression": m.expression,
                    "problem": m.problem,
                }
                for m in outcome.metrics
            },
            "requirements": [dataclasses.asdict(verdict) for verdict in outcome.requirements],
            "published": [dataclasses.asdict(row) for row in outcome.published],
            "references": [dataclasses.asdict(row) for row in outcome.references],
        },
    )


def read(directory: Path) -> dict[str, Any]:
    """The record of a run.

    Raises:
        ScenarioError: there is none that can be read.
    """
    try:
        record = read_json(directory / "run.json")
        return {"texts": record["texts"], **record}
    except (OSError, ValueError, LookupError, TypeError, RecursionError) as error:
        raise ScenarioError(f"{directory} holds no run that can be read: {error}") from error


def read_metrics(directory: Path) -> dict[str, Any]:
    """What was evaluated of a run; nothing of one that has not come that far.

    Raises:
        ScenarioError: it is there and cannot be read.
    """
    path = directory / "metrics.json"
    if not path.exists():
        return {}
    try:
        found = read_json(path)
        return {**found, "metrics": {**found["metrics"]}}
    except (OSError, ValueError, LookupError, TypeError) as error:
        raise ScenarioError(f"{path} cannot be read: {error}") from error


def add(directory: Path, **entries: Any) -> None:
    """Add to the record of a run that has ended."""
    path = directory / "run.json"
    _dump(path, read_json(path) | entries)


def add_step_check(directory: Path, found: StepCheck) -> None:
    """Add what a second run at half the step showed."""
    add(directory, step_check=dataclasses.asdict(found))


def _describe(system: System, checked: Checked, kind: str) -> dict[str, Any]:
    starts, in_order = checked.wiring.starts, ALGORITHMS[system.stepping.algorithm].in_order
    return {
        "scenario": system.provenance.name,
        "path": system.provenance.path,
        "title": system.provenance.title,
        "preset": system.provenance.preset,
        "modified": system.provenance.modified,
        "command": _command(system, kind),
        "start_time": system.stepping.start_time,
        "stop_time": system.stepping.stop_time,
        "step": system.stepping.step,
        "record": system.stepping.record or system.stepping.step,
        "seed": system.seed,
        "algorithm": system.stepping.algorithm,
        "order": list(checked.order.sequence) if in_order else None,
        "late": list(checked.order.late) if in_order else None,
        "extrapolation": system.stepping.extrapolation,
        "algebraic_loops": system.stepping.algebraic_loops,
        "refresh": system.stepping.refresh,
        "unsettled": system.stepping.unsettled,
        "steps": {name: instance.step for name, instance in system.instances.items() if instance.step is not None},
        "events": [dataclasses.asdict(event) for event in system.events],
        "delays": {c.target: c.delay for c in system.connections if c.delay},
        "kind": kind,
        "notes": list(checked.notes),
        "versions": {package: _version(package) for package in _PACKAGES},
        "python": platform.python_version(),
        "platform": platform.platform(),
        "instances": {
            name: {
                "model": system.instances[name].model,
                "build": system.instances[name].build,
                "kind": model.kind,
                "isolated": is_isolated(model, system.instances[name]),
                "digest": model.digest,
                "guid": model.interface.guid,
                "generator": model.interface.generator,
                "start": starts[name],
            }
            for name, model in checked.models.items()
        },
        "connections": [dataclasses.asdict(connection) for connection in system.connections],
        "units": checked.units,
        "texts": _texts(checked),
        "stepwise": _stepwise(checked),
        "parameters": checked.wiring.left
        | {
            f"{name}.{v.name}": starts[name].get(v.name, v.start)
            for name, model in checked.models.items()
            for v in model.interface.of("parameter")
        },
        "requirements": system.judged.requirements,
        "metrics": system.judged.metrics,
        "published": system.judged.published,
        "references": system.judged.references,
        "figures_wanted": system.judged.figures,
        "scenario_text": system.provenance.text,
    }


def _texts(checked: Checked) -> list[str]:
    """Signals that are texts, even where every text looks like a number."""
    return [
        f"{name}.{v.name}"
        for name, model in checked.models.items()
        for v in model.interface.variables.values()
        if v.type == "String"
    ]


def _stepwise(checked: Checked) -> list[str]:
    """Signals that hold between the points at which they change: all but continuous ones."""
    return [
        f"{name}.{v.name}"
        for name, model in checked.models.items()
        for v in model.interface.of("output")
        if v.type != "Real" or v.variability == "discrete"
    ]


def _command(system: System, kind: str) -> str | None:
    """What runs the same again, as a shell takes it; None of a system that Python made."""
    words = system.provenance.command
    return shlex.join(["orchestrate", "run", *words, *([] if kind == "auto" else ["--kind", kind])]) if words else None


def _dump(path: Path, content: dict[str, Any]) -> None:
    part = path.with_name(path.name + ".part")
    text = _text_of(_plain(content))
    with naming(part):
        world.write_bytes(part, text)
    world.replace(part, path)


def _text_of(content: Any) -> bytes:
    try:
        return orjson.dumps(content, option=orjson.OPT_INDENT_2 | orjson.OPT_APPEND_NEWLINE)
    except TypeError:  # numbers of more than 64 bits, and what stands for the bytes of a file name that is not UTF-8
        return f"{json.dumps(content, indent=2, ensure_ascii=False)}\n".encode(errors="backslashreplace")


def _plain(value: Any) -> Any:
    """JSON has no infinity, no NaN and no dates: they become text."""
    if isinstance(value, dict):
        return value if _is_plain(value.values()) else {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple | set | frozenset):
        return value if _is_plain(value) else [_plain(v) for v in value]
    if hasattr(value, "item") and not isinstance(value, str):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return repr(value)
    return value if value is None or isinstance(value, str | int | float) else str(value)


def _is_plain(values: Collection[Any]) -> bool:
    """Whether JSON has all of them: of a million variables each is not looked at again."""
    kinds = set(map(type, values))
    if not kinds <= _KINDS or isinstance(values, set | frozenset):
        return False
    return float not in kinds or all(math.isfinite(value) for value in values if type(value) is float)


_KINDS = {str, int, float, bool, type(None)}
