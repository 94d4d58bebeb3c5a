"""What a model description says, read tolerantly: what can be used is, with a warning; what cannot is refused."""

import gc
import io
import time

import pytest
from railcosim.fmus.build import build
from railcosim.fmus.kinds import NOTE_OF_KIND
from railcosim.orchestrator.cli.printing import show_interface
from railcosim.orchestrator.errors import FmuFileError
from railcosim.orchestrator.fmi.interface import Unit
from railcosim.orchestrator.fmi.models import load_fmu
from railcosim.orchestrator.fmi.reader import read_interface
from rich.console import Console

PLAIN = '<ScalarVariable name="y" valueReference="0" causality="output"><Real/></ScalarVariable>'
UNITS = (
    '<Unit name="km"><BaseUnit m="1" factor="1000"/></Unit><Unit name="degC"><BaseUnit K="1" offset="273.15"/></Unit>'
    '<Unit name="odd"/>'
)


@pytest.fixture
def reading(tmp_path):
    """Read a model description given as text (or bytes)."""

    def parse(text, name="their.fmu"):
        content = text if isinstance(text, bytes) else text.encode()
        (tmp_path / "modelDescription.xml").write_bytes(content)
        return read_interface(tmp_path, name)

    return parse


def refusal(reading, text):
    with pytest.raises(FmuFileError) as caught:
        reading(text)
    assert str(caught.value).startswith("their.fmu")
    return str(caught.value)


def test_variables_units_and_capabilities(reading, xml):
    v = xml["variable"]
    text = xml["description"](
        [
            v("gain", "parameter", start="2.5", variability="fixed", initial="exact", min="0", max="9"),
            v("u", "input", start="0.0", unit="km"),
            v("n", "input", "Integer", start="3"),
            v("on", "input", "Boolean", start="true"),
            v("label", "parameter", "String", start="hi", variability="fixed", initial="exact"),
            v("y", "output", unit="degC", dependencies=["u", "n"]),
            v("x", "output", dependencies=[]),
            v("z", "output", unit="odd"),
            v("limit", "local", start="1", variability="constant", initial="exact"),
        ],
        UNITS,
        simulation='canBeInstantiatedOnlyOncePerProcess="true" canHandleVariableCommunicationStepSize="true"',
    )
    it = reading(text)
    of = it.variables
    assert list(of) == ["gain", "u", "n", "on", "label", "y", "x", "z", "limit"]
    assert [of[n].start for n in ("gain", "u", "n", "on", "label", "y")] == [2.5, 0.0, 3, True, "hi", None]
    assert (of["gain"].minimum, of["gain"].maximum, of["u"].minimum) == (0.0, 9.0, None)
    assert [of[n].dependencies for n in ("y", "x", "z")] == [{"u", "n"}, frozenset(), None]
    assert [n for n in of if of[n].settable] == ["gain", "u", "n", "on", "label"]
    assert it.units["km"] == Unit("km", (0, 1, 0, 0, 0, 0, 0, 0), 1000.0, 0.0)
    assert it.units["degC"].offset == 273.15
    assert it.units["odd"].exponents is None
    assert (it.single_instance, it.variable_step, it.needs_tool, it.can_save_state) == (True, True, False, False)
    assert (it.annotation, it.own_kind, it.recommended_step) == (None, None, None)
    assert (it.sampled, it.optional_inputs) == (False, frozenset())


def test_our_own_annotation(workspace, components):
    component = components(
        """
class Mine(Base):
    '''Everything the annotation carries.'''

    note = "reconstructed"
    recommended_step = 0.25
    carriages = Size(2, description="how many")
    force = Input("N", shape=(carriages,), description="needed")
    wind = Input("N", optional=True, description="not needed")
    total = Memory("N", 0.0, output=True, description="sum")

    def update(self):
        return {"total": self.total + maths.total(self.force) + self.wind}
"""
    )("Mine")
    it = load_fmu(build(component, {"carriages": 3}), workspace).interface
    assert it.arrays == {"force": ("force[1]", "force[2]", "force[3]")}
    assert it.scalars("force") == ("force[1]", "force[2]", "force[3]")
    assert it.scalars("force[2]") == ("force[2]",)
    assert it.scalars("farce") is None
    assert it.optional_inputs == {"wind"}
    assert (it.annotation.component, it.annotation.arguments) == ("Mine", {"carriages": 3})
    assert (it.recommended_step, it.sampled, it.annotation.note) == (0.25, True, "reconstructed")
    assert (it.own_kind, it.annotation.kind_note) == ("python", NOTE_OF_KIND["python"])
    assert it.warnings == ()


def test_elements_of_an_array_come_in_the_order_of_their_indices(reading, xml):
    names = ["x[2]", "x[10]", "x[1]", "m[2,1]", "m[1,2]", "m[1,1]", "m[2,2]", "plain", "deep.x[2]", "deep.x[1]"]
    it = reading(xml["description"]([xml["variable"](n, "output") for n in names]))
    assert it.arrays == {
        "x": ("x[1]", "x[2]", "x[10]"),
        "m": ("m[1,1]", "m[1,2]", "m[2,1]", "m[2,2]"),
        "deep.x": ("deep.x[1]", "deep.x[2]"),
    }


def test_a_description_without_fault_gives_no_warning(reading, xml):
    assert reading(xml["description"]([xml["variable"]("y", "output")])).warnings == ()


@pytest.mark.parametrize(
    ("fault", "named"),
    [
        (("", 'unit="furlong"'), "furlong"),  # a unit that is not defined
        (("", 'unit="-"'), "-"),
        (('colour="green"', ""), "colour"),  # an attribute that the standard does not know
        (('initial="sometimes"', ""), "sometimes"),
    ],
)
def test_pedantry_is_tolerated_and_told(reading, xml, fault, named):
    on_variable, on_real = fault
    text = xml["description"]([xml["variable"]("y", "output")])
    text = text.replace('causality="output">', f'causality="output" {on_variable}>').replace(
        "<Real/>", f"<Real {on_real}/>"
    )
    it = reading(text)
    assert list(it.variables) == ["y"]
    assert any(warning.startswith("their.fmu: ") and named in warning for warning in it.warnings), it.warnings


def test_a_dash_is_no_unit(reading, xml):
    assert reading(xml["description"]([xml["variable"]("y", "output", unit="-")])).variables["y"].unit is None


@pytest.mark.parametrize("version", ["0.9", "2.1", "3.0-beta.1", "4.0"])
def test_other_versions_of_fmi_are_refused(reading, xml, version):
    message = refusal(reading, xml["description"]([], version=version))
    runs = "this version of railcosim runs co-simulation FMUs of FMI 1.0, 2.0, 3.0"
    assert message == f"their.fmu is FMI {version}; {runs}"


def test_model_exchange_only(reading, xml):
    text = xml["description"]([]).replace("CoSimulation", "ModelExchange")
    assert refusal(reading, text) == "their.fmu has no co-simulation part (it is a model-exchange FMU)"


@pytest.mark.parametrize(
    "text", ["", "not XML", "<fmiModelDescription>", "<a></b>", b"\xff\xfe\x00<", b'<a b="\x81"/>', b" \n <a>"]
)
def test_not_xml(reading, text):
    assert refusal(reading, text).startswith("their.fmu: its modelDescription.xml is not XML: ")


@pytest.mark.parametrize(
    ("begin", "encoding", "told"),
    [
        (b"", "utf-8", []),
        (b"\xef\xbb\xbf", "utf-8", []),
        (b"\n  ", "utf-8", ["it begins with blanks, which XML does not allow"]),
        (b"\xef\xbb\xbf\r\n", "utf-8", ["it begins with blanks, which XML does not allow"]),
        (b"", "cp1252", ["its letters are not those of the encoding it names; they are read as Windows-1252"]),
    ],
)
def test_bytes_that_tools_write_and_xml_forbids(reading, xml, begin, encoding, told):
    text = xml["description"]([xml["variable"]("größe", "output")])
    assert text.startswith("<?xml"), "the declaration is what must stand first"
    it = reading(begin + text.encode(encoding))
    assert list(it.variables) == ["größe"]
    assert [warning.removeprefix("their.fmu: ") for warning in it.warnings] == told


def test_a_second_element_that_names_no_library_leaves_no_gap(reading, xml):
    text = xml["description"]([xml["variable"]("y", "output")])
    it = reading(text.replace("<ModelVariables>", "<CoSimulation/><ModelVariables>"))
    assert (it.model, it.identifier, it.guid) == ("Foreign", "", "{1}")


@pytest.mark.parametrize("given", ["[1]", "null", "3"])
def test_build_arguments_that_are_none(reading, xml, given):
    ours = f'<VendorAnnotations><Tool name="railcosim"><component arguments="{given}"/></Tool></VendorAnnotations>'
    text = xml["description"]([]).replace("<ModelVariables>", f"{ours}<ModelVariables>")
    assert reading(text).annotation.arguments == {}


def laughs(encoding):
    """The billion laughs, in an encoding of choice."""
    entities = '<!ENTITY a0 "ha">' + "".join(f'<!ENTITY a{k} "{f"&a{k - 1};" * 10}">' for k in range(1, 10))
    text = (
        f'<?xml version="1.0" encoding="{encoding}"?><!DOCTYPE x [{entities}]><fmiModelDescription fmiVersion="2.0"/>'
    )
    return text.encode(encoding)


@pytest.mark.parametrize("encoding", ["UTF-8", "UTF-16"])
def test_entities_are_refused_in_any_encoding(reading, encoding):
    assert refusal(reading, laughs(encoding)).startswith("their.fmu is refused: its modelDescription.xml has a DOCTYPE")


@pytest.mark.parametrize(
    "doctype",
    ['<!DOCTYPE x [<!ENTITY f SYSTEM "file:///etc/passwd">]>', '<!DOCTYPE x SYSTEM "http://localhost/x.dtd">'],
)
def test_references_to_other_files_are_refused(reading, xml, doctype):
    text = xml["description"]([]).replace("<fmiModelDescription", f"{doctype}<fmiModelDescription", 1)
    assert refusal(reading, text).startswith("their.fmu is refused: its modelDescription.xml has a DOCTYPE")


@pytest.mark.parametrize(
    "fault",
    [
        '<ScalarVariable name="y" valueReference="zero" causality="output"><Real/></ScalarVariable>',
        '<ScalarVariable name="y" valueReference="0" causality="output"></ScalarVariable>',
    ],
)
def test_what_is_beyond_repair_is_refused_by_name(reading, xml, fault):
    text = xml["description"]([xml["variable"]("y", "output")]).replace(PLAIN, fault)
    assert fault in text
    assert refusal(reading, text).startswith("their.fmu: its modelDescription.xml cannot be used: ")


@pytest.mark.parametrize("on", [True, False])
def test_the_collector_of_circles_is_left_as_it_was(reading, xml, on):
    (gc.enable if on else gc.disable)()
    try:
        reading(xml["description"]([xml["variable"]("y", "output")]))
        assert gc.isenabled() == on
    finally:
        gc.enable()


@pytest.mark.long
def test_sixty_thousand_variables(reading, xml):
    """Read and listed in seconds: nothing grows faster than their number. It took 35 s once, and takes 4."""
    variables = [
        xml["variable"](f"system{k // 1000}.pipe[{k % 1000}].T", "output" if k % 10 == 0 else "local")
        for k in range(60_000)
    ]
    begin = time.process_time()
    it = reading(xml["description"](variables))
    assert len(it.scalars("system3.pipe.T")) == 1000
    stream = io.StringIO()
    show_interface(Console(file=stream, width=160), it)
    assert time.process_time() - begin < 20.0
    assert stream.getvalue().count("\n") > 60_000
