"""What a file is that was given for an FMU and is none, and what to do about it."""

from __future__ import annotations

import zipfile
from collections.abc import Collection
from pathlib import Path, PurePosixPath

from .. import world

_HEAD = 1024
"""Bytes at the beginning of a file that tell what it is."""
_AGAIN = "download or copy it once more"
_KINDS: tuple[tuple[bytes, str], ...] = (
    (b"version https://git-lfs", "a Git LFS pointer, not the FMU it stands for; fetch that with 'git lfs pull'"),
    (b"/annex/objects/", "a git-annex pointer, not the FMU it stands for; fetch that with 'git annex get'"),
    (b"<!doctype html", f"a web page, perhaps of a login or an error; {_AGAIN}"),
    (b"<html", f"a web page, perhaps of a login or an error; {_AGAIN}"),
    (b"\x1f\x8b", "compressed with gzip; an FMU is a zip archive, which may be inside"),
    (b"7z\xbc\xaf\x27\x1c", "a 7z archive; an FMU is a zip archive"),
    (b"Rar!", "a RAR archive; an FMU is a zip archive"),
    (b"\x7fELF", "a program or a shared library, not an FMU, in which one is packed"),
    (b"MZ", "a program or a shared library, not an FMU, in which one is packed"),
)
_PARTS = "zip its folder: modelDescription.xml at the top, with binaries/ and resources/ beside it"


def describe_file(path: Path) -> str:
    """What a file is that is no zip archive, with the remedy; empty where that is not known.

    Raises:
        OSError: it cannot be read.
    """
    with world.open(path, "rb") as stream:
        head = stream.read(_HEAD)
        stream.seek(257)
        is_tar = stream.read(5) == b"ustar"
        is_zip = zipfile.is_zipfile(stream)
    if not head:
        return f"empty; {_AGAIN}"
    if head.startswith(b"PK\x03\x04") and not is_zip:
        return f"a zip archive without its end, as if cut short; {_AGAIN}"
    text = head.removeprefix(b"\xef\xbb\xbf").lstrip().lower()
    for begin, what in _KINDS:
        if head.startswith(begin) or text.startswith(begin):
            return what
    if is_tar:
        return "a tar archive; an FMU is a zip archive"
    if b"<fmimodeldescription" in text:
        return f"a model description alone; {_PARTS}"
    return ""


def describe_members(names: Collection[str]) -> str:
    """What an archive is that holds no model description, with the remedy; empty where that is not known."""
    fmus = [name for name in names if is_fmu_name(name)]
    if "SystemStructure.ssd" in names:
        return f"an SSP, a system of {len(fmus)} FMUs; call it .ssp, or unpack it and name one of those in resources/"
    if fmus:
        return f"an archive with an FMU in it; unpack it and name {fmus[0]!r}"
    places = [name for name in names if PurePosixPath(name).name.lower() == "modeldescription.xml"]
    if places:
        return f"no FMU as it is packed: its model description is {places[0]!r}; {_PARTS}"
    return ""


def is_fmu_name(text: str) -> bool:
    """Whether a path is that of an FMU file, in whatever letters its ending is written."""
    return text.lower().endswith(".fmu")
