"""Nothing in an archive is trusted, and every refusal names the file; what leaves no doubt is put right."""

import os
import stat
import struct
import zipfile

import pytest
from railcosim.orchestrator.fmi import members

DESCRIPTION = {"modelDescription.xml": "<x/>"}


@pytest.mark.parametrize(
    "entry",
    [
        "../evil.txt",
        "resources/../../evil.txt",
        "/tmp/evil.txt",
        "C:/evil.txt",
        "C:evil.txt",
        "..\\evil.txt",
        "resources\\..\\..\\evil.txt",
        "\\evil.txt",
        "\\\\server\\share\\evil.txt",
        "//server/share/evil.txt",
    ],
)
def test_an_entry_that_points_outside_is_refused(refused, tmp_path, xml, entry):
    path = xml["write_archive"](tmp_path / "evil.fmu", DESCRIPTION | {entry: "gotcha"})
    assert f"the entry {entry!r} points outside the archive" in refused(path)
    assert not list(tmp_path.rglob("evil.txt"))


def test_a_name_with_dots_in_it_is_no_traversal(workspace, tmp_path, xml):
    path = xml["write_archive"](tmp_path / "a.fmu", DESCRIPTION | {"resources/a..b.txt": "7"})
    assert (workspace.unpack(path).folder / "resources" / "a..b.txt").exists()


def _with_link(path, target, files):
    entry = zipfile.ZipInfo("resources/link")
    entry.external_attr = 0o120777 << 16
    with zipfile.ZipFile(path, "w") as fmu:
        fmu.writestr("modelDescription.xml", "<x/>")
        fmu.writestr(entry, target)
        for name, content in files.items():
            fmu.writestr(name, content)
    return path


@pytest.mark.parametrize("target", ["/etc/passwd", "../../../etc/passwd", "gone", "link", ".", "x" * 5000])
def test_a_symbolic_link_that_leads_to_no_file_of_the_archive_is_refused(refused, tmp_path, target):
    said = refused(_with_link(tmp_path / "link.fmu", target, {}))
    assert "the entry 'resources/link' is a symbolic link to no file of the archive" in said


@pytest.mark.parametrize("target", ["../binaries/lib.so.1", "..\\binaries\\lib.so.1"])
def test_a_symbolic_link_becomes_the_file_that_it_leads_to(workspace, tmp_path, target):
    path = _with_link(tmp_path / "link.fmu", target, {"binaries/lib.so.1": "code"})
    place = workspace.unpack(path).folder / "resources" / "link"
    assert place.read_text() == "code"
    assert not place.is_symlink()


def test_a_bomb_is_refused_before_a_byte_is_written(refused, tmp_path, monkeypatch):
    path = tmp_path / "bomb.fmu"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as fmu:
        fmu.writestr("modelDescription.xml", "<x/>")
        fmu.writestr("resources/zeros", bytes(20 << 20))
    assert path.stat().st_size < 1 << 20
    monkeypatch.setattr(members, "MAX_SIZE", 10 << 20)
    assert "is refused: it unpacks to 0.0 GiB" in refused(path)


def test_a_bomb_that_lies_about_its_size_does_not_get_further(refused, tmp_path):
    """The sizes in the archive's directory are what is checked: an entry that holds more must not be written out."""
    path = tmp_path / "liar.fmu"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as fmu:
        fmu.writestr("modelDescription.xml", "<x/>")
        fmu.writestr("resources/zeros", bytes(20 << 20))
    content = bytearray(path.read_bytes())
    size, lie = struct.pack("<I", 20 << 20), struct.pack("<I", 1000)
    assert content.count(size) == 2  # its own header, and the archive's directory
    path.write_bytes(content.replace(size, lie))
    assert "is not a usable FMU" in refused(path)


def test_too_many_files_are_refused(refused, tmp_path, xml, monkeypatch):
    monkeypatch.setattr(members, "MAX_FILES", 10)
    path = xml["write_archive"](tmp_path / "many.fmu", DESCRIPTION | {f"resources/{k}": "" for k in range(10)})
    assert "is refused: it holds 11 files" in refused(path)


@pytest.mark.parametrize("name", ["modelDescription.xml", "./modelDescription.xml", ".//modelDescription.xml"])
def test_a_giant_description_is_refused(refused, tmp_path, xml, monkeypatch, name):
    monkeypatch.setattr(members, "MAX_DESCRIPTION", 1 << 20)
    path = xml["write_archive"](tmp_path / "big.fmu", {name: " " * (3 << 20)})
    assert "its modelDescription.xml is 3 MiB" in refused(path)


def test_a_damaged_entry(refused, tmp_path, xml):
    path = xml["write_archive"](tmp_path / "rot.fmu", DESCRIPTION | {"resources/data": b"0123456789" * 100})
    path.write_bytes(path.read_bytes().replace(b"0123456789", b"0123456780", 1))
    assert "is not a usable FMU: Bad CRC-32 for file 'resources/data'" in refused(path)


def test_a_file_where_a_folder_is_needed(refused, tmp_path, xml):
    path = xml["write_archive"](tmp_path / "clash.fmu", DESCRIPTION | {"resources": "file", "resources/data": "x"})
    assert "is refused: 'resources' in it is a file, and a folder of others as well" in refused(path)


@pytest.mark.parametrize("bits", [0, 0x10, 0o40755 << 16])
def test_a_folder_without_a_slash_is_a_folder(workspace, tmp_path, bits):
    path = tmp_path / "a.fmu"
    with zipfile.ZipFile(path, "w") as fmu:
        for name, content in [("modelDescription.xml", "<x/>"), ("resources", ""), ("resources\\a", "7")]:
            entry = zipfile.ZipInfo(name)
            entry.external_attr = 0 if content else bits
            fmu.writestr(entry, content)
    assert (workspace.unpack(path).folder / "resources" / "a").read_text() == "7"


def test_folders_of_the_standard_in_other_capitals(workspace, tmp_path, xml):
    files = {"Binaries/Linux64/a.so": "1", "RESOURCES/A.txt": "2", "resources/B": "3", "Other/c": "4"}
    found = workspace.unpack(xml["write_archive"](tmp_path / "a.fmu", DESCRIPTION | files))
    for name in ("binaries/linux64/a.so", "resources/A.txt", "resources/B", "Other/c"):
        assert (found.folder / name).is_file()
    assert [note.partition(": ")[2] for note in found.notes] == [
        "its folder 'Binaries/Linux64' is taken for 'binaries/linux64'",
        "its folder 'RESOURCES' is taken for 'resources'",
    ]


def test_an_unknown_compression(refused, tmp_path, xml):
    path = xml["write_archive"](tmp_path / "odd.fmu", DESCRIPTION)
    content = bytearray(path.read_bytes())
    content[8:10] = struct.pack("<H", 99)
    at = content.index(b"PK\x01\x02")
    content[at + 10 : at + 12] = struct.pack("<H", 99)
    path.write_bytes(content)
    assert "'modelDescription.xml' is compressed with method 99; FMI allows deflate" in refused(path)


@pytest.mark.parametrize(("method", "name"), [(zipfile.ZIP_BZIP2, "bzip2"), (zipfile.ZIP_LZMA, "lzma")])
def test_a_compression_that_unpacks_without_bounds(refused, tmp_path, method, name):
    """A kilobyte of bzip2 that claims to be small would take gigabytes of memory before the lie is seen."""
    path = tmp_path / "bomb.fmu"
    with zipfile.ZipFile(path, "w") as fmu:
        fmu.writestr("modelDescription.xml", "<x/>")
        fmu.writestr("resources/zeros", bytes(1 << 20), compress_type=method)
    assert f"'resources/zeros' is compressed with {name}; FMI allows deflate" in refused(path)


def test_an_entry_without_a_name(refused, tmp_path):
    path = tmp_path / "nameless.fmu"
    with zipfile.ZipFile(path, "w") as fmu:
        fmu.writestr("modelDescription.xml", "<x/>")
        fmu.writestr("x", "y")
    path.write_bytes(path.read_bytes().replace(b"xy", b"\0y").replace(b"xPK\5\6", b"\0PK\5\6"))
    assert "is refused: it holds an entry without a name" in refused(path)


@pytest.mark.parametrize("entry", ["f/" * 900, "f/" * 900 + "file"])
def test_folders_in_folders_without_end(refused, tmp_path, xml, entry):
    path = xml["write_archive"](tmp_path / "deep.fmu", DESCRIPTION | {entry: ""})
    assert "levels deep, 'f/f/f/" in refused(path)


def test_zeros_without_end_are_refused_long_before_they_fill_a_disk(refused, tmp_path, monkeypatch):
    monkeypatch.setattr(members, "SMALL", 1 << 20)
    path = tmp_path / "bomb.fmu"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as fmu:
        fmu.writestr("modelDescription.xml", "<x/>")
        fmu.writestr("resources/zeros", bytes(20 << 20))
    assert "times its size" in refused(path)


def test_links_to_one_large_file_count_as_often_as_they_are(refused, tmp_path, monkeypatch):
    monkeypatch.setattr(members, "MAX_SIZE", 1500)
    path = _with_link(tmp_path / "link.fmu", "large", {"resources/large": "x" * 1000})
    assert "is refused: it unpacks to" in refused(path)


@pytest.mark.skipif(os.name == "nt", reason="Windows knows no run bits")
@pytest.mark.parametrize(
    ("mode", "content", "runs"),
    [
        (0o755, "x", True),
        (0o4711, "x", True),
        (0o644, "#!/bin/sh", True),
        (0o600, "\x7fELF", True),
        (0o600, "x", False),
        (0, "#!/bin/sh", True),
        (0, "x", False),
    ],
)
def test_what_may_be_run_may_be_run_here(workspace, tmp_path, mode, content, runs):
    """Programs are known by their beginning: what an archive says of modes is often what the tool that made it says."""
    entry = zipfile.ZipInfo("resources/helper")
    entry.external_attr = (stat.S_IFREG | mode) << 16 if mode else 0
    path = tmp_path / "a.fmu"
    with zipfile.ZipFile(path, "w") as fmu:
        fmu.writestr("modelDescription.xml", "<x/>")
        fmu.writestr(entry, content)
    if not mode:  # zipfile gives every member a mode
        data = path.read_bytes()
        path.write_bytes(data.replace((0o600 << 16).to_bytes(4, "little"), bytes(4)))
    found = (workspace.unpack(path).folder / "resources" / "helper").stat().st_mode
    assert bool(found & 0o111) == runs
    assert not found & 0o6000
    assert found & 0o400


def test_backslashes_are_taken_for_folders(workspace, tmp_path, xml):
    files = {"binaries\\win64\\a.dll": "code", "resources\\": "", "resources\\a b\\c.txt": "7"}
    found = workspace.unpack(xml["write_archive"](tmp_path / "a.fmu", DESCRIPTION | files))
    assert (found.folder / "binaries" / "win64" / "a.dll").read_text() == "code"
    assert (found.folder / "resources" / "a b" / "c.txt").read_text() == "7"
    assert "it has paths with backslashes, which a zip may not have" in found.notes[0]


def test_an_empty_folder_is_there(workspace, tmp_path, xml):
    path = xml["write_archive"](tmp_path / "a.fmu", DESCRIPTION | {"resources/": "", "./documentation/": ""})
    assert (workspace.unpack(path).folder / "resources").is_dir()
    assert (workspace.unpack(path).folder / "documentation").is_dir()


@pytest.mark.parametrize("more", [{}, {"__MACOSX/._model": "x"}])
def test_a_packed_folder_is_read_from_where_it_is(workspace, tmp_path, xml, more):
    files = {"my model/": "", "my model/modelDescription.xml": "<x/>", "my model/resources/a": "7"}
    found = workspace.unpack(xml["write_archive"](tmp_path / "a.fmu", files | more))
    assert (found.folder / "modelDescription.xml").is_file()
    assert (found.folder / "resources" / "a").read_text() == "7"
    assert found.notes[0].endswith(
        "all of it stands in a folder 'my model', which an FMU may not have; it is read from there"
    )


def test_a_description_in_other_capitals(workspace, tmp_path, xml):
    found = workspace.unpack(xml["write_archive"](tmp_path / "a.fmu", {"modeldescription.XML": "<x/>"}))
    assert (found.folder / "modelDescription.xml").is_file()
    assert found.notes[0].endswith("its modeldescription.XML is taken for modelDescription.xml")


@pytest.mark.filterwarnings("ignore:Duplicate name")
@pytest.mark.parametrize(("second", "told"), [("8", True), ("7", False)])
def test_of_two_members_of_one_name_the_last_counts(workspace, tmp_path, second, told):
    path = tmp_path / "a.fmu"
    with zipfile.ZipFile(path, "w") as fmu:
        for name, content in [("modelDescription.xml", "<x/>"), ("resources/a", "7"), ("resources/a", second)]:
            fmu.writestr(name, content)
    found = workspace.unpack(path)
    assert (found.folder / "resources" / "a").read_text() == second
    assert [note.endswith("it holds 'resources/a' 2 times; the last counts") for note in found.notes] == [True] * told


def test_members_that_differ_in_capitals_only_are_told(workspace, tmp_path, xml):
    files = {"resources/A.txt": "1", "resources/a.txt": "2"}
    found = workspace.unpack(xml["write_archive"](tmp_path / "a.fmu", DESCRIPTION | files))
    assert "'resources/A.txt' and 'resources/a.txt' are one file where capitals do not count" in found.notes[0]


def test_a_password(refused, tmp_path, xml):
    path = xml["write_archive"](tmp_path / "a.fmu", DESCRIPTION)
    content = bytearray(path.read_bytes())
    content[content.index(b"PK\x01\x02") + 8] |= 1
    path.write_bytes(content)
    assert "'modelDescription.xml' is encrypted; pack it without a password" in refused(path)


def test_a_pointer_in_place_of_a_library(refused, tmp_path, xml):
    pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n"
    path = xml["write_archive"](tmp_path / "a.fmu", DESCRIPTION | {"binaries/linux64/a.so": pointer})
    assert "holds a Git LFS pointer in place of 'binaries/linux64/a.so'; fetch that" in refused(path)
