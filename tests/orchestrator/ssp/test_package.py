"""Archives that are a danger or damaged: refused by name, and nothing is written outside."""

import os
import zipfile
import zlib

import pytest
from railcosim.orchestrator import ScenarioError
from railcosim.orchestrator.ssp import package, read_system
from railcosim.orchestrator.ssp.structure import MAX_DEPTH, MAX_ELEMENTS

from .conftest import binding, bindings, component, packed, parameters, structure, system


def refusal(path, folder):
    """What is said; beside `folder` nothing may appear."""
    around = [folder.parent, folder.parents[1]]
    before = [set(os.listdir(place)) for place in around]
    with pytest.raises(ScenarioError) as caught:
        read_system(path, folder)
    assert [set(os.listdir(place)) - {folder.name} for place in around] == [names - {folder.name} for names in before]
    return str(caught.value)


@pytest.mark.parametrize(
    ("source", "said"),
    [
        ("../outside.fmu", "source '../outside.fmu' is refused: it points outside the archive"),
        ("resources/../../outside.fmu", "is refused: it points outside the archive"),
        ("%2e%2e/outside.fmu", "is refused: it points outside the archive"),
        ("/etc/passwd", "is refused: it points outside the archive"),
        ("..%5Coutside.fmu", "is refused: it points outside the archive"),
        ("file:///etc/passwd", "source 'file:///etc/passwd' leads elsewhere; pack the file into the archive"),
        ("http://example.org/a.fmu", "leads elsewhere"),
        ("//host/a.fmu", "leads elsewhere"),
        ("http://[", "is no URI: "),
        ("resources/none.fmu", "source 'resources/none.fmu': there is no such file in "),
    ],
)
def test_sources_that_lead_elsewhere(archive, tmp_path, source, said):
    (tmp_path / "outside.fmu").write_bytes(b"")
    found = refusal(archive(structure(system(component("a", source=source)))), tmp_path / "fmus")
    assert "SystemStructure.ssd:4: " in found
    assert said in found


@pytest.mark.parametrize(
    ("name", "said"), [("../evil.txt", "points outside the archive"), ("/evil.txt", "points outside the archive")]
)
def test_entries_that_point_outside(archive, tmp_path, name, said):
    found = refusal(archive(structure(system(component("a"))), {name: "x"}), tmp_path / "fmus")
    assert f"system.ssp is refused: the entry '{name}' {said}" in found
    assert not (tmp_path / "evil.txt").exists()


def test_elements_a_thousand_deep(archive, tmp_path):
    """Within the parser's limit by our own, beyond it by the parser's."""
    for depth, said in ((MAX_DEPTH + 5, f"elements stand {MAX_DEPTH} deep in each other"), (1000, "it is not XML")):
        inside = component("a")
        for k in range(depth):
            inside = f'<ssd:System name="s{k}"><ssd:Elements>{inside}</ssd:Elements></ssd:System>'
        assert said in refusal(archive(structure(f"<ssd:Elements>{inside}</ssd:Elements>")), tmp_path / "fmus")


def test_structures_that_include_themselves(archive, tmp_path):
    again = component("a", source="SystemStructure.ssd", type="application/x-ssp-definition", shown=" ")
    assert "it is refused: it includes itself" in refusal(archive(structure(system(again))), tmp_path / "fmus")
    loop = system(component("a", source="#s", shown=" "), name="s").replace('name="s"', 'name="s" id="s"')
    top = structure(system(loop + component("b", source="#s", shown=" ")))
    assert "it is refused: it includes itself" in refusal(archive(top), tmp_path / "fmus")


def test_more_elements_than_any_system_has(archive, tmp_path, monkeypatch):
    monkeypatch.setattr("railcosim.orchestrator.ssp.structure.MAX_ELEMENTS", 3)
    assert MAX_ELEMENTS > 3
    found = refusal(archive(structure(system("".join(component(f"a{k}") for k in range(4))))), tmp_path / "fmus")
    assert "it is refused: it has over 3 elements" in found


def test_a_huge_parameter_set(archive, tmp_path, monkeypatch):
    monkeypatch.setattr(package, "MAX_DOCUMENT", 10_000)
    bound = bindings(binding("", source="resources/p.ssv"))
    text = parameters(("k", '<ssv:String value="' + "x" * 10_000 + '"/>'))
    found = refusal(archive(structure(system(component("a", bound))), {"resources/p.ssv": text}), tmp_path / "fmus")
    assert "system.ssp/resources/p.ssv: it is refused: it has more than 0 MiB" in found


@pytest.mark.parametrize("external", [False, True])
def test_xml_that_declares_entities(archive, tmp_path, external):
    bomb = '<!DOCTYPE b [<!ENTITY a "aaaa">' + ("<!ENTITY c SYSTEM 'file:///etc/passwd'>" * external) + "]>"
    text = structure(system(component("a"))).replace("?>\n", f"?>\n{bomb}\n")
    assert "it has a DOCTYPE, which may declare XML entities" in refusal(archive(text), tmp_path / "fmus")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("no xml", "SystemStructure.ssd: it is not XML in UTF-8"),
        (structure("").encode("utf-16"), "it is not XML in UTF-8"),
        ("<other/>", "SystemStructure.ssd:1: it is a other, not a SystemStructureDescription"),
        ('<SystemStructureDescription version="1.0"/>', "it has no System"),
        (structure(""), "it has no component with a source: there is nothing to run"),
        (structure(system(component("a") * 2)), "there are two elements 'a'; the other is at "),
        (
            structure(system(component("a", type="text/x-modelica"))),
            "is of type 'text/x-modelica', which is not supported",
        ),
        (
            structure(system(component("a", implementation="ModelExchange"))),
            "component 'a' is to be run by ModelExchange, and only co-simulation is; take an FMU for co-simulation",
        ),
    ],
)
def test_documents_that_are_none(archive, tmp_path, text, said):
    assert said in refusal(archive({"SystemStructure.ssd": text}), tmp_path / "fmus")


def test_files_that_are_no_archive(tmp_path):
    for content, said in (
        (b"no zip", "it is no SSP, which is a zip archive"),
        (packed({"a": ""}), "there is no System"),
    ):
        (tmp_path / "x.ssp").write_bytes(content)
        assert said in refusal(str(tmp_path / "x.ssp"), tmp_path / "fmus")
    assert "there is no file 'none.ssp'" in refusal("none.ssp", tmp_path / "fmus")


def test_a_damaged_archive(archive, tmp_path):
    """Bytes that do not fit their sum: of the structure, and of an FMU."""
    for name in ("SystemStructure.ssd", "resources/gadget.fmu"):
        path = archive(structure(system(component("a"))))
        with zipfile.ZipFile(path) as opened:
            entry = opened.getinfo(name)
        with open(path, "r+b") as stream:
            stream.seek(entry.header_offset + 30 + len(name) + entry.compress_size // 2)
            stream.write(zlib.compress(b"something else")[:8])
        assert "cannot be" in refusal(path, tmp_path / f"fmus{name[:1]}")


def test_an_fmu_that_is_none(archive, tmp_path):
    found = refusal(archive(structure(system(component("a"))), {"resources/gadget.fmu": "none"}), tmp_path / "fmus")
    assert "SystemStructure.ssd:4: " in found
    assert "gadget.fmu is not a usable FMU" in found


def test_places_that_cannot_be_read_or_written(archive, tmp_path, monkeypatch):
    path = archive(structure(system(component("a"))))
    (tmp_path / "taken").write_text("")
    assert "cannot be unpacked into" in refusal(path, tmp_path / "taken")

    def fails(*_):
        raise PermissionError(13, "not allowed")

    monkeypatch.setattr("railcosim.orchestrator.ssp.package.world.open", fails)
    assert "system.ssp: cannot be read: not allowed" in refusal(path, tmp_path / "fmus")


def test_what_is_unpacked_is_kept(archive, tmp_path):
    path = archive(structure(system(component("a"))))
    first = read_system(path, tmp_path / "fmus").instances["a"].model
    stamp = os.stat(first).st_mtime_ns
    assert read_system(path, tmp_path / "fmus").instances["a"].model == first
    assert os.stat(first).st_mtime_ns == stamp
