"""Model descriptions of strangers: whatever they say, they are used or refused by name, and no entity is replaced."""

import copy
import io
import zipfile
from pathlib import Path

import fmpy
import pytest
from hypothesis import strategies as st
from lxml import etree
from railcosim.fmus.build import plain
from railcosim.orchestrator.cli.printing import show_interface
from railcosim.orchestrator.errors import FmuFileError, RailcosimError
from railcosim.orchestrator.fmi.archive import Workspace
from railcosim.orchestrator.fmi.reader import read_interface
from railcosim.orchestrator.run.checking import check
from railcosim.orchestrator.system import System
from rich.console import Console

FOREIGN = Path(__file__).parents[1] / "foreign"


def words(text):
    return st.sampled_from(text.split())


UNITS = (
    '<Unit name="km"><BaseUnit m="1" factor="1000"/><DisplayUnit name="mm" factor="0.001"/></Unit>'
    '<Unit name="degC"><BaseUnit K="1" offset="273.15"/></Unit><Unit name="odd"/>'
)
TYPES = (
    '<TypeDefinitions><SimpleType name="T"><Real unit="km" min="0"/></SimpleType><SimpleType name="E"><Enumeration>'
    '<Item name="a" value="1"/><Item name="b" value="2"/></Enumeration></SimpleType></TypeDefinitions>'
)
TAGS = words(
    "Real Integer Boolean String Enumeration ScalarVariable Unknown Unit BaseUnit DisplayUnit Tool component Item "
    "CoSimulation ModelExchange SimpleType Float64 UInt8 Int64 Binary Clock Dimension Alias Start Foo {http://x}y "
    "Outputs Annotations DirectDependency Output InitialUnknown SourceFiles File ModelVariables ModelStructure"
)
ATTRIBUTES = words(
    "name valueReference causality variability initial start min max nominal unit displayUnit declaredType derivative "
    "index dependencies dependenciesKind factor offset m K fmiVersion modelName guid modelIdentifier recommendedStep "
    "arguments optionalInputs sampled kind quantity relativeQuantity canGetAndSetFMUstate stepSize value foo alias "
    "clocks instantiationToken"
)
GIVEN = st.one_of(
    words(
        "0 1 -1 2 99 4294967295 4294967296 18446744073709551616 1e400 nan inf -inf 0.5 1.5 1e-320 true false True yes "
        "a y u i time x[1] x[99999999999] x[1,2] x[1 der(y) a.b input output parameter local independent "
        "calculatedParameter fixed tunable constant discrete continuous exact approx calculated km m ../../etc/passwd "
        "/etc/passwd 1,5 0x10 1_0 ٣ 1.0 2.0 3.0 [[ {} [1] null E T CON sample_time"
    ),
    st.sampled_from(["", " ", "x y", "1 2", "0 -1", "\n", "9" * 5000, "x" * 5000, f"x[{'1' * 5000}]", "[" * 3000]),
    st.text(st.characters(exclude_categories=["Cs", "Cc"], exclude_characters="\ufffe\uffff"), max_size=5),
)
DEEDS = (
    *["give"] * 6,
    *(
        "take",
        "copy",
        "remove",
        "double",
        "move",
        "rename",
        "insert",
        "comment",
        "instruct",
        "fill",
        "nest",
        "multiply",
    ),
)
TORN = st.binary(max_size=3) | st.sampled_from([b"&x;", b"<", b"&#0;", b"<!DOCTYPE x>", b"<![CDATA[", b"\0", b"\xff"])
ENCODINGS = st.sampled_from([*["UTF-8"] * 8, "UTF-16", "ISO-8859-1", "US-ASCII", "UTF-32"])


def change(draw, root):  # noqa: PLR0912 (one a deed)
    """One change of a description: what somebody's tool may have done, or somebody who means no good."""
    elements = [element for element in root.iter() if isinstance(element.tag, str)]
    tag = draw(st.sampled_from(sorted({element.tag for element in elements})))  # there is but one of some
    alike = [element for element in elements if element.tag == tag]
    it, other = (found[draw(st.integers(0, len(found) - 1))] for found in (alike, elements))
    parent, deed = it.getparent(), draw(st.sampled_from(DEEDS))
    own = sorted(it.attrib)
    if deed == "give":
        it.set(draw(st.sampled_from(own) | ATTRIBUTES if own else ATTRIBUTES), draw(GIVEN))
    elif deed == "take" and own:
        del it.attrib[draw(st.sampled_from(own))]
    elif deed == "copy":
        it.attrib.update({key: value for key, value in other.attrib.items() if key in it.attrib})
    elif deed == "rename":
        it.tag = draw(TAGS)
    elif deed == "insert":
        it.insert(draw(st.integers(0, len(it))), etree.Element(draw(TAGS), {draw(ATTRIBUTES): draw(GIVEN)}))
    elif deed == "comment":
        it.insert(draw(st.integers(0, len(it))), etree.Comment("x"))
    elif deed == "instruct":
        it.insert(draw(st.integers(0, len(it))), etree.ProcessingInstruction("x", "y"))
    elif deed == "fill":
        it.text = "1 & < x"
    elif deed == "nest":
        for _ in range(draw(st.sampled_from([10, 300]))):
            it = etree.SubElement(it, "a")
    elif parent is None:
        pass
    elif deed == "remove":
        parent.remove(it)
    elif deed == "move" and it is not other and it not in other.iterancestors():
        other.insert(0, it)
    elif deed in ("double", "multiply"):
        for _ in range(200 if deed == "multiply" else 1):
            parent.insert(draw(st.just(0) | st.integers(0, len(parent))), copy.deepcopy(it))


@st.composite
def descriptions(draw, bases):
    """A valid description with some changes, in any encoding, and rarely with some bytes that do not belong there."""
    root = etree.fromstring(draw(st.sampled_from(bases)))
    for _ in range(draw(st.integers(0, 4))):
        change(draw, root)
    content = bytearray(etree.tostring(root, xml_declaration=True, encoding=draw(ENCODINGS)))
    for _ in range(draw(st.sampled_from([*[0] * 6, 1]))):
        at = draw(st.integers(0, len(content)))
        content[at : at + draw(st.integers(0, 2))] = draw(TORN)
    return bytes(content)


STARTS = st.sampled_from([0, 1, -1, 2**40, 10**400, 0.5, float("nan"), True, "x", "i", [1, 2], [[1]], "", 1e300])
USES = st.lists(st.tuples(st.integers(0, 999), st.integers(0, 999), STARTS), max_size=4)


@pytest.fixture(scope="module")
def bases(xml):
    """Descriptions of ours and of others, of every version of FMI."""
    v = xml["variable"]
    exact = {"variability": "fixed", "initial": "exact"}
    variables = [
        v("gain", "parameter", start="2.5", min="0", max="9", **exact),
        v("u", "input", start="0.0", unit="km"),
        v("n", "input", "Integer", start="3"),
        v("on", "input", "Boolean", start="true"),
        v("label", "parameter", "String", start="hi", **exact),
        v("y", "output", unit="degC", dependencies=["u", "n"]),
        v("x[1]", "output", dependencies=[]),
        v("x[2]", "output", unit="odd"),
        v("k", "output", "Integer"),
        v("limit", "local", start="1", variability="constant", initial="exact"),
    ]
    foreign = xml["description"](variables, UNITS, simulation='canGetAndSetFMUstate="true"')
    typed = foreign.replace("<ModelVariables>", f"{TYPES}<DefaultExperiment stepSize='0.1'/><ModelVariables>")
    ours = [plain(name, build).description for name, build in (("Sensor", {}), ("Schedule", {"points": 2}))]
    others = [path.read_bytes() for path in sorted(FOREIGN.glob("fmi?.xml"))]
    return [foreign.encode(), typed.encode(), *ours, *others]


def test_any_description_is_used_or_refused_by_name(explore, bases, watched, confined):
    path = confined.parent / "their.fmu"
    binary = f"binaries/{fmpy.platform}/Foreign{fmpy.sharedLibraryExtension}"

    def unpacked(content):
        try:
            with Workspace() as place, watched(confined):
                return read_interface(place.write_description(content), "their.fmu")
        except FmuFileError as error:
            message = str(error)
        assert message.startswith("their.fmu")
        return None

    def rule(content, uses):
        it = unpacked(content)
        if it is None:
            return
        show_interface(Console(file=io.StringIO(), width=100), it)
        with zipfile.ZipFile(path, "w") as made:
            made.writestr("modelDescription.xml", content)
            made.writestr(binary, "no library")
        with Workspace() as place, watched(confined):
            try_in_a_system(it, uses, place)

    def try_in_a_system(it, uses, place):
        system, names = System(stop_time=1.0, step=0.5), list(it.variables) or ["nothing"]
        for name in ("a", "b"):
            system.add(name, str(path))
        for first, second, start in uses:
            system.connect(f"a.{names[first % len(names)]}", f"b.{names[second % len(names)]}")
            system.instances["a"].start[names[second % len(names)]] = start
        for source, target in zip(it.of("output"), it.of("input"), strict=False):
            system.connect(f"a.{source.name}", f"b.{target.name}")
        if len(uses) % 2:
            system.judged.metrics = {"m": "max(a.x[i])", "n": "max(a.x[:])"}
            system.judged.requirements = {"r": "always a.y < count"}
        try:
            check(system, place)
        except RailcosimError as error:
            message = str(error)
        else:
            message = "fine"
        assert message.strip()

    rule(bases[0], [])
    explore(rule, descriptions(bases), USES, quick=50, deep=350)


ENTITIES = {
    "a file": '<!DOCTYPE x [<!ENTITY e SYSTEM "file://{secret}">]>',
    "a parameter entity": '<!DOCTYPE x [<!ENTITY % p SYSTEM "file://{secret}"> %p; <!ENTITY e "x">]>',
    "another document": '<!DOCTYPE x SYSTEM "file://{secret}" [<!ENTITY e "x">]>',
    "the network": '<!DOCTYPE x [<!ENTITY e SYSTEM "http://localhost:9/x">]>',
    "laughs": '<!DOCTYPE x [<!ENTITY a "haha"><!ENTITY b "&a;&a;&a;&a;"><!ENTITY e "&b;&b;&b;&b;">]>',
    "defaults": '<!DOCTYPE x [<!ENTITY e "x"><!ATTLIST fmiModelDescription guid CDATA "&e;">]>',
}


@pytest.mark.parametrize("kind", ENTITIES)
@pytest.mark.parametrize("encoding", ["UTF-8", "UTF-16", "ISO-8859-1"])
def test_no_entity_is_ever_replaced(bases, watched, workspace, kind, encoding):
    secret = workspace.folder / "secret.txt"
    secret.write_text("very secret")
    text = bases[0].decode().replace('guid="{1}"', 'guid="&e;"').replace("UTF-8", encoding)
    text = text.replace("<fmiModelDescription", ENTITIES[kind].format(secret=secret) + "<fmiModelDescription", 1)
    folder = workspace.write_description(text.encode(encoding))
    with watched(workspace.folder), pytest.raises(FmuFileError) as caught:
        read_interface(folder, "their.fmu")
    assert "secret" not in str(caught.value).replace(str(secret), "")
    assert "haha" not in str(caught.value)
