"""What runs on a worker: it unpacks what a study needs, once, and runs what it is sent."""

from __future__ import annotations

import hashlib
import os
import threading
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any

from ... import world
from ...digests import digest_of
from ...errors import RailcosimError
from ...fmi import Packaged, provide
from ...leftovers import PREFIX, own, sweep
from ..rows import Row
from ..structure import Runner
from .parcel import MODELS, Parcel, moved, moved_options, this_machine, this_version

_LOCK = threading.Lock()
"""FMUs of one process are called by one thread, however many a worker has."""
_OPEN: dict[str, Unpacked] = {}
"""Studies by the digest of their parcel."""


def work(
    parcel: Parcel, points: Sequence[Mapping[str, Any]], contents: Sequence[bytes] | None
) -> tuple[list[Row], float] | None:
    """What comes out of runs, and how long they took in s, without what was to be made ready for them.

    None where this worker has not had the files yet: it is asked again with them, and then has them for all others.

    Args:
        parcel: what the study needs.
        points: the changes of each run.
        contents: of all files; None does not send them.

    Raises:
        RailcosimError: this worker cannot run the study at all.
    """
    with _LOCK:
        if parcel.digest not in _OPEN:
            if contents is None:
                return None
            try:
                _OPEN[parcel.digest] = Unpacked(parcel, contents)
            except OSError as error:
                raise RailcosimError(f"a worker cannot unpack {error.filename}: {error.strerror or error}") from error
        study = _OPEN[parcel.digest]
        begin = world.perf_counter()
        rows = [study.run(changes) for changes in points]
        return rows, world.perf_counter() - begin


def forget(digest: str) -> None:
    """Give back what a study has taken."""
    with _LOCK:
        if (study := _OPEN.pop(digest, None)) is not None:
            study.close()


class Unpacked:
    """A study on a worker: its files where they are now, and the `Runner` of it.

    Args:
        parcel: what was sent.
        contents: of all files.

    Raises:
        RailcosimError: it is for another version of this package, or its scenario cannot be read here.
        OSError: there is no room.
    """

    def __init__(self, parcel: Parcel, contents: Sequence[bytes]) -> None:
        self._parcel = parcel
        if parcel.version != this_version():
            raise RailcosimError(f"a worker has railcosim {this_version()}, and the study {parcel.version}")
        with ExitStack() as held:
            self._place = Path(world.mkdtemp(prefix=PREFIX))
            held.callback(world.rmtree, self._place, ignore_errors=True)
            held.callback(own(self._place).release)
            sweep(self._place)
            by_digest = {hashlib.sha256(content).hexdigest(): content for content in contents}
            for file, digest in parcel.files.items():
                if digest in by_digest:
                    _write(self._laid(file), by_digest[digest])
                elif digest_of(here := Path(str(self._where(file)))) != digest:
                    raise RailcosimError(f"a worker has another {here.name} than the study: install the same railcosim")
            self._make_absolute_paths_lead_here()
            if parcel.machine == this_machine():
                self._provide(by_digest)
            self._runner = held.enter_context(Runner(**moved_options(parcel.how, parcel.folder, self._where)))
            self._held = held.pop_all()

    def close(self) -> None:
        """Give it back."""
        self._held.close()

    def run(self, changes: Mapping[str, Any]) -> Row:
        """One run; what it says of files names them as the sender has them."""
        row = self._runner.run({key: self._moved(value) for key, value in changes.items()})
        return replace(row, error=row.error.replace(str(self._place / "files"), "")) if row.error else row

    def _laid(self, file: str) -> Path:
        """Where a file of the sender's is: in the same folders below our own, so that relative paths lead there."""
        parts = [part.strip(":\\/") for part in Path(file).parts]
        return self._place.joinpath("files", *filter(None, parts))

    def _where(self, file: str) -> str | None:
        if file.startswith(self._parcel.models + os.sep):
            return MODELS + file.removeprefix(self._parcel.models)
        return str(self._laid(file)) if file in self._parcel.files else None

    def _moved(self, value: Any) -> Any:
        return moved(value, self._parcel.folder, self._where)

    def _make_absolute_paths_lead_here(self) -> None:
        scenario = self._laid(str(self._parcel.how["scenario"]))
        if scenario.suffix.lower() != ".toml" or not scenario.is_file():  # an SSP names no file, one is shipped
            return
        text = world.read_text(scenario, encoding="utf-8")
        for file in self._parcel.files:
            for quote in "\"'":
                text = text.replace(f"{quote}{file}", f"{quote}{self._laid(file)}")
        world.write_text(scenario, text, encoding="utf-8")

    def _provide(self, by_digest: Mapping[str, bytes]) -> None:
        for one in self._parcel.components:
            path = self._place / "components" / one.digest / one.name
            _write(path, by_digest[one.digest])
            arguments = {name: self._moved(value) for name, value in one.arguments.items()}
            provide(self._moved(one.reference), arguments, one.kind, Packaged(path, one.made, one.note))


def _write(path: Path, content: bytes) -> None:
    world.mkdir(path.parent, parents=True, exist_ok=True)
    world.write_bytes(path, content)
