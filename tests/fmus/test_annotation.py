import pytest
from lxml import etree
from railcosim.fmus.annotation import Annotation, read, write

WHOLE = Annotation(
    component="Mine",
    arguments={"carriages": 3, "line": [{"position": 0.1}]},
    digest="abc",
    kind="native",
    kind_note="compiled",
    source="Doe 2020, eq. 3",
    note='reconstructed: "so" & so',
    requires=("scipy", "control"),
    optional_inputs=("wind", "force[1]", "force[2]"),
    rising=("times", "places"),
    flags={"force[1]": "pushed", "force[2]": "pushed"},
    recommended_step=0.1 + 0.2,
    sampled=True,
)


def through_xml(annotation, fmi="2"):
    root = etree.Element("fmiModelDescription")
    write(annotation, root, fmi)
    return root, read(etree.fromstring(etree.tostring(root)))


@pytest.mark.parametrize("annotation", [WHOLE, Annotation("Mine"), Annotation()])
@pytest.mark.parametrize("fmi", ["2", "3"])
def test_what_is_written_is_read_back(annotation, fmi):
    assert through_xml(annotation, fmi)[1] == annotation


def test_what_an_fmu_has_not_is_not_written():
    root, _ = through_xml(Annotation("Mine"))
    assert dict(root.find("VendorAnnotations/Tool/component").attrib) == {"name": "Mine", "arguments": "{}"}


def test_an_fmu_of_another_maker_has_none():
    assert read(etree.fromstring("<a/>")) is None
    assert (
        read(etree.fromstring("<a><VendorAnnotations><Tool name='x'><component/></Tool></VendorAnnotations></a>"))
        is None
    )


def test_a_kind_that_is_not_known_is_none():
    ours = "<a><VendorAnnotations><Tool name='railcosim'><component kind='wasm'/></Tool></VendorAnnotations></a>"
    assert read(etree.fromstring(ours)) == Annotation()
