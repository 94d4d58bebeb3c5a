"""The members of an FMU's archive: what each becomes on the disk, checked before a byte is written.

Nothing in an archive is trusted: paths, links and sizes. What tools get wrong is put right where it leaves no doubt
about its meaning, with a note.
"""

from __future__ import annotations

import posixpath
import stat
import zipfile
from collections import Counter
from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath, PureWindowsPath

from .. import world
from ..errors import FmuFileError
from .recognition import describe_members

MAX_SIZE = 4 << 30
"""Bytes an FMU may unpack to: a bomb is refused, a large real model is not."""
MAX_RATIO = 200
"""How many times its size an archive may unpack to where that is more than `SMALL`; text takes a tenth, zeros a
thousandth."""
SMALL = 256 << 20
MAX_FILES = 100_000
MAX_DESCRIPTION = 256 << 20
MAX_LEVELS = 64
"""Folders in folders: a thousand of them could be made, but not be removed again."""
_MAX_LINK = 4096
_METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
_OTHER_METHODS = {zipfile.ZIP_BZIP2: "bzip2", zipfile.ZIP_LZMA: "lzma"}
"""What FMI allows. Of others `zipfile` unpacks whole blocks in memory, whatever size an entry says it has."""
_DESCRIPTION = "modelDescription.xml"
_POINTER = b"version https://git-lfs"
_HEAD = len(_POINTER)
_PROGRAMS = (b"\x7fELF", b"#!", b"\xcf\xfa\xed\xfe", b"\xca\xfe\xba\xbe")
"""How programs begin: of Linux, scripts, of macOS. Archives made on Windows, by Java or by Python's `zipfile` don't say
which of their files may be run, or say that none may."""
_DOS_FOLDER = 0x10
_FOLDERS = ("binaries", "resources", "sources", "documentation", "extra", "terminalsAndIcons", "licenses")
"""The folders of an FMU that the standards name; those below ``binaries`` have no capitals."""


@dataclass(frozen=True)
class Members:
    """What an archive holds.

    Attributes:
        files: what each file is read from, by its path in the FMU; that of a folder ends in a slash.
        notes: what was put right, a sentence each.
    """

    files: dict[str, zipfile.ZipInfo]
    notes: tuple[str, ...]

    def needed(self) -> Members:
        """Without what a run does not need of an FMU that is made here: all but its binaries and its resources."""
        kept = (_DESCRIPTION, "binaries/", "resources/")
        return replace(self, files={name: entry for name, entry in self.files.items() if name.startswith(kept)})


def list_members(path: Path, archive: zipfile.ZipFile) -> Members:
    """The files of an archive, by the paths they get.

    Raises:
        FmuFileError: one of them is a danger, or there is no model description.
    """
    entries = archive.infolist()
    _check_size(path, entries)
    notes = []
    if any("\\" in entry.filename for entry in entries):
        notes.append("it has paths with backslashes, which a zip may not have; they are taken for folders")
    files: dict[str, zipfile.ZipInfo] = {}
    twice = Counter[str]()
    for entry in entries:
        _check_entry(path, entry)
        name = "/".join(PurePosixPath(entry.filename.replace("\\", "/")).parts)
        if not name:
            continue
        name += "/" * _is_folder(entry)
        twice[name] += name in files and files[name].CRC != entry.CRC
        files[name] = entry
    notes += [f"it holds {name!r} {count + 1} times; the last counts" for name, count in twice.items() if count]
    _follow_links(path, archive, files)
    _check_size(path, files.values())
    files, more = _at_top(path, files)
    files, spelled = _spelled(files)
    _check_folders(path, files)
    description = files.get(_DESCRIPTION)
    if description and description.file_size > MAX_DESCRIPTION:
        raise FmuFileError(f"{path} is refused: its {_DESCRIPTION} is {description.file_size >> 20} MiB")
    return Members(files, (*notes, *more, *spelled, *_alike(files)))


def check_entries(path: Path, archive: zipfile.ZipFile) -> None:
    """Look at the entries of any archive for what is a danger.

    Raises:
        FmuFileError: one of them is, or all together unpack to too much.
    """
    _check_size(path, archive.infolist())
    for entry in archive.infolist():
        _check_entry(path, entry)


def extract(archive: zipfile.ZipFile, members: Members, target: Path) -> None:
    """Write the files below a folder; what may be run there may be run here."""
    for name, entry in members.files.items():
        place = target / name
        if name.endswith("/"):
            world.mkdir(place, parents=True, exist_ok=True)
            continue
        world.mkdir(place.parent, parents=True, exist_ok=True)
        with archive.open(entry) as source, world.open(place, "xb") as copy:
            world.copyfileobj(source, copy)
        with world.open(place, "rb") as stream:
            head = stream.read(_HEAD)
        if head.startswith(_POINTER):
            what = f"holds a Git LFS pointer in place of {name!r}; fetch that with 'git lfs pull' and pack it again"
            raise FmuFileError(f"{archive.filename} {what}")
        if (entry.external_attr >> 16) & 0o111 or head.startswith(_PROGRAMS):
            world.chmod(place, 0o755)


def _check_size(path: Path, entries: Collection[zipfile.ZipInfo]) -> None:
    if len(entries) > MAX_FILES:
        raise FmuFileError(f"{path} is refused: it holds {len(entries)} files")
    total, packed = sum(entry.file_size for entry in entries), world.stat(path).st_size
    if total > MAX_SIZE:
        raise FmuFileError(f"{path} is refused: it unpacks to {total / 2**30:.1f} GiB")
    if total > SMALL and total > MAX_RATIO * packed:
        times = f"{total / 2**30:.1f} GiB, {total / packed:.0f} times its size"
        raise FmuFileError(f"{path} is refused: it unpacks to {times}")


def _check_entry(path: Path, entry: zipfile.ZipInfo) -> None:
    name = entry.filename
    parts = PurePosixPath(name.replace("\\", "/")).parts
    if not name:
        raise FmuFileError(f"{path} is refused: it holds an entry without a name")
    if ".." in parts or PurePosixPath(name).is_absolute() or PureWindowsPath(name).drive or name.startswith("\\"):
        raise FmuFileError(f"{path} is refused: the entry {name!r} points outside the archive")
    if len(parts) > MAX_LEVELS:
        raise FmuFileError(f"{path} is refused: an entry lies {len(parts)} levels deep, {name[:40]!r}...")
    if entry.flag_bits & 1:
        raise FmuFileError(f"{path} is refused: the entry {name!r} is encrypted; pack it without a password")
    if entry.compress_type not in _METHODS:
        method = _OTHER_METHODS.get(entry.compress_type, f"method {entry.compress_type}")
        raise FmuFileError(f"{path} is refused: the entry {name!r} is compressed with {method}; FMI allows deflate")


def _follow_links(path: Path, archive: zipfile.ZipFile, files: dict[str, zipfile.ZipInfo]) -> None:
    """Put in a link's place the file it leads to, which must be in the archive (a library and its version's name)."""
    links = {name for name, entry in files.items() if stat.S_ISLNK(entry.external_attr >> 16)}
    for name in links:
        end, seen = name, {name}
        while end in links:
            entry = files[end]
            text = archive.read(entry).decode(errors="replace") if entry.file_size <= _MAX_LINK else "/"
            text = text.replace("\\", "/")
            end = posixpath.normpath(posixpath.join(posixpath.dirname(end), text))
            if end in seen or end not in files:
                raise FmuFileError(
                    f"{path} is refused: the entry {name!r} is a symbolic link to no file of the archive"
                )
            seen.add(end)
        files[name] = files[end]


def _at_top(path: Path, files: dict[str, zipfile.ZipInfo]) -> tuple[dict[str, zipfile.ZipInfo], list[str]]:
    """The files with the model description at the top: perhaps the folder was packed, not what is in it."""
    if _DESCRIPTION in files:
        return files, []
    own = {name: entry for name, entry in files.items() if not name.startswith("__MACOSX/")}
    tops = {name.partition("/")[0] for name in own}
    top = next(iter(tops)) if len(tops) == 1 else ""
    if f"{top}/{_DESCRIPTION}" in own:
        note = f"all of it stands in a folder {top!r}, which an FMU may not have; it is read from there"
        return {name.partition("/")[2]: entry for name, entry in own.items() if name != f"{top}/"}, [note]
    written = [name for name in files if name.lower() == _DESCRIPTION.lower()]
    if len(written) == 1:
        note = f"its {written[0]} is taken for {_DESCRIPTION}"
        return {_DESCRIPTION if name == written[0] else name: entry for name, entry in files.items()}, [note]
    what = describe_members(files)
    raise FmuFileError(f"{path} is {what}" if what else f"{path} is not an FMU: it holds no {_DESCRIPTION}")


def _is_folder(entry: zipfile.ZipInfo) -> bool:
    """Whether an entry stands for a folder: by a slash at its end, by a Unix mode, or by DOS' bit."""
    if entry.filename.endswith(("/", "\\")):
        return True
    return not entry.file_size and bool(stat.S_ISDIR(entry.external_attr >> 16) or entry.external_attr & _DOS_FOLDER)


def _spelled(files: dict[str, zipfile.ZipInfo]) -> tuple[dict[str, zipfile.ZipInfo], list[str]]:
    """The files with the folders that the standards name as they name them: on Windows capitals do not count."""
    known = {name.lower(): name for name in _FOLDERS}
    found: dict[str, zipfile.ZipInfo] = {}
    changed: dict[str, str] = {}
    for name, entry in files.items():
        top, *rest = name.split("/")
        meant = [known.get(top.lower(), top), *rest] if rest else [top]
        if meant[0] == "binaries" and len(meant) > 2:
            meant[1] = meant[1].lower()
        right = "/".join(meant)
        right = name if right in files or right in found else right
        if right != name:
            depth = 2 if meant[0] == "binaries" and rest[0] != meant[1] else 1
            changed["/".join(name.split("/")[:depth])] = "/".join(meant[:depth])
        found[right] = entry
    return found, [f"its folder {given!r} is taken for {right!r}" for given, right in changed.items()]


def _check_folders(path: Path, files: dict[str, zipfile.ZipInfo]) -> None:
    """No file stands where others need a folder; one that is empty was meant as one."""
    folders = {str(parent) for name in files for parent in PurePosixPath(name).parents}
    for name in folders & files.keys():
        if files[name].file_size or name == _DESCRIPTION:
            raise FmuFileError(f"{path} is refused: {name!r} in it is a file, and a folder of others as well")
        files[f"{name}/"] = files.pop(name)


def _alike(files: dict[str, zipfile.ZipInfo]) -> Iterator[str]:
    """Files whose paths differ in capitals only, of which Windows and macOS keep one."""
    seen: dict[str, str] = {}
    for name in files:
        other = seen.setdefault(name.lower(), name)
        if other != name and not name.endswith("/"):
            yield f"{other!r} and {name!r} are one file where capitals do not count, as on Windows"
