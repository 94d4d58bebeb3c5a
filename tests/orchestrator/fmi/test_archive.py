"""Nothing in an archive is trusted, and every refusal names the file."""

import os
import struct
import zipfile
from pathlib import Path

import pytest
from railcosim.orchestrator.errors import FmuFileError
from railcosim.orchestrator.fmi import archive
from railcosim.orchestrator.fmi.archive import Workspace

DESCRIPTION = {"modelDescription.xml": "<x/>"}


def refused(workspace, path):
    with pytest.raises(FmuFileError) as caught:
        workspace.unpack(path)
    assert str(path) in str(caught.value)
    assert not list(workspace.folder.iterdir()), "nothing of a refused archive stays"
    return str(caught.value)


def test_an_archive_is_unpacked_once_however_often_it_is_asked_for(workspace, tmp_path, xml):
    path = xml["write_archive"](tmp_path / "a.fmu", DESCRIPTION | {"resources/data.txt": "7"})
    copy = tmp_path / "copy.fmu"
    copy.write_bytes(path.read_bytes())
    folder, digest = workspace.unpack(path)
    assert (folder / "resources" / "data.txt").read_text() == "7"
    assert workspace.unpack(copy) == (folder, digest)
    assert len(digest) == 64
    assert folder.is_relative_to(workspace.folder)


def test_a_workspace_leaves_nothing(tmp_path, xml):
    with Workspace() as workspace:
        workspace.unpack(xml["write_archive"](tmp_path / "a.fmu", DESCRIPTION))
        folder = workspace.folder
        assert folder.exists()
    assert not folder.exists()


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
def test_an_entry_that_points_outside_is_refused(workspace, tmp_path, xml, entry):
    path = xml["write_archive"](tmp_path / "evil.fmu", DESCRIPTION | {entry: "gotcha"})
    assert f"the entry {entry!r} points outside the archive" in refused(workspace, path)
    assert not list(tmp_path.rglob("evil.txt"))


def test_a_name_with_dots_in_it_is_no_traversal(workspace, tmp_path, xml):
    path = xml["write_archive"](tmp_path / "a.fmu", DESCRIPTION | {"resources/a..b.txt": "7"})
    assert (workspace.unpack(path)[0] / "resources" / "a..b.txt").exists()


def test_a_symbolic_link_is_refused(workspace, tmp_path):
    entry = zipfile.ZipInfo("resources/link")
    entry.external_attr = 0o120777 << 16
    path = tmp_path / "link.fmu"
    with zipfile.ZipFile(path, "w") as fmu:
        fmu.writestr("modelDescription.xml", "<x/>")
        fmu.writestr(entry, "/etc/passwd")
    assert "the entry 'resources/link' is a symbolic link" in refused(workspace, path)


def test_a_bomb_is_refused_before_a_byte_is_written(workspace, tmp_path, monkeypatch):
    path = tmp_path / "bomb.fmu"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as fmu:
        fmu.writestr("modelDescription.xml", "<x/>")
        fmu.writestr("resources/zeros", bytes(20 << 20))
    assert path.stat().st_size < 1 << 20
    monkeypatch.setattr(archive, "MAX_SIZE", 10 << 20)
    assert "is refused: it unpacks to 0.0 GiB" in refused(workspace, path)


def test_a_bomb_that_lies_about_its_size_does_not_get_further(workspace, tmp_path):
    """The sizes in the archive's directory are what is checked: an entry that holds more must not be written out."""
    path = tmp_path / "liar.fmu"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as fmu:
        fmu.writestr("modelDescription.xml", "<x/>")
        fmu.writestr("resources/zeros", bytes(20 << 20))
    content = bytearray(path.read_bytes())
    size, lie = struct.pack("<I", 20 << 20), struct.pack("<I", 1000)
    assert content.count(size) == 2  # its own header, and the archive's directory
    path.write_bytes(content.replace(size, lie))
    assert "is not a usable FMU" in refused(workspace, path)


def test_too_many_files_are_refused(workspace, tmp_path, xml, monkeypatch):
    monkeypatch.setattr(archive, "MAX_FILES", 10)
    path = xml["write_archive"](tmp_path / "many.fmu", DESCRIPTION | {f"resources/{k}": "" for k in range(10)})
    assert "is refused: it holds 11 files" in refused(workspace, path)


@pytest.mark.parametrize("name", ["modelDescription.xml", "./modelDescription.xml", ".//modelDescription.xml"])
def test_a_giant_description_is_refused(workspace, tmp_path, xml, monkeypatch, name):
    monkeypatch.setattr(archive, "MAX_DESCRIPTION", 1 << 20)
    path = xml["write_archive"](tmp_path / "big.fmu", {name: " " * (3 << 20)})
    assert "its modelDescription.xml is 3 MiB" in refused(workspace, path)


def test_no_description(workspace, tmp_path, xml):
    path = xml["write_archive"](tmp_path / "empty.fmu", {"readme.txt": "hello"})
    assert refused(workspace, path).endswith("is not an FMU: it holds no modelDescription.xml")


def test_not_a_zip(workspace, tmp_path):
    path = tmp_path / "pointer.fmu"
    path.write_text("version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n")
    assert "is not a usable FMU: File is not a zip file" in refused(workspace, path)


@pytest.mark.parametrize("kept", [0.0, 0.3, 0.9, 0.99])
def test_a_truncated_zip(workspace, tmp_path, xml, kept):
    path = xml["write_archive"](tmp_path / "cut.fmu", DESCRIPTION | {"resources/data": os.urandom(5000)})
    path.write_bytes(path.read_bytes()[: int(kept * path.stat().st_size)])
    assert "is not a usable FMU" in refused(workspace, path)


def test_a_damaged_entry(workspace, tmp_path, xml):
    path = xml["write_archive"](tmp_path / "rot.fmu", DESCRIPTION | {"resources/data": b"0123456789" * 100})
    path.write_bytes(path.read_bytes().replace(b"0123456789", b"0123456780", 1))
    assert "is not a usable FMU: Bad CRC-32 for file 'resources/data'" in refused(workspace, path)


def test_a_file_where_a_folder_is_needed(workspace, tmp_path, xml):
    path = xml["write_archive"](tmp_path / "clash.fmu", DESCRIPTION | {"resources": "file", "resources/data": "x"})
    assert "is not a usable FMU" in refused(workspace, path)


def test_an_unknown_compression(workspace, tmp_path, xml):
    path = xml["write_archive"](tmp_path / "odd.fmu", DESCRIPTION)
    content = bytearray(path.read_bytes())
    content[8:10] = struct.pack("<H", 99)
    at = content.index(b"PK\x01\x02")
    content[at + 10 : at + 12] = struct.pack("<H", 99)
    path.write_bytes(content)
    assert "'modelDescription.xml' is compressed with method 99; FMI allows deflate" in refused(workspace, path)


@pytest.mark.parametrize(("method", "name"), [(zipfile.ZIP_BZIP2, "bzip2"), (zipfile.ZIP_LZMA, "lzma")])
def test_a_compression_that_unpacks_without_bounds(workspace, tmp_path, method, name):
    """A kilobyte of bzip2 that claims to be small would take gigabytes of memory before the lie is seen."""
    path = tmp_path / "bomb.fmu"
    with zipfile.ZipFile(path, "w") as fmu:
        fmu.writestr("modelDescription.xml", "<x/>")
        fmu.writestr("resources/zeros", bytes(1 << 20), compress_type=method)
    assert f"'resources/zeros' is compressed with {name}; FMI allows deflate" in refused(workspace, path)


def test_an_entry_without_a_name(workspace, tmp_path):
    path = tmp_path / "nameless.fmu"
    with zipfile.ZipFile(path, "w") as fmu:
        fmu.writestr("modelDescription.xml", "<x/>")
        fmu.writestr("x", "y")
    path.write_bytes(path.read_bytes().replace(b"xy", b"\0y").replace(b"xPK\5\6", b"\0PK\5\6"))
    assert "is refused: it holds an entry without a name" in refused(workspace, path)


@pytest.mark.parametrize("entry", ["f/" * 900, "f/" * 900 + "file"])
def test_folders_in_folders_without_end(workspace, tmp_path, xml, entry):
    path = xml["write_archive"](tmp_path / "deep.fmu", DESCRIPTION | {entry: ""})
    assert "levels deep, 'f/f/f/" in refused(workspace, path)


def test_no_such_file(workspace, tmp_path):
    assert refused(workspace, tmp_path / "missing.fmu").endswith("cannot be read: No such file or directory")
    assert refused(workspace, tmp_path).endswith("cannot be read: Is a directory")


def test_fmus_are_unpacked_to_a_plain_place_whatever_the_user_s_is_called(monkeypatch, tmp_path):
    """A Python FMU crashes the process below a folder whose name a URI must encode."""
    odd = tmp_path / "größe (1) + #100%"
    odd.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(odd))
    with Workspace() as workspace:
        assert not workspace.folder.is_relative_to(odd)
        assert str(workspace.folder).isascii()
        assert not set("()+#%") & set(str(workspace.folder))


def test_without_a_plain_place_there_is_one_clear_sentence(monkeypatch, tmp_path):
    odd = tmp_path / "größe"
    odd.mkdir()
    monkeypatch.setattr("tempfile.mkdtemp", lambda prefix, dir: str(odd))
    monkeypatch.setattr(Path, "rmdir", lambda self: None)
    with pytest.raises(FmuFileError, match="need a path of plain ASCII letters; set TMPDIR"):
        Workspace()
