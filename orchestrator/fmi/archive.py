"""Unpacking FMUs. Nothing in an archive is trusted: paths, links and sizes are checked before a byte is written."""

from __future__ import annotations

import hashlib
import shutil
import stat
import tempfile
import zipfile
from pathlib import Path, PurePosixPath, PureWindowsPath

from ..errors import FmuFileError

MAX_SIZE = 4 << 30
"""Bytes an FMU may unpack to: a bomb is refused, a large real model is not."""
MAX_FILES = 100_000
MAX_DESCRIPTION = 256 << 20
MAX_LEVELS = 64
"""Folders in folders: a thousand of them could be made, but not be removed again."""
_METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
_OTHER_METHODS = {zipfile.ZIP_BZIP2: "bzip2", zipfile.ZIP_LZMA: "lzma"}
"""What FMI allows. Of others `zipfile` unpacks whole blocks in memory, whatever size an entry says it has."""


class Workspace:
    """A temporary folder that unpacked FMUs live in while they are used; one copy per file for all its instances.

    Python FMUs cannot be loaded from a path with letters outside ASCII or with signs that a URI must encode (pythonfmu
    does not decode them and crashes). FMUs are therefore never used where the user keeps them, but unpacked here, and
    the place is checked first.

    Raises:
        FmuFileError: no folder with a plain path can be had, or (from `unpack`) an archive cannot be used.
    """

    def __init__(self) -> None:
        self.folder = _plain_folder()
        self._unpacked: dict[str, Path] = {}

    def unpack(self, path: Path) -> tuple[Path, str]:
        """Unpack an FMU file; its folder and the SHA-256 of the file."""
        try:
            with path.open("rb") as stream:
                digest = hashlib.file_digest(stream, "sha256").hexdigest()
        except OSError as error:
            raise FmuFileError(f"{path} cannot be read: {error.strerror or error}") from error
        if digest not in self._unpacked:
            target = self.folder / f"fmu{len(self._unpacked)}_{digest[:12]}"
            _extract(path, target)
            self._unpacked[digest] = target
        return self._unpacked[digest], digest

    def write_description(self, description: bytes) -> Path:
        """A folder that holds nothing but a model description, for a component that runs in this process."""
        folder = Path(tempfile.mkdtemp(dir=self.folder))
        (folder / "modelDescription.xml").write_bytes(description)
        return folder

    def close(self) -> None:
        """Remove everything unpacked."""
        shutil.rmtree(self.folder, ignore_errors=True)

    def __enter__(self) -> Workspace:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _plain_folder() -> Path:
    for parent in (None, "/tmp", "/var/tmp", "C:/Temp"):
        try:
            folder = Path(tempfile.mkdtemp(prefix="railcosim_", dir=parent)).resolve()
        except OSError:
            continue
        if (
            folder.as_uri().replace("%20", " ")
            == f"file://{'' if folder.as_posix()[0] == '/' else '/'}{folder.as_posix()}"
        ):
            return folder
        folder.rmdir()
    raise FmuFileError(
        f"FMUs cannot be unpacked below {tempfile.gettempdir()!r}: Python FMUs need a path of plain ASCII letters; "
        "set TMPDIR to such a folder"
    )


def _extract(path: Path, target: Path) -> None:
    try:
        with zipfile.ZipFile(path) as archive:
            entries = archive.infolist()
            _check_entries(path, entries)
            for entry in entries:
                archive.extract(entry, target)
    except FmuFileError:
        raise
    except Exception as error:  # damaged, encrypted, unwritable (a file where a folder stands): all kinds are raised
        shutil.rmtree(target, ignore_errors=True)
        raise FmuFileError(f"{path} is not a usable FMU: {error}") from error
    if not (target / "modelDescription.xml").is_file():
        shutil.rmtree(target, ignore_errors=True)
        raise FmuFileError(f"{path} is not an FMU: it holds no modelDescription.xml")


def _check_entries(path: Path, entries: list[zipfile.ZipInfo]) -> None:
    if len(entries) > MAX_FILES:
        raise FmuFileError(f"{path} is refused: it holds {len(entries)} files")
    total = sum(entry.file_size for entry in entries)
    if total > MAX_SIZE:
        raise FmuFileError(f"{path} is refused: it unpacks to {total / 2**30:.1f} GiB")
    for entry in entries:
        name = entry.filename
        parts = PurePosixPath(name.replace("\\", "/")).parts
        if not name:
            raise FmuFileError(f"{path} is refused: it holds an entry without a name")
        if ".." in parts or PurePosixPath(name).is_absolute() or PureWindowsPath(name).drive or name.startswith("\\"):
            raise FmuFileError(f"{path} is refused: the entry {name!r} points outside the archive")
        if stat.S_ISLNK(entry.external_attr >> 16):
            raise FmuFileError(f"{path} is refused: the entry {name!r} is a symbolic link")
        if len(parts) > MAX_LEVELS:
            raise FmuFileError(f"{path} is refused: an entry lies {len(parts)} levels deep, {name[:40]!r}...")
        if entry.compress_type not in _METHODS:
            method = _OTHER_METHODS.get(entry.compress_type, f"method {entry.compress_type}")
            raise FmuFileError(f"{path} is refused: the entry {name!r} is compressed with {method}; FMI allows deflate")
        if parts == ("modelDescription.xml",) and entry.file_size > MAX_DESCRIPTION:
            raise FmuFileError(f"{path} is refused: its modelDescription.xml is {entry.file_size >> 20} MiB")
