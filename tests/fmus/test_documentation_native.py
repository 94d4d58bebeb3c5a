"""What an FMU holds for people, alike for both kinds: formulas, advice, reference signals, licences, icon."""

import re
import struct
import xml.etree.ElementTree as ET
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy import read_csv, read_model_description, simulate_fmu
from fmpy.util import read_ref_opt_file
from fmpy.validation import validate_fmu
from railcosim.components import CATALOGUE, ComfortCruise, ComponentError, FreightTrain, Gust, PointMassTrain
from railcosim.fmus import documentation, toolchain
from railcosim.fmus.build import build, native_problem
from railcosim.fmus.documentation import page
from railcosim.fmus.documentation.formulas import Formulas
from railcosim.fmus.documentation.reference_signals import STEPS, reference_signals, steps_of
from railcosim.fmus.references import resolve

ROOT = Path(__file__).parents[2]
KINDS = ("native", "python")
SVG = "{http://www.w3.org/2000/svg}"


def unpacked(path, place):
    with zipfile.ZipFile(path) as archive:
        archive.extractall(place)
    return place


def build_as(kind, name):
    problem = native_problem(resolve(name)) if kind == "native" else ""
    if problem:
        pytest.skip(problem)
    return build(name, kind=kind)


# ---------------------------------------------------------------- formulas


def svg(markup):
    return ET.fromstring(
        f'<div xmlns="http://www.w3.org/1999/xhtml">{markup}</div>'.replace("<svg", f'<svg xmlns="{SVG[1:-1]}"')
    )


def test_a_formula_becomes_outlines_that_are_kept_once():
    formulas = Formulas()
    lines = svg(formulas.line(r"$x + \alpha x$") + formulas.line("with $x$"))
    letters = [path.get("id") for path in svg(formulas.outlines()).iter(f"{SVG}path")]
    drawn = [
        [use.get("href").removeprefix("#") for use in picture.iter(f"{SVG}use")] for picture in lines.iter(f"{SVG}svg")
    ]
    assert [len(names) for names in drawn] == [4, 1]  # x + alpha x; x
    assert drawn[0][0] == drawn[0][3] == drawn[1][0]
    assert sorted({*drawn[0], *drawn[1]}) == sorted(letters)
    assert [picture.get("aria-label") for picture in lines.iter(f"{SVG}svg")] == [r"x + \alpha x", "x"]
    assert "with " in "".join(lines.itertext())


def test_a_formula_stands_on_the_line_of_its_text():
    """A letter without descender starts at the baseline; a fraction reaches below it, and is higher."""
    formulas = Formulas()
    letter, fraction = (svg(formulas.line(text)).find(f"{SVG}svg") for text in ("$x$", r"$\dfrac{x}{x}$"))
    depth = [-float(re.search(r"vertical-align:(.*)px", one.get("style"))[1]) for one in (letter, fraction)]
    assert depth[0] == pytest.approx(0.0, abs=0.4)
    assert 4.0 < depth[1] < 12.0
    assert 5.0 < float(letter.get("height")) < 9.0
    assert 20.0 < float(fraction.get("height")) < 40.0
    for one in (letter, fraction):
        _, top, width, height = map(float, one.get("viewBox").split())
        assert width / height == pytest.approx(float(one.get("width")) / float(one.get("height")), rel=0.03)
        assert top < 0.0 < height
    assert len(list(fraction.iter(f"{SVG}path"))) == 1  # the bar


def test_a_bar_and_its_letters_lie_inside_the_picture():
    picture = svg(Formulas().line(r"$\dfrac{a}{b}$")).find(f"{SVG}svg")
    left, top, width, height = map(float, picture.get("viewBox").split())
    bar = [float(x) for x in re.findall(r"-?\d+", picture.find(f"{SVG}path").get("d"))]
    assert all(left <= x <= left + width + 1 for x in bar[::2])
    assert all(top <= y <= top + height for y in bar[1::2])
    for use in picture.iter(f"{SVG}use"):
        x, y = map(float, re.match(r"translate\((\S+) (\S+)\)", use.get("transform")).groups())
        assert left <= x <= left + width
        assert top <= y <= top + height


def test_text_between_formulas_is_escaped():
    assert Formulas().line("a < b & c") == "a &lt; b &amp; c"
    assert Formulas().outlines() == ""


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("the gap $d", "opens a formula with $ and does not close it"),
        (r"$\frac{a}$", "cannot be read"),
        (r"$\nope$", "nope"),
    ],
)
def test_a_formula_that_cannot_be_read_names_itself(write_component, text, complaint):
    with pytest.raises(ComponentError, match=re.escape(complaint)):
        Formulas().line(text)
    body = "from railcosim.components import Component, Output\n\n\nclass C(Component):\n"
    body += f"    equations = ({text!r},)\n    y = Output('m')\n\n    def outputs(self):\n        return {{'y': 1.0}}\n"
    with pytest.raises(ComponentError, match=r"C\.equations: "):
        build(write_component(body))


@pytest.mark.parametrize("name", ["PointMassTrain", "ComfortCruise", "Schedule", "Gust"])
def test_the_equations_stand_on_the_page(name):
    cls = CATALOGUE[name]
    text = page(cls(), "native")
    formulas = [part for line in cls.equations for part in line.split("$")[1::2]]
    assert len(formulas) > 1
    pictures = svg(text[text.index("<h2>Equations</h2>") : text.index("<p>Source:")])
    assert [p.get("aria-label") for p in pictures.iter(f"{SVG}svg") if p.get("role") == "img"] == formulas
    assert len(text) < 60_000


def test_every_formula_of_the_catalogue_can_be_read():
    for cls in CATALOGUE.values():
        for line in cls.equations:
            assert Formulas().line(line)


def test_the_equations_name_what_the_interface_has():
    """A word with an underscore in the text of the shipped equations is a variable's name."""
    for cls in CATALOGUE.values():
        words = {
            word for line in cls.equations for part in line.split("$")[::2] for word in re.findall(r"\w+_\w+", part)
        }
        assert words <= cls.declarations.keys(), cls.__name__


# ---------------------------------------------------------------- advice on stepping


def advice(component):
    text = page(component, "native")
    part = text[text.index("<h2>Stepping</h2>") : text.index("<h2>Reference")]
    return re.sub("<[^>]*>", " ", part)


def test_a_controller_goes_before_its_train():
    said = advice(ComfortCruise())
    assert "Recommended communication step: 0.1 s or shorter." in said
    assert re.search(r"Without delay these outputs follow inputs: [^.]*\bforce\b", said)
    assert "step this block before those that receive them (a controller before its train)" in said
    assert "delay = 1 in a railcosim scenario" in said


def test_a_train_shows_its_states_before_its_step():
    said = advice(PointMassTrain(max_step=0.025))
    assert "RK4 in sub-steps no longer than max_step (here 0.025 s)" in said
    assert "follow inputs: acceleration, applied_force." in said
    assert "Receivers of position, speed alone may step first." in said


def test_a_source_goes_after_its_receivers():
    said = advice(Gust())
    assert "No output follows an input without delay: step it after those that receive its outputs." in said
    assert "Any communication step" in said


def test_a_sampled_block_says_its_period(sample):
    cls = resolve(sample("Counter"))
    assert "here sample_time = 0.01 s" in advice(cls(sample_time=0.01))
    assert "sample_time = 0, which samples once per communication step" in advice(cls(sample_time=0.0))
    assert "it takes any communication step" in advice(cls())


def test_what_cannot_be_traced_is_said(write_component):
    body = "from railcosim.components import Component, Input, Output\n\n\nclass C(Component):\n"
    body += "    requires = ('scipy',)\n    u = Input('m')\n    y = Output('m')\n\n    def outputs(self):\n"
    body += "        return {'y': 1.0 if self.u > 0 else 2.0}\n"
    said = advice(resolve(write_component(body))())
    assert "could not be found out: step it before those it acts on." in said


# ---------------------------------------------------------------- reference signals


@pytest.mark.long
@pytest.mark.parametrize("kind", ["native", "python"])
@pytest.mark.parametrize("name", CATALOGUE)
def test_an_importer_that_follows_the_files_gets_the_reference(name, kind, tmp_path):
    """FMPy, which knows nothing of us, reads settings and input, and arrives at the reference to rounding error."""
    fmu = build_as(kind, name)
    folder = unpacked(fmu, tmp_path) / "documentation"
    settings = read_ref_opt_file(folder / f"{name}_ref.opt")
    reference = read_csv(folder / f"{name}_ref.csv")
    names = list(reference.dtype.names[1:])
    step = settings["StepSize"]
    assert len(reference) == STEPS + 1
    assert settings["StopTime"] == pytest.approx(STEPS * step)
    given = folder / f"{name}_in.csv"
    found = simulate_fmu(
        str(fmu),
        start_time=settings["StartTime"],
        stop_time=settings["StopTime"],
        output_interval=step,
        step_size=step,
        input=read_csv(given) if given.is_file() else None,
        output=names,
    )
    assert len(found) == STEPS + 1
    units = {variable.name: variable.unit for variable in read_model_description(str(fmu)).modelVariables}
    for column in ("time", *names):
        # Rounding of what a signal is made of: a force between others, what is left over of energies; not its own size.
        alike = [reference[other] for other in names if units[other] == units.get(column)]
        size = max(1.0, float(np.abs(alike or reference[column]).max()))
        np.testing.assert_allclose(
            found[column].astype(float), reference[column], rtol=1e-12, atol=1e-12 * size, err_msg=column
        )


def test_those_of_many_states_last_fewer_steps():
    """In which every input still moves."""
    train = FreightTrain(vehicles=12)
    assert steps_of(train) == 37
    assert steps_of(FreightTrain(vehicles=101)) == 12
    told = documentation.files(train, "native")
    texts = (told[f"documentation/FreightTrain_{name}.csv"].decode().splitlines()[1:] for name in ("in", "ref"))
    given, found = (np.genfromtxt(lines, delimiter=",") for lines in texts)
    assert len(given) == len(found) == 38
    assert (np.ptp(given, axis=0) > 0.0).all()
    assert b"37 communication steps" in told["documentation/index.html"]


def test_the_inputs_do_what_the_page_says():
    lines = reference_signals(ComfortCruise(speed=70.0))["ComfortCruise_in.csv"].splitlines()
    assert lines[0].startswith('"time","position","speed",')
    columns = dict(
        zip(lines[0].replace('"', "").split(","), np.array([x.split(",") for x in lines[1:]], float).T, strict=True)
    )
    assert columns["time"].tolist() == [k * 0.1 for k in range(STEPS + 1)]
    whole = columns["time"] / 5.0
    assert columns["position"] == pytest.approx(100.0 * np.sin(2 * np.pi * whole), abs=1e-3)
    assert columns["speed"] == pytest.approx(70.0 + 10.0 * np.sin(4 * np.pi * whole), abs=1e-4)
    assert columns["has_ahead"].tolist() == [float(1 / 3 <= k / STEPS < 2 / 3) for k in range(STEPS + 1)]
    assert all(np.ptp(column) > 0.0 for column in columns.values())


def test_integers_trips_and_bounds(sample):
    types = reference_signals(resolve(sample("Types"))())
    header, *rows = types["Types_in.csv"].splitlines()
    assert header == '"time","teeth","doors[1]","doors[2]","offset"'
    assert [row.split(",")[1] for row in rows] == ["0"] * 25 + ["1"] * 26
    assert {row.split(",")[2] for row in rows} == {"0", "1"}  # as fmusim and FMUChecker read a boolean
    learner = reference_signals(resolve(sample("Learner"))(sample_time=0.1))["Learner_in.csv"].splitlines()
    names = learner[0].replace('"', "").split(",")
    rows = np.array([row.split(",") for row in learner[1:]], float)
    assert rows[:, names.index("trip_time")].tolist() == rows[:, 0].tolist()
    assert np.ptp(rows[:, names.index("trip")]) == 0.0


def test_a_component_at_hand_keeps_its_values_and_writes_no_tape(sample, tmp_path):
    tape = tmp_path / "tape.csv"
    component = resolve(sample("Learner"))(sample_time=0.1, tape_file=str(tape))
    before = dict(component.present_values)
    assert reference_signals(component)
    assert component.present_values == before
    assert not tape.exists()


def test_without_inputs_there_is_no_input_file():
    assert set(reference_signals(Gust())) == {"Gust_ref.csv", "Gust_ref.opt"}


def test_without_numbers_among_the_outputs_there_is_only_the_time(write_component):
    body = "from railcosim.components import Component, Output\n\n\nclass C(Component):\n    y = Output('1', str)\n\n"
    body += "    def outputs(self):\n        return {'y': 'a'}\n"
    lines = reference_signals(resolve(write_component(body))())["C_ref.csv"].splitlines()
    assert (lines[:2], len(lines)) == (['"time"', "0.0"], STEPS + 2)


def test_equations_that_refuse_cost_the_signals_only(write_component):
    body = "from railcosim.components import Component, Input, Output\n\n\nclass C(Component):\n"
    body += "    u = Input('m')\n    y = Output('m')\n\n    def outputs(self):\n        return {'y': 1.0 / self.u}\n"
    reference = write_component(body)
    assert reference_signals(resolve(reference)()) == {}
    path = build(reference)
    with zipfile.ZipFile(path) as archive:
        assert not [name for name in archive.namelist() if name.endswith(".csv")]
        assert "the equations refuse the usual excitation" in archive.read("documentation/index.html").decode()


# ---------------------------------------------------------------- the archive


@pytest.mark.few
@pytest.mark.parametrize("kind", [pytest.param("native", marks=pytest.mark.long), "python"])
def test_the_archive_is_complete_and_every_link_leads_somewhere(kind, reference):
    name = reference.rpartition(":")[2]
    if name in ("Everything", "Types") and kind == "native":
        pytest.skip("has a computed text")
    fmu = build_as(kind, reference)
    assert validate_fmu(str(fmu)) == []
    with zipfile.ZipFile(fmu) as archive:
        paths = set(archive.namelist())
        text = archive.read("documentation/index.html").decode()
        assert archive.read("model.png")[:8] == b"\x89PNG\r\n\x1a\n"
    links = re.findall(r'href="([^#"]+)"', text)
    signals = set(reference_signals(resolve(reference)()))  # none for a tape without a sample time
    assert {"licenses/license.txt", *signals} == set(links)
    assert {f"documentation/{link}" for link in links} <= paths


def test_both_kinds_carry_the_same_page():
    native, python = (page(ComfortCruise(), kind) for kind in KINDS)
    strip = re.compile(r"Kind: .*?\)\. ")
    assert strip.sub("", native) == strip.sub("", python)
    assert native != python


def test_licences():
    own = (ROOT / "LICENSE").read_text()
    assert (Path(documentation.__file__).parents[1] / "resources" / "license.txt").read_text() == own
    of_kind = {kind: documentation.files(Gust(), kind) for kind in KINDS}
    for found in of_kind.values():
        assert found["documentation/licenses/license.txt"].decode() == own
    headers = of_kind["native"]["documentation/licenses/fmi_headers.txt"].decode()
    whole = (Path(fmpy.__file__).parent / "c-code" / "fmi2Functions.h").read_text()
    assert "2-Clause BSD" in headers
    assert all(line.strip() in whole for line in headers.splitlines()[2:])
    assert b"MIT" in of_kind["python"]["documentation/licenses/pythonfmu_license.txt"]


def test_a_users_equations_stay_the_users(write_component):
    body = "from railcosim.components import Component, Output\n\n\nclass C(Component):\n    y = Output('m')\n\n"
    body += "    def outputs(self):\n        return {'y': 1.0}\n"
    files = documentation.files(resolve(write_component(body))(), "python")
    text = files["documentation/licenses/license.txt"].decode()
    assert text.startswith("The equations of C belong to their author.")
    assert text.endswith((ROOT / "LICENSE").read_text())


def test_the_icon_is_small_and_square():
    icon = documentation.files(Gust(), "native")["model.png"]
    assert struct.unpack(">II", icon[16:24]) == (128, 128)
    assert len(icon) < 5_000


@pytest.mark.skipif(not toolchain.can_compile(), reason="there is no compiler")
def test_an_fmu_stays_small():
    sizes = {name: build_as("native", name).stat().st_size for name in ("Gust", "PointMassTrain", "ComfortCruise")}
    assert max(sizes.values()) < 100_000, sizes
