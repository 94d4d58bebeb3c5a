"""railML 3 infrastructure: gradients, speeds and curves of one line."""

import pytest
from railcosim.components import ComponentError
from railcosim.fmus.references import build_with, resolve

PLACE = (
    '<linearLocation><associatedNetElement netElementRef="{on}" posBegin="{begin}" posEnd="{end}"/></linearLocation>'
)
MEASURE = (
    "<linearLocation><associatedNetElement netElementRef='{on}'>"
    "<linearCoordinateBegin positioningSystemRef='lps' measure='{begin}'/>"
    "<linearCoordinateEnd positioningSystemRef='lps' measure='{end}'/></associatedNetElement></linearLocation>"
)


def element(name, begin, end, on="ne1", place=PLACE, **attributes):
    told = " ".join(f'{key}="{value}"' for key, value in attributes.items())
    return f'<{name} id="{name}{begin:g}" {told}>{place.format(begin=begin, end=end, on=on)}</{name}>'


def railml(*elements, namespace="https://www.railml.org/schemas/3.2"):
    return f'<railML xmlns="{namespace}"><infrastructure id="is1">{"".join(elements)}</infrastructure></railML>'


SPEEDS = (element("speedSection", 0, 400, maxSpeed=90), element("speedSection", 400, 1000, maxSpeed=72))
WHOLE = (
    *reversed(SPEEDS),
    element("gradientCurve", 100, 300, gradient="-4.5", curveType="straight"),
    element("horizontalCurve", 0, 200, curveType="straight"),
    element("horizontalCurve", 200, 260, curveType="clothoid"),
    element("horizontalCurve", 260, 500, curveType="arc", radius=-400),
    element("horizontalCurve", 500, 560, curveType="clothoid"),
    element("underCrossing", 600, 700, constructionType="tunnel"),
    element("underCrossing", 800, 810, constructionType="bridge"),
)


@pytest.fixture
def read(tmp_path):
    def build(*elements, **options):
        path = tmp_path / "line.railml"
        path.write_text(elements[0] if elements[0].startswith(("<railML", "<!", "x")) else railml(*elements, **options))
        return build_with(resolve("Line"), {"line": str(path)}).line

    return build


def test_a_line_comes_in_si_units(read):
    line = read(*WHOLE)
    assert [tuple(step) for step in line.limits.steps] == [(0.0, 25.0), (400.0, 20.0)]
    assert line.positions == [0.0, 100.0, 200.0, 260.0, 300.0, 500.0, 560.0, 600.0, 700.0]
    assert line.gradients == [0.0, -0.0045, -0.0045, -0.0045, 0.0, 0.0, 0.0, 0.0, 0.0]
    assert [stop.position for stop in line.stops] == [0.0, 1000.0]
    assert [(t.begin, t.end) for t in line.transitions] == [(200.0, 260.0), (500.0, 560.0)]
    assert line.transitions[0].curvature == 0.0
    assert line.transitions[1].curvature == 1 / 400.0
    assert line.opposing[7] == pytest.approx(9.81 * 0.00013 * 100.0 / 1000.0)


def test_coordinates_of_a_positioning_system_join_net_elements(read):
    line = read(
        element("speedSection", 5000, 5400, on="ne1", place=MEASURE, maxSpeed=90),
        element("speedSection", 5400, 6000, on="ne2", place=MEASURE, maxSpeed=72),
        element("gradientCurve", 5400, 5800, on="ne2", place=MEASURE, gradient=3),
        element("gradientCurve", 5800, 6000, on="ne2", place=MEASURE, gradient=4),
    )
    assert [tuple(step) for step in line.limits.steps] == [(0.0, 25.0), (400.0, 20.0)]
    assert (line.positions, line.gradients) == ([0.0, 400.0, 800.0], [0.0, 0.003, 0.004])


def test_a_line_may_have_no_limits_and_a_transition_at_its_begin(read):
    line = read(
        element("horizontalCurve", 0, 50, curveType="clothoid"),
        element("horizontalCurve", 50, 90, radius=500),
        element("horizontalCurve", 95, 99, curveType="clothoid"),
    )
    assert line.limits.steps == [(0.0, 1000.0)]
    assert [(t.begin, t.end) for t in line.transitions] == [(0.0, 50.0)]


@pytest.mark.parametrize(
    ("elements", "complaint"),
    [
        (("x",), "it is not XML"),
        (("<!DOCTYPE a><a/>",), "its root is <a> in ''"),
        (('<railML xmlns="https://www.railml.org/schemas/2.4"/>',), "not <railML> of version 3"),
        (('<railML xmlns="https://www.railml.org/schemas/3.1"/>',), "it has no <infrastructure>"),
        ((element("track", 0, 100),), "it has no <speedSection>, <gradientCurve> or <horizontalCurve>"),
        ((element("speedSection", 0, 9),), "<speedSection id='speedSection0'>: 'maxSpeed' is missing"),
        ((element("speedSection", 0, 9, maxSpeed="80,5"),), "not the text '80,5': a decimal point, not a comma, 80.5"),
        ((element("speedSection", 0, 9, maxSpeed="-80"),), "'maxSpeed': -80.0 is negative"),
        ((element("speedSection", 0, 9, maxSpeed="fast"),), "a number is wanted, not the text 'fast'"),
        ((element("speedSection", 9, 0, maxSpeed="80"),), "its end at 0 m does not exceed its begin at 9 m"),
        (('<speedSection id="a" maxSpeed="80"/>',), "it has neither <linearCoordinateBegin measure> nor"),
        ((SPEEDS[0], element("speedSection", 300, 500, maxSpeed=80)), "<speedSection>: one ends at 400 m, beyond the"),
        ((SPEEDS[0], element("speedSection", 500, 600, maxSpeed=80)), "<speedSection>: no limit from 400 m to 500 m"),
        ((SPEEDS[0], element("gradientCurve", 0, 9, on="ne2", gradient=1)), "it lies on 'ne2', others on 'ne1'"),
        ((element("horizontalCurve", 0, 9, radius=0),), "a radius of 0 is no curve"),
        ((element("gradientCurve", 0, 9, gradient=400),), "section 1: 'gradient' is 0.4"),
    ],
)
def test_what_is_wrong_is_told_with_file_and_element(read, tmp_path, elements, complaint):
    with pytest.raises(ComponentError) as told:
        read(*elements)
    assert str(tmp_path / "line.railml") in str(told.value)
    assert complaint in str(told.value)
