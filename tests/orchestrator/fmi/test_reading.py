"""A description is read in parts: the same comes out as of the whole, and it takes little memory."""

import subprocess
import sys
import tracemalloc
from pathlib import Path

import pytest
from railcosim.orchestrator.errors import FmuFileError
from railcosim.orchestrator.fmi import document
from railcosim.orchestrator.fmi.reader import read_interface

FOREIGN = Path(__file__).parents[1] / "foreign"
UNITS = '<UnitDefinitions><Unit name="m"><BaseUnit m="1"/></Unit></UnitDefinitions>'
TYPES = '<TypeDefinitions><SimpleType name="Length"><Real unit="m" max="9"/></SimpleType></TypeDefinitions>'


def variables(count):
    rows = (
        f'<ScalarVariable name="plant.value_{k}" valueReference="{k}" causality="output" description="of part {k}">'
        "<Real unit='m'/></ScalarVariable>\n"
        for k in range(count)
    )
    return f"<ModelVariables>{''.join(rows)}</ModelVariables>"


def structure(count, depends='dependencies=""'):
    rows = "\n".join(f'<Unknown index="{k + 1}" {depends}/>' for k in range(count))
    return (
        f"<ModelStructure><Outputs>{rows}</Outputs><InitialUnknowns>{rows}</InitialUnknowns></ModelStructure>"
        if count
        else "<ModelStructure/>"
    )


def text(*parts):
    head = '<fmiModelDescription fmiVersion="2.0" modelName="m" guid="g">\n<CoSimulation modelIdentifier="m"/>\n'
    return head + "\n".join(parts) + "\n</fmiModelDescription>\n"


FAULTY = """<ModelVariables>
<ScalarVariable name="a" valueReference="1" causality="parameter"><Real start="1,5" unit="m"/></ScalarVariable>
<!-- a comment --><Else/>
<ScalarVariable valueReference="2" causality="none"><Real declaredType="Length"/></ScalarVariable>
<ScalarVariable name="a" valueReference="3" variability="discrete"><Boolean start="TRUE"/></ScalarVariable>
<ScalarVariable name="b" valueReference="4" colour="red"><Real derivative="9"/></ScalarVariable>
<ScalarVariable name="c" valueReference="5"><Annotations/><Real derivative="1" displayUnit="km"/></ScalarVariable>
<ScalarVariable name="d" valueReference="6"><Real declaredType="Gone"/></ScalarVariable>
<ScalarVariable name="e" valueReference="7" causality="output"><Real/></ScalarVariable>
<ScalarVariable name="f" valueReference="8" causality="output"><Real/></ScalarVariable>
</ModelVariables>"""
LISTED = """<ModelStructure><Outputs>
<Unknown index="77"/><Unknown index="7" dependencies="1 88 2"/><Unknown index="8" dependencies="x"/>
<Unknown index="7" colour="red"/><Unknown index="8"/>
</Outputs></ModelStructure>"""
FILES = {
    "plain": text(UNITS, variables(9), structure(9, 'dependencies="1 2"')),
    "faulty": text(UNITS, TYPES, FAULTY, LISTED),
    "units behind": text(variables(5), UNITS, structure(5)),
    "types behind": text(FAULTY, TYPES, LISTED, UNITS),
    "structure before": text(UNITS, structure(6, 'dependencies="6"'), variables(6)),
    **{name: (FOREIGN / f"{name}.xml").read_text(encoding="utf-8") for name in ("fmi1", "fmi3", "arrays3")},
}


@pytest.fixture
def reading(tmp_path):
    def read(content):
        (tmp_path / "modelDescription.xml").write_text(content, encoding="utf-8")
        return read_interface(tmp_path, "their.fmu")

    return read


@pytest.mark.parametrize("name", FILES)
def test_parts_give_what_the_whole_gives(reading, monkeypatch, name):
    whole = reading(FILES[name])
    monkeypatch.setattr(document, "PART", 2)
    monkeypatch.setattr(document, "_PIECE", 100)
    parts = reading(FILES[name])
    assert parts.variables == whole.variables
    assert list(parts.variables) == list(whole.variables)
    assert (parts.units, parts.arrays, parts.left_out) == (whole.units, whole.arrays, whole.left_out)
    # Of elements in a wrong place the schema may say more where it is asked part by part.
    told = [[text for text in it.warnings if not text.endswith("more kinds of faults")] for it in (parts, whole)]
    assert sorted(told[0]) == sorted(told[1])
    assert len(parts.variables) > 2


def test_of_a_long_file_only_parts_are_in_memory_as_xml(tmp_path, monkeypatch):
    """And all elements come once, in their order."""
    monkeypatch.setattr(document, "PART", 10)
    monkeypatch.setattr(document, "_PIECE", 1000)
    (tmp_path / "modelDescription.xml").write_text(text(variables(500), structure(500)), encoding="utf-8")
    found, most = [], 0

    def take(root, section, elements):
        nonlocal most
        most = max(most, sum(1 for _ in root.iter()))
        found.extend(e.get("name") for e in elements if section == "ModelVariables")

    root, _ = document.parse(tmp_path / "modelDescription.xml", "their.fmu", take)
    assert most < 120
    assert found + [e.get("name") for e in root.find("ModelVariables")] == [f"plant.value_{k}" for k in range(500)]


def test_a_doctype_is_refused_before_the_file_is_read_on(tmp_path, monkeypatch):
    monkeypatch.setattr(document, "_PIECE", 200)
    content = text(variables(20)).replace("<fmi", '<!DOCTYPE x [<!ENTITY a "b">]>\n<fmi', 1).replace("value_9", "<")
    (tmp_path / "modelDescription.xml").write_text(content, encoding="utf-8")
    with pytest.raises(FmuFileError, match="DOCTYPE"):
        document.parse(tmp_path / "modelDescription.xml", "their.fmu", lambda *_: None)


def test_a_variable_takes_little_memory(reading):
    """Of Python's; it took 5 kB at most, and 1.5 kB in the end. What XML takes on the way is bounded by the parts."""
    count = 3_000
    content = text(UNITS, variables(count), structure(count))
    reading(content)  # what is imported
    tracemalloc.start()
    try:
        it = reading(content)
        kept, most = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert len(it.variables) == count
    assert kept / count < 520
    assert most / count < 1500


READ = """
import sys, time
from pathlib import Path
from xml.parsers import expat
from railcosim.orchestrator.fmi.reader import read_interface
begin = time.process_time()
with open(f"{sys.argv[1]}/modelDescription.xml", "rb") as stream:
    parser = expat.ParserCreate()
    parser.StartElementHandler = lambda name, attributes: None
    parser.ParseFile(stream)
bare, begin = time.process_time() - begin, time.process_time()
it = read_interface(Path(sys.argv[1]), "their.fmu")
taken = time.process_time() - begin
peak = next(line.split()[1] for line in open("/proc/self/status") if line.startswith("VmHWM"))  # since it was started
print(len(it.variables), bare, taken, peak)
"""


@pytest.mark.long
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="units of memory are Linux's")
def test_a_million_variables(tmp_path):
    """In the time of few bare parses (4.6 of them) and 0.8 GB; once it took 8 GB."""
    (tmp_path / "modelDescription.xml").write_text(text(UNITS, variables(10**6), structure(10**6)), encoding="utf-8")
    ran = subprocess.run([sys.executable, "-c", READ, str(tmp_path)], capture_output=True, text=True, check=True)
    count, bare, taken, kilobytes = map(float, ran.stdout.split())
    assert count == 10**6
    assert taken < 8.0 * bare
    assert kilobytes < 1e6
