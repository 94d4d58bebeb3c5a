"""Checkpoints: everything a run needs to go on, to the bit, in one file beside its results.

`checkpoint.zip` holds `checkpoint.json` (the system, how far it got, the values under way) and each FMU's serialized
state. It is replaced as a whole, so that there is always a complete one.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import math
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...fmus.references import file_and_class
from .. import world
from ..errors import RailcosimError, ScenarioError
from ..fmi import Kind, Model
from ..master import Master
from ..system import Connection, Event, Instance, Judged, Provenance, Stepping, System
from .recording import check_size

CHECKPOINT_FILE = "checkpoint.zip"
_FORMAT = 5


@dataclass(frozen=True)
class Checkpoint:
    """A point at which a run can be taken up.

    Attributes:
        system: what is simulated. kind: how components became models.
        marks: how many rows each file of the recording had, and their checksum.
        digests: of the models, by instance.
        progress: what the master carries between steps, from `Master.save`.
        states: the FMUs' serialized states, by instance.
        every: distance of checkpoints in s.
        run: the identity of the run.
        seen: what was found on the way, from `Watching.save`.
    """

    system: System
    kind: Kind
    marks: list[list[int]]
    digests: Mapping[str, str]
    progress: Mapping[str, Any]
    states: Mapping[str, bytes]
    every: float | None
    seen: Any
    run: str

    @property
    def time(self) -> float:
        """How far the run had got, in s."""
        return float(self.progress["time"])

    @property
    def rows(self) -> int:
        """How many results there were."""
        return self.marks[0][0]

    @classmethod
    def take(
        cls,
        system: System,
        models: Mapping[str, Model],
        master: Master,
        *,
        kind: Kind,
        marks: list[list[int]],
        every: float | None,
        seen: Any,
        run: str,
    ) -> Checkpoint:
        """That of a master between two steps.

        Raises:
            FmuError: an FMU does not give its state.
        """
        states = {}
        for name, slave in master.slaves.items():
            state = slave.save()
            try:
                states[name] = slave.serialize(state)
            finally:
                slave.forget(state)
        digests = {name: model.digest for name, model in models.items()}
        return cls(system, kind, marks, digests, master.save(), states, every, seen, run)

    def write(self, directory: Path) -> None:
        """Put it in the place of the one before.

        Raises:
            RailcosimError: the file cannot be written.
        """
        content = {
            "format": _FORMAT,
            "run": self.run,
            "system": dataclasses.asdict(self.system),
            "kind": self.kind,
            "marks": self.marks,
            "every": self.every,
            "digests": self.digests,
            "progress": self.progress,
            "seen": self.seen,
        }
        part = directory / f"{CHECKPOINT_FILE}.part"
        try:
            with world.open(part, "wb") as stream:
                with zipfile.ZipFile(stream, "w") as archive:
                    archive.writestr("checkpoint.json", json.dumps(content, default=_plain))
                    for number, name in enumerate(self.digests):
                        archive.writestr(f"states/{number}", self.states[name])
                stream.flush()
                world.fsync(stream.fileno())
            world.replace(part, directory / CHECKPOINT_FILE)
        except OSError as error:
            raise RailcosimError(f"{part} cannot be written: {error.strerror or error}") from error

    def restore(self, master: Master) -> None:
        """Bring an initialized master to this point.

        Raises:
            FmuError: an FMU does not take its state back.
            ScenarioError: it is of another system.
        """
        for name, slave in master.slaves.items():
            state = slave.deserialize(self.states[name])
            slave.restore(state)
            slave.forget(state)
        try:
            master.restore(self.progress)
        except (LookupError, TypeError, ValueError) as error:
            what = f"{type(error).__name__}: {error}"
            raise ScenarioError(
                f"{CHECKPOINT_FILE} does not fit its system ({what}); run the scenario from the start"
            ) from error

    def check_code(self, directory: Path, scenario: System | None, *, trust: bool) -> None:
        """Refuse to import Python code that nobody names but the checkpoint.

        Args:
            directory: of the run.
            scenario: the scenario of the run, read anew, as options change it; None where none is given.
            trust: whether such code may be imported all the same.

        Raises:
            ScenarioError: it is another scenario, or there is other code than it names.
        """
        named = {} if scenario is None else {instance.model: None for instance in scenario.instances.values()}
        if scenario is not None:
            texts = (self.system.provenance.text, scenario.provenance.text)
            was, given = (hashlib.sha256(text.encode(errors="surrogatepass")).hexdigest() for text in texts)
            if was != given:
                raise ScenarioError(
                    f"{directory} cannot be resumed: it is no run of {scenario.provenance.path} as that is now "
                    f"(SHA-256 {given[:12]}..., not {was[:12]}...)"
                )
        strange = {
            instance.model: f"{instance.model} ({name})"
            for name, instance in reversed(self.system.instances.items())
            if file_and_class(instance.model)[0] and instance.model not in named
        }
        if strange and not trust:
            code = ", ".join(reversed(strange.values()))
            raise ScenarioError(
                f"{directory} is not resumed: its checkpoint alone names Python code that would be imported: {code}; "
                f"name the scenario of the run ({self.system.provenance.path or 'none'}) with the --swap it had, or "
                "read that code and --trust it"
            )

    def check(self, models: Mapping[str, Model], directory: Path) -> None:
        """Refuse to go on with other models than the run began with.

        Raises:
            ScenarioError: naming the instances.
        """
        other = [name for name, model in models.items() if model.digest != self.digests.get(name)]
        if other:
            raise ScenarioError(
                f"{directory} cannot be resumed: {', '.join(other[:6])} {'is' if len(other) == 1 else 'are'} not the "
                "model the run began with (its file, or this version of railcosim, has changed); run it from the start"
            )


def check_serializable(models: Mapping[str, Model]) -> None:
    """Refuse checkpoints where an FMU cannot give its state away.

    Raises:
        ScenarioError: naming the instances.
    """
    unable = [name for name, model in models.items() if not model.interface.can_serialize_state]
    if unable:
        raise ScenarioError(
            f"no checkpoints: {', '.join(unable[:6])}{' and more' if len(unable) > 6 else ''} cannot serialize "
            f"{'its' if len(unable) == 1 else 'their'} state (canSerializeFMUstate is false); leave "
            "--checkpoint-every out, or put another model in by --swap"
        )


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, tuple | set | frozenset):
        return list(value)
    return str(value)


def read_checkpoint(directory: Path) -> Checkpoint:
    """The checkpoint of a run.

    Raises:
        ScenarioError: there is none that can be read.
    """
    path = directory / CHECKPOINT_FILE
    if not path.is_file():
        raise ScenarioError(
            f"{directory} has no {CHECKPOINT_FILE}: only a run with --checkpoint-every can be resumed, "
            "once it has written one"
        )
    try:
        with world.open(path, "rb") as stream, zipfile.ZipFile(stream) as archive:
            check_size("checkpoint.json", archive.getinfo("checkpoint.json").file_size)
            content = json.loads(archive.read("checkpoint.json"))
            if content["format"] != _FORMAT:
                raise ScenarioError(f"{path} is of another version of railcosim; run the scenario from the start")
            names = list(content["digests"])
            states = {name: archive.read(f"states/{number}") for number, name in enumerate(names)}
        point = Checkpoint(
            system=_system(content["system"]),
            kind=content["kind"],
            marks=[[int(number) for number in mark] for mark in content["marks"]],
            digests=content["digests"],
            progress=content["progress"],
            states=states,
            every=content["every"],
            seen=content["seen"],
            run=content["run"],
        )
        if not point.marks or not all(rows >= 1 for rows, _ in point.marks) or not math.isfinite(point.time):
            raise ValueError(f"{point.marks} rows up to {point.time} s")
    except ScenarioError:
        raise
    except Exception as error:  # whatever may be in it
        what = f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
        raise ScenarioError(f"{path} cannot be read ({what}); run the scenario from the start") from error
    return point


def _system(data: dict[str, Any]) -> System:
    instances = {name: Instance(**entry) for name, entry in data.pop("instances").items()}
    connections = [Connection(**entry) for entry in data.pop("connections")]
    sources = [entry.pop("source") for entry in data["events"]]
    events = [
        Event(**entry, source=source and Connection(**source))
        for entry, source in zip(data.pop("events"), sources, strict=True)
    ]
    data["provenance"]["presets"] = tuple(data["provenance"]["presets"])
    data["provenance"]["command"] = tuple(data["provenance"].get("command", ()))
    data["provenance"]["named"] = ()  # by a file: nobody else knows
    parts = {"stepping": Stepping, "judged": Judged, "provenance": Provenance}
    made = {name: part(**data.pop(name)) for name, part in parts.items()}
    return System(**data, **made, instances=instances, connections=connections, events=events)
