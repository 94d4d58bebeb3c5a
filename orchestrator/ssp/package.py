"""The files of an SSP archive, or of the folder in which a bare SSD stands: nothing in them is trusted."""

from __future__ import annotations

import os
import posixpath
import zipfile
import zlib
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import final
from urllib.parse import unquote, urlsplit

from .. import world
from ..errors import FmuFileError, ScenarioError
from ..fmi import check_entries
from ..problems import Problem

DEFAULT = "SystemStructure.ssd"
MAX_DOCUMENT = 64 << 20
"""Bytes of one XML document: far more than tools write, and read within seconds."""
_DAMAGED = (OSError, EOFError, zipfile.BadZipFile, zlib.error)
"""What reading an entry raises whose bytes are not those that were packed."""


@final
class Package:
    """Files by their paths in the archive, with slashes.

    Args:
        path: of the archive, or of an SSD that stands in a folder.
        label: what messages call it.
        folder: where files are put that have to be files, below the digest of the archive if there is none of its own.

    Raises:
        ScenarioError: it cannot be read, or something in it is a danger.
    """

    def __init__(self, path: Path, label: str, folder: Path) -> None:
        self.path, self.label, self.folder = path, label, folder
        self.is_archive = path.suffix.lower() != ".ssd"
        self._files: dict[str, zipfile.ZipInfo] = {}
        if self.is_archive:
            self._files = self._list()

    def _list(self) -> dict[str, zipfile.ZipInfo]:
        try:
            with world.open(self.path, "rb") as stream, zipfile.ZipFile(stream) as archive:
                check_entries(self.path, archive)
                return {entry.filename: entry for entry in archive.infolist() if not entry.is_dir()}
        except zipfile.BadZipFile as error:
            raise ScenarioError(Problem(self.label, f"it is no SSP, which is a zip archive: {error}")) from error
        except OSError as error:
            raise ScenarioError(Problem(self.label, f"cannot be read: {error.strerror or error}")) from error
        except FmuFileError as error:
            raise ScenarioError(str(error).replace(str(self.path), self.label)) from error

    @property
    def roots(self) -> list[str]:
        """The system structures at the top, the default one first."""
        if not self.is_archive:
            return [self.path.name]
        found = sorted(name for name in self._files if "/" not in name and name.lower().endswith(".ssd"))
        return sorted(found, key=lambda name: name != DEFAULT)

    def resolve(self, uri: str, base: str, place: str) -> tuple[str, str]:
        """The path that a URI in the document `base` means, and its fragment.

        Raises:
            ScenarioError: it does not lead to a file of this package.
        """
        try:
            parts = urlsplit(uri)
        except ValueError as error:
            raise ScenarioError(Problem(place, f"source {uri!r} is no URI: {error}")) from None
        if parts.scheme or parts.netloc or parts.query:
            raise ScenarioError(Problem(place, f"source {uri!r} leads elsewhere", "pack the file into the archive"))
        text = unquote(parts.path)
        path = posixpath.normpath(posixpath.join(posixpath.dirname(base), text))
        outside = path.startswith("..") or PurePosixPath(path).is_absolute() or PureWindowsPath(path).drive
        if outside or "\\" in path or "\0" in path:
            raise ScenarioError(Problem(place, f"source {uri!r} is refused: it points outside the archive"))
        if not self._has(path):
            raise ScenarioError(Problem(place, f"source {uri!r}: there is no such file in {self.label}"))
        return path, unquote(parts.fragment)

    def _has(self, path: str) -> bool:
        if self.is_archive:
            return path in self._files
        top = Path(os.path.abspath(self.path)).parent.resolve()
        return (top / path).is_file() and (top / path).resolve().is_relative_to(top)

    def read(self, path: str) -> bytes:
        """An XML document.

        Raises:
            ScenarioError: it is too large, or damaged.
        """
        place = f"{self.label}/{path}" if self.is_archive else self.label
        try:
            if not self.is_archive:
                with world.open(self.path.parent / path, "rb") as stream:
                    data = stream.read(MAX_DOCUMENT + 1)
            else:
                with world.open(self.path, "rb") as stream, zipfile.ZipFile(stream) as archive:
                    data = archive.open(path).read(MAX_DOCUMENT + 1)
        except _DAMAGED as error:
            raise ScenarioError(Problem(place, f"cannot be read: {error}")) from error
        if len(data) > MAX_DOCUMENT:
            raise ScenarioError(Problem(place, f"it is refused: it has more than {MAX_DOCUMENT >> 20} MiB"))
        return data

    def extract(self, path: str) -> Path:
        """A file of the package as a file of its own.

        Raises:
            ScenarioError: it cannot be unpacked.
        """
        if not self.is_archive:
            return Path(os.path.abspath(self.path)).parent / path
        target = self.folder / path
        entry = self._files[path]
        if target.is_file() and world.stat(target).st_size == entry.file_size:
            return target
        try:
            world.mkdir(target.parent, parents=True, exist_ok=True)
            part = target.with_name(f"{target.name}.{os.getpid()}.part")
            with (
                world.open(self.path, "rb") as stream,
                zipfile.ZipFile(stream) as archive,
                archive.open(entry) as source,
                world.open(part, "wb") as copy,
            ):
                world.copyfileobj(source, copy)
            world.replace(part, target)
        except _DAMAGED as error:
            what = f"{path} cannot be unpacked into {target.parent}: {error}"
            raise ScenarioError(Problem(self.label, what)) from error
        return target

    def inner(self, path: str) -> Package:
        """A package that stands in this one."""
        folder = self.folder / f"{path}.files"
        return Package(self.extract(path), f"{self.label}/{path}" if self.is_archive else path, folder)


def list_variants(path: Path) -> list[str]:
    """The system structures of an archive, as ``--variant`` names them; the default one first, none where none is read.

    Only the archive's table of contents is looked at.
    """
    try:
        return [PurePosixPath(root).stem for root in Package(path, str(path), path.parent).roots]
    except ScenarioError:
        return []
