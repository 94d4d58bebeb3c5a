"""A file that is no FMU is told for what it is, with what to do."""

import gzip
import io
import os
import tarfile

import pytest
from railcosim.orchestrator.fmi.recognition import is_fmu_name


def _tar():
    stream = io.BytesIO()
    with tarfile.open(fileobj=stream, mode="w") as made:
        made.addfile(tarfile.TarInfo("modelDescription.xml"))
    return stream.getvalue()


@pytest.mark.parametrize(
    ("content", "what"),
    [
        (b"", "is empty; download"),
        (
            b"version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 9\n",
            "is a Git LFS pointer, .*'git lfs pull'",
        ),
        (b"/annex/objects/SHA256E-s9--4d7a.fmu\n", "is a git-annex pointer, .*'git annex get'"),
        (b"\n<!DOCTYPE html><html>", "is a web page"),
        (b"\xef\xbb\xbf<HTML lang='de'>", "is a web page"),
        (gzip.compress(b"x", mtime=0), "is compressed with gzip"),
        (_tar(), "is a tar archive"),
        (b"7z\xbc\xaf\x27\x1c..", "is a 7z archive"),
        (b"\x7fELF..", "is a program or a shared library"),
        (b'<?xml version="1.0"?>\n<fmiModelDescription fmiVersion="2.0">', "is a model description alone; zip"),
        (b"something else", "is not a usable FMU: File is not a zip file"),
    ],
)
def test_what_a_file_is(refused, tmp_path, content, what):
    path = tmp_path / "a.fmu"
    path.write_bytes(content)
    with pytest.raises(AssertionError, match=what):
        raise AssertionError(refused(path))


@pytest.mark.parametrize("kept", [0.3, 0.9, 0.99])
def test_a_truncated_zip(refused, tmp_path, xml, kept):
    path = xml["write_archive"](
        tmp_path / "cut.fmu", {"modelDescription.xml": "<x/>", "resources/data": os.urandom(5000)}
    )
    path.write_bytes(path.read_bytes()[: int(kept * path.stat().st_size)])
    assert "is a zip archive without its end, as if cut short; download or copy it once more" in refused(path)


@pytest.mark.parametrize(
    ("names", "what"),
    [
        (["readme.txt"], "is not an FMU: it holds no modelDescription.xml"),
        (["SystemStructure.ssd", "resources/a.fmu"], "is an SSP, a system of 1 FMUs; call it .ssp, or unpack it"),
        (["models/Train.FMU"], "is an archive with an FMU in it; unpack it and name 'models/Train.FMU'"),
        (["a/b/modelDescription.xml"], "its model description is 'a/b/modelDescription.xml'; zip its folder"),
        (["a/modelDescription.xml", "b/x"], "its model description is 'a/modelDescription.xml'; zip its folder"),
    ],
)
def test_what_an_archive_is(refused, tmp_path, xml, names, what):
    assert what in refused(xml["write_archive"](tmp_path / "a.fmu", dict.fromkeys(names, "x")))


@pytest.mark.parametrize(("name", "it_is"), [("a.fmu", True), ("A.FMU", True), ("b/a.Fmu", True), ("fmu", False)])
def test_the_name_of_an_fmu(name, it_is):
    assert is_fmu_name(name) == it_is
