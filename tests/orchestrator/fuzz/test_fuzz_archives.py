"""Archives of strangers: they are unpacked into their folder or refused by name, and nothing is written elsewhere."""

import io
import os
import re
import stat
import struct
import tracemalloc
import warnings
import zipfile

import pytest
from hypothesis import strategies as st
from railcosim.orchestrator.errors import FmuFileError
from railcosim.orchestrator.fmi import members
from railcosim.orchestrator.fmi.archive import Workspace

DESCRIPTION = b"<x/>"
SMALL = 200_000
PARTS = st.sampled_from(
    [
        *("modelDescription.xml", "resources", "binaries", "a", "A", "data.txt", "..", ".", "", "C:", "c:x", "con"),
        *("a.", "a ", "~", "$HOME", "\\", "a\\b", "..\\x", "\\\\server", "é", "😀", "\x01", "\n", "/", "*?", "a:b"),
        *("x" * 255, "x" * 256, "x" * 5000),
    ]
)
ENTRIES = st.one_of(
    st.sampled_from(["modelDescription.xml", ""]),
    st.lists(PARTS, min_size=1, max_size=4).map("/".join),
    st.lists(PARTS, min_size=1, max_size=3).map("\\".join),
    st.text(st.characters(exclude_categories=["Cs"]), min_size=1, max_size=6),
    st.builds(
        "{}{}".format, st.sampled_from(["f/" * depth for depth in (5, 30, 100, 900)]), st.sampled_from(["", "x"])
    ),
)
CONTENTS = st.sampled_from(
    [b"", DESCRIPTION, bytes(1000), bytes(50_000), bytes(150_000), bytes(3_000_000)]
) | st.binary(max_size=50)
KINDS = st.sampled_from([0, 0, 0, stat.S_IFLNK, stat.S_IFIFO, stat.S_IFCHR, stat.S_IFSOCK, stat.S_IFDIR])
LARGE = st.sampled_from([0, 1, 46, 100, 2**32, 2**40, 2**63 - 1, 2**63, 2**64 - 1])
DIRECTORY, END = b"PK\1\2", b"PK\5\6"
FIELDS = {  # of an entry of the archive's directory: place and format
    **dict.fromkeys((4, 6, 8, 10, 12, 14, 28, 30, 32, 34, 36), "<H"),
    **dict.fromkeys((16, 20, 24, 38, 42), "<I"),
}
METHOD, FLAGS, SIZE = 10, 8, 24
DEEDS = st.sampled_from(["flip", "cut", "insert", "double", "field", "lie", "cipher", "method", "large", "end"])


@st.composite
def archives(draw):
    """A zip as a stranger may have made it, then damaged."""
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w") as writer, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of names that stand twice
        if draw(st.integers(0, 9)):
            writer.writestr("modelDescription.xml", DESCRIPTION, draw(st.sampled_from([0, 8])))
        for _ in range(draw(st.integers(0, 4))):
            entry = zipfile.ZipInfo()
            entry.filename = draw(ENTRIES)
            entry.compress_type = draw(st.sampled_from([0, 8, 8]))
            entry.external_attr = (draw(KINDS) | 0o644) << 16
            writer.writestr(entry, draw(CONTENTS))
    content = bytearray(made.getvalue())
    for _ in range(draw(st.integers(0, 3))):
        damage(draw, content)
    return bytes(content)


def damage(draw, content):
    entries = [found.start() for found in re.finditer(DIRECTORY, content) if found.start() <= len(content) - 46]
    at, end = draw(st.integers(0, max(0, len(content) - 1))), content.rfind(END)
    deed = draw(
        st.sampled_from(["flip", "cut", "insert", "double", "field", "lie", "cipher", "method", "large", "end"])
    )
    if not content:
        return
    if deed == "flip":
        content[at] ^= 1 << draw(st.integers(0, 7))
    elif deed == "cut":
        del content[at:]
    elif deed == "insert":
        content[at:at] = draw(st.binary(min_size=1, max_size=20))
    elif deed == "double":
        content += bytes(content)
    elif deed == "end" and 0 <= end <= len(content) - 22:
        place, form = draw(st.sampled_from([(4, "<H"), (8, "<H"), (10, "<H"), (12, "<I"), (16, "<I"), (20, "<H")]))
        struct.pack_into(form, content, end + place, draw(st.sampled_from([0, 1, 2, 0x7FFF, 0xFFFF])))
    elif entries and deed == "large":
        claim_large(draw, content, draw(st.sampled_from(entries)))
    elif entries:
        place = {"lie": SIZE, "cipher": FLAGS, "method": METHOD}.get(deed) or draw(st.sampled_from(sorted(FIELDS)))
        largest = 256 ** struct.calcsize(FIELDS[place]) - 1
        value = draw(st.sampled_from([0, 1, 8, 12, 14, 99, 1000, 0x800, largest]) | st.integers(0, largest))
        struct.pack_into(FIELDS[place], content, draw(st.sampled_from(entries)) + place, value)


def claim_large(draw, content, at):
    """Sizes and an offset of 64 bits in an entry of the directory."""
    name, extra = struct.unpack_from("<HH", content, at + 28)
    field = struct.pack("<HHQQQ", 1, 24, *(draw(LARGE) for _ in range(3)))
    struct.pack_into("<H", content, at + 30, (extra + len(field)) & 0xFFFF)
    for place in (20, 24, 42):
        if draw(st.booleans()):
            struct.pack_into("<I", content, at + place, 0xFFFFFFFF)
    content[at + 46 + name : at + 46 + name] = field
    end = content.rfind(END)
    if 0 <= end <= len(content) - 22:
        (size,) = struct.unpack_from("<I", content, end + 12)
        struct.pack_into("<I", content, end + 12, (size + len(field)) & 0xFFFFFFFF)


def everything_below(folder):
    return {place: place.read_bytes() if place.is_file() else b"" for place in folder.rglob("*")}


@pytest.fixture(autouse=True)
def less_is_enough(monkeypatch):
    monkeypatch.setattr(members, "MAX_SIZE", SMALL)


def test_any_archive_is_unpacked_into_its_folder_or_refused_by_name(explore, watched, confined):
    home = confined.parent
    path = home / "their.fmu"
    (home / "sentinel.txt").write_text("stay")

    def rule(content):
        path.write_bytes(content)
        before = everything_below(home)
        with Workspace() as place:
            with watched(confined):
                folder = unpacked(place)
            written = [found.lstat() for found in place.folder.rglob("*")]
            assert not any(stat.S_ISLNK(found.st_mode) for found in written)
            assert sum(found.st_size for found in written if stat.S_ISREG(found.st_mode)) <= SMALL
            assert bool(written) == (folder is not None), "nothing of a refused archive stays"
            assert folder is None or (folder / "modelDescription.xml").is_file()
        assert everything_below(home) == before

    def unpacked(place):
        try:
            return place.unpack(path)[0]
        except FmuFileError as error:
            message = str(error)
        assert message.startswith(str(path))
        return None

    explore(rule, archives(), quick=120, deep=1500)


@pytest.mark.parametrize("method", [zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_a_lie_about_a_size_costs_no_memory(confined, method):
    """What a chunk of bytes unpacks to may be thousands of times as large."""
    path, size = confined.parent / "their.fmu", 30_000_003
    with zipfile.ZipFile(path, "w") as made:
        made.writestr("modelDescription.xml", DESCRIPTION)
        made.writestr("resources/zeros", bytes(size), method)
    content = path.read_bytes()
    assert content.count(struct.pack("<I", size)) == 2
    path.write_bytes(content.replace(struct.pack("<I", size), struct.pack("<I", 1000)))
    tracemalloc.start()
    try:
        with Workspace() as place, pytest.raises(FmuFileError):
            place.unpack(path)
        assert tracemalloc.get_traced_memory()[1] < 8 << 20
    finally:
        tracemalloc.stop()
    assert not os.listdir(confined)
