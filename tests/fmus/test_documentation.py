"""The page inside an FMU: parsed as a browser would, compared with the declarations."""

import zipfile
from html.parser import HTMLParser

import pytest
from railcosim.components import ComfortCruise, PointMassTrain
from railcosim.fmus.build import build
from railcosim.fmus.documentation import page
from railcosim.fmus.references import resolve
from railcosim.fmus.variables import scalar_variables

VOID = {"meta", "br", "hr", "img", "link"}


class Page(HTMLParser):
    """Collects text and table rows; fails on a tag that closes nothing or stays open."""

    def __init__(self, text):
        super().__init__()
        self.open, self.rows, self.notes, self.text = [], [], [], ""
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        if tag not in VOID:
            self.open.append(tag)
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th"):
            self.rows[-1].append("")
        if ("class", "note") in attrs:
            self.notes.append("")

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text += data
        if self.open[-1:] == ["p"] and self.notes == [""]:
            self.notes[-1] = data
        if "td" in self.open or "th" in self.open:
            self.rows[-1][-1] += data


@pytest.mark.few
def test_the_interface_table_is_the_declared_interface(reference):
    component = resolve(reference)()
    found = Page(page(component, "python"))
    assert found.rows[0] == ["name", "causality", "variability", "unit or type", "start", "description"]
    assert len(found.rows) - 1 == len(scalar_variables(component))
    for row, variable in zip(found.rows[1:], scalar_variables(component), strict=True):
        declaration = variable.slot.declaration
        unit = variable.slot.unit if variable.slot.type is float else variable.slot.type.__name__
        assert row[:4] == [variable.name, variable.causality, variable.variability, unit]
        assert row[5] == variable.description
        assert row[5].endswith(declaration.description)
        assert bool(row[4]) <= (variable.causality in ("parameter", "input"))


def test_a_row_by_hand():
    rows = Page(page(PointMassTrain(mass=3e5), "python")).rows
    assert ["mass", "parameter", "fixed", "kg", "300000.0", "mass of the train"] in rows
    assert [
        "c2",
        "parameter",
        "fixed",
        "N.s2/(m2.kg)",
        "0.00016",
        "Davis coefficient: part quadratic in speed",
    ] in rows


def test_what_a_user_must_know_stands_on_the_page():
    found = Page(page(ComfortCruise(), "python"))
    assert found.notes == [ComfortCruise.note]
    assert "figure-consistent" in found.text
    assert "Wang et al. 2020, eqs. 3-9" in found.text
    assert "Recommended communication step: 0.1 s or shorter" in found.text
    assert "needs Python 3.11+ and NumPy" in found.text


def test_a_component_without_a_note_has_none():
    assert Page(page(PointMassTrain(), "python")).notes == []


@pytest.mark.parametrize(
    ("name", "expected"),
    [("Counter", "takes any communication step, samples when a sample is due"), ("Chain", "max_step")],
)
def test_stepping_advice(sample, name, expected):
    assert expected in Page(page(resolve(sample(name))(), "python")).text


def test_build_arguments_and_markup_in_texts(write_component):
    reference = write_component(
        "from railcosim.components import Component, Data, Output\n\n\n"
        "class C(Component):\n"
        '    """Less < more & \'quoted\'."""\n\n'
        "    note = 'if a < b & c > d'\n"
        "    table = Data([1.0], description='<b>')\n"
        "    y = Output('m', description='a <b> c & d')\n\n"
        "    def outputs(self):\n"
        "        return {'y': self.table[0]}\n"
    )
    found = Page(page(resolve(reference)(table=[1.5, "<i>"]), "python"))
    assert "Less < more & 'quoted'." in found.text
    assert found.notes == ["if a < b & c > d"]
    assert '{"table": [1.5, "<i>"]}' in found.text
    assert found.rows[-1][-1] == "a <b> c & d"


def test_the_page_is_where_fmi_wants_it():
    with zipfile.ZipFile(build("ComfortCruise")) as archive:
        assert archive.read("documentation/index.html").decode() == page(ComfortCruise(), "python")
