"""A place for unpacked FMUs."""

from __future__ import annotations

import errno
import tempfile
import zipfile
from pathlib import Path
from typing import NamedTuple

from .. import world
from ..digests import digest_of
from ..errors import FmuFileError
from ..leftovers import PREFIX, own, sweep
from .members import extract, list_members
from .recognition import describe_file

_OF_THE_MACHINE = {
    *(errno.ENOSPC, errno.EDQUOT, errno.EIO, errno.EROFS, errno.EACCES, errno.EPERM),
    *(errno.EMFILE, errno.ENFILE, errno.ENOMEM),
}
"""Errors for which no archive is to blame."""


class Unpacked(NamedTuple):
    """An FMU as files.

    Attributes:
        folder: where they are. digest: SHA-256 of the archive. notes: what was put right, a sentence each.
    """

    folder: Path
    digest: str
    notes: tuple[str, ...]


class Workspace:
    """A temporary folder that unpacked FMUs live in while they are used; one copy per file for all its instances.

    Python FMUs cannot be loaded from a path with letters outside ASCII or with signs that a URI must encode (pythonfmu
    does not decode them and crashes). FMUs are therefore never used where the user keeps them, but unpacked here, and
    the place is checked first.

    Raises:
        FmuFileError: no folder with a plain path can be had, or (from `unpack`) an archive cannot be used.
    """

    def __init__(self) -> None:
        self._place = _plain_folder()
        self.folder = self._place / "fmus"
        try:
            self._lock = own(self._place)
            sweep(self._place)
            world.mkdir(self.folder)
        except BaseException:
            world.rmtree(self._place, ignore_errors=True)
            raise
        self._unpacked: dict[tuple[str, bool], tuple[Path, tuple[str, ...]]] = {}

    def unpack(self, path: Path, *, to_run: bool = False) -> Unpacked:
        """Unpack an FMU file.

        Args:
            path: of the file.
            to_run: whether to leave out what only people and compilers read. That is for FMUs made here: one of another
                tool may look for anything beside its resources.
        """
        if path.is_dir():
            raise FmuFileError(
                f"{path} is a folder, not an FMU file; zip what is in it, modelDescription.xml at the top"
            )
        digest = digest_of(path, FmuFileError)
        if (digest, to_run) not in self._unpacked:
            target = self.folder / f"fmu{len(self._unpacked)}_{digest[:12]}"
            self._unpacked[digest, to_run] = target, _extract(path, target, to_run=to_run)
        folder, notes = self._unpacked[digest, to_run]
        return Unpacked(folder, digest, tuple(f"{path}: {note}" for note in notes))

    def write_description(self, description: bytes) -> Path:
        """A folder that holds nothing but a model description, for a component that runs in this process."""
        folder = Path(world.mkdtemp(dir=self.folder))
        world.write_bytes(folder / "modelDescription.xml", description)
        return folder

    def close(self) -> None:
        """Remove everything unpacked."""
        self._lock.release()
        world.rmtree(self._place, ignore_errors=True)

    def __enter__(self) -> Workspace:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _plain_folder() -> Path:
    for parent in (None, "/tmp", "/var/tmp", "C:/Temp"):
        try:
            folder = Path(world.mkdtemp(prefix=PREFIX, dir=parent)).resolve()
        except OSError:
            continue
        if (
            folder.as_uri().replace("%20", " ")
            == f"file://{'' if folder.as_posix()[0] == '/' else '/'}{folder.as_posix()}"
        ):
            return folder
        world.rmdir(folder)
    raise FmuFileError(
        f"FMUs cannot be unpacked below {tempfile.gettempdir()!r}: Python FMUs need a path of plain ASCII letters; "
        "set TMPDIR to such a folder"
    )


def _extract(path: Path, target: Path, *, to_run: bool) -> tuple[str, ...]:
    """Unpack a file; what was put right on the way."""
    try:
        with world.open(path, "rb") as stream, zipfile.ZipFile(stream) as archive:
            members = list_members(path, archive)
            extract(archive, members.needed() if to_run else members, target)
    except FmuFileError:
        world.rmtree(target, ignore_errors=True)
        raise
    except Exception as error:  # damaged, encrypted, unwritable (a file where a folder stands): all kinds are raised
        world.rmtree(target, ignore_errors=True)
        if isinstance(error, OSError) and error.errno in _OF_THE_MACHINE:
            where = f"{error.strerror}: {error.filename or target}; set TMPDIR to a folder with room"
            raise FmuFileError(f"{path} cannot be unpacked: {where}") from error
        what = describe_file(path)
        why = f"{path} is {what}" if what else f"{path} is not a usable FMU: {error}"
        raise FmuFileError(why) from error
    return members.notes
