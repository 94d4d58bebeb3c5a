"""From archive to `System`: variants, bare structures, versions, times, steps and algorithms."""

from importlib.machinery import ModuleSpec

import pytest
from railcosim.orchestrator import ScenarioError, load
from railcosim.orchestrator.ssp import documents, is_ssp_name, read_system

from .conftest import DESCRIPTION, GADGET, UNITS, component, connection, connectors, packed, structure, system


def test_names_of_files():
    assert [is_ssp_name(name) for name in ("a.ssp", "b.SSD", "a.ssp#B", "a.toml", "a.fmu#b.ssp")] == [
        *(True, True, True),
        *(False, False),
    ]


def test_variants_by_file_or_name(archive, tmp_path):
    one, other = structure(system(component("a")), name="first"), structure(system(component("b")), name="second")
    path = archive({"Other.ssd": other, "SystemStructure.ssd": one, "Broken.ssd": "no xml"})
    for variant, instance in (("", "a"), ("Other", "b"), ("Other.ssd", "b"), ("second", "b"), ("first", "a")):
        found = read_system(f"{path}#{variant}" if variant else path, tmp_path / "fmus")
        assert (list(found.instances), found.provenance.path) == ([instance], path)
    with pytest.raises(ScenarioError, match="there is no variant 'third'; there are SystemStructure"):
        read_system(f"{path}#third", tmp_path / "fmus")


def test_a_bare_structure(tmp_path):
    """Beside what it names; a link out of its folder is not followed."""
    (tmp_path / "it" / "resources").mkdir(parents=True)
    (tmp_path / "it" / "resources" / "gadget.fmu").write_bytes(GADGET)
    top = tmp_path / "it" / "My.ssd"
    top.write_text(structure(system(component("a"))))
    found = read_system(str(top))
    assert found.instances["a"].model == str(tmp_path / "it" / "resources" / "gadget.fmu")
    assert found.instances["a"].origin == f"{top}:4"
    (tmp_path / "it" / "resources" / "gadget.fmu").rename(tmp_path / "gadget.fmu")
    (tmp_path / "it" / "resources" / "gadget.fmu").symlink_to(tmp_path / "gadget.fmu")
    with pytest.raises(ScenarioError, match="there is no such file"):
        read_system(str(top))


def test_an_archive_without_a_default_structure(tmp_path):
    (tmp_path / "x.ssp").write_bytes(packed({"Other.ssd": structure(system(component("a")))}))
    with pytest.raises(ScenarioError, match=r"it is no SSP: there is no SystemStructure\.ssd at its top"):
        read_system(str(tmp_path / "x.ssp"), tmp_path / "fmus")


def told(found, *texts):
    return [any(text in note for note in found.provenance.notes) for text in texts]


def test_what_the_schema_says(read, archive, tmp_path, monkeypatch):
    """Three of it, and how many more; of 2.0, that there is none where none is installed."""
    wrong = "".join(f"<ssd:Wrong{k}/>" for k in range(1))
    many = "".join(f'<ssd:Connector name="c{k}" kind="wrong{k}"/>' for k in range(5))
    found = read(system(component("a") + wrong, shown=f"<ssd:Connectors>{many}</ssd:Connectors>"))
    against = [note for note in found.provenance.notes if "against the schema" in note]
    assert len(against) == 4
    assert "SystemStructure.ssd:4: against the schema: Element" in against[0]
    assert "more places are against the schema" in against[-1]
    monkeypatch.setattr(documents, "find_spec", lambda _: None)
    for version, more in (("2.0", ": pip install 'railcosim[ssp]'"), ("3.0", "")):
        text = structure(system(component("a")), version=version)
        found = read_system(archive(text, name=f"{version}.ssp"), tmp_path / version)
        (note,) = (note for note in found.provenance.notes if "no schema" in note)
        assert note.endswith(f"no schema for version '{version}' is at hand; it is read without one{more}")


NEW = (
    '<ssd:Connectors><ssd:Connector name="u" kind="input"><ssc:Float64 unit="m/s"/></ssd:Connector>'
    '<ssd:Connector name="k" kind="parameter"><ssc:Float64/><ssc:Dimension size="2"/></ssd:Connector></ssd:Connectors>'
)


def test_what_the_schema_of_2_says(archive, tmp_path, monkeypatch):
    """The words that 2.0 has brought are none of 1.0; what neither has is told. A package without schemas has none."""
    pytest.importorskip("pyssp_standard")
    lines = {}
    for version, shown in (("2.0", NEW), ("1.0", NEW), ("2.0", NEW.replace("Float64/", "Float16/"))):
        text = structure(system(component("a", shown=shown)), version=version)
        found = read_system(archive(text, name=f"{len(lines)}.ssp"), tmp_path / str(len(lines)))
        lines[len(lines)] = [note for note in found.provenance.notes if "the schema" in note]
    assert lines[0] == []
    assert "Float64" in lines[1][0]
    assert "Float16" in lines[2][0]
    empty = ModuleSpec("pyssp_standard", None, origin=str(tmp_path / "__init__.py"))
    monkeypatch.setattr(documents, "find_spec", lambda _: empty)
    text = structure(system(component("a")), version="2.0")
    assert told(read_system(archive(text), tmp_path / "none"), "no schema for version '2.0' is at hand") == [True]


EXPERIMENT = '<ssd:DefaultExperiment startTime="1" stopTime="5">{}</ssd:DefaultExperiment>'


def annotated(kind, inside):
    return f'<ssd:Annotations><ssc:Annotation type="{kind}">{inside}</ssc:Annotation></ssd:Annotations>'


def oms(inside):
    information = f"<oms:SimulationInformation>{inside}</oms:SimulationInformation>"
    more = annotated("org.openmodelica", f'<oms:Annotations xmlns:oms="o">{information}</oms:Annotations>')
    return system(component("a"), more=more)


def times(found):
    return found.stepping.start_time, found.stepping.stop_time, found.stepping.step, found.stepping.algorithm


def test_times_that_the_fmus_recommend(read):
    """The gadget recommends 20 s in steps of 0.05 s."""
    found = read(system(component("a")))
    assert times(found) == (0.0, 20.0, 0.05, "gauss-seidel")
    assert told(found, "it gives no stop time; 20 s is taken", "it gives no step; 0.05 s is taken") == [True, True]


def test_times_that_nobody_recommends(read):
    plain = packed({"modelDescription.xml": DESCRIPTION.replace('stopTime="20" stepSize="0.05"', "")})
    found = read(system(component("a")), {"resources/gadget.fmu": plain})
    assert times(found)[:3] == (0.0, 1.0, 0.1)


def test_the_default_experiment(read):
    assert times(read(system(component("a")), after=UNITS + EXPERIMENT.format("")))[:2] == (1.0, 5.0)
    with pytest.raises(ScenarioError, match="startTime of DefaultExperiment is 'soon', not a number"):
        read(system(component("a")), after=UNITS + EXPERIMENT.format("").replace('"1"', '"soon"'))


def test_a_fixed_step_of_omsimulator(read):
    fixed = '<oms:FixedStepMaster description="oms-ma" stepSize="0.25" relativeTolerance="1e-4"/>'
    assert times(read(oms(f"<!-- c -->{fixed}")))[2:] == (0.25, "jacobi")
    with pytest.raises(ScenarioError, match=r"stepSize is 0\.0, not a positive number"):
        read(oms(fixed.replace("0.25", "0")))


def test_a_variable_step_of_omsimulator(read):
    varied = '<oms:VariableStepMaster description="oms-mav" minimumStepSize="0.001" maximumStepSize="0.5"/>'
    found = read(oms(varied))
    assert times(found)[2:] == (0.5, "adaptive")
    assert (found.stepping.min_step, found.stepping.tolerance) == (0.001, 1e-4)
    plain = packed(
        {"modelDescription.xml": DESCRIPTION.replace("canGetAndSetFMUstate", "canHandleVariableCommunicationStepSize")}
    )
    found = read(oms(varied), {"resources/gadget.fmu": plain})
    assert times(found)[2:] == (0.5, "jacobi")
    assert told(found, "steps that vary need FMUs that save their state") == [True]


def test_a_solver_of_omsimulator_is_left_out(read):
    found = read(oms('<oms:VariableStepSolver description="cvode"/>'))
    assert times(found)[2:] == (0.05, "gauss-seidel")
    assert told(found, "VariableStepSolver of OMSimulator is for models without a solver of their own") == [True]


def osp(inside):
    return UNITS + EXPERIMENT.format(
        annotated("com.opensimulationplatform", f'<osp:Algorithm xmlns:osp="o">{inside}</osp:Algorithm>')
    )


def test_steps_of_osp(read):
    """The system's, and those that components hint at where they are multiples of it."""
    hint = annotated("com.opensimulationplatform", '<osp:StepSizeHint xmlns:osp="o" value="{}"/>')
    parts = "".join(
        component(name, hint.format(step) if step else "")
        for name, step in (("a", 0.4), ("b", 0.25), ("c", 0.1), ("d", 0))
    )
    found = read(system(parts), after=osp('<osp:FixedStepAlgorithm baseStepSize="0.1"/>'))
    assert times(found) == (1.0, 5.0, 0.1, "jacobi")
    assert {name: one.step for name, one in found.instances.items()} == {"a": 0.4, "b": None, "c": None, "d": None}
    assert told(found, "its step 0.25 s is no multiple of 0.1 s, and is left out") == [True]
    found = read(system(component("a")), after=osp("<osp:Other/>"))
    assert told(found, "the algorithm of its annotation is not known here") == [True]


def test_a_hint_that_is_no_number(read):
    hint = annotated("com.opensimulationplatform", '<osp:StepSizeHint xmlns:osp="o" value="x"/>')
    with pytest.raises(ScenarioError, match="value of StepSizeHint is 'x', not a number"):
        read(system(component("a", hint)))


def test_annotations_of_others_are_left_out(read):
    found = read(system(component("a"), more=annotated("org.example", "<x:Y xmlns:x='x'/>")))
    assert times(found)[2:] == (0.05, "gauss-seidel")


def test_many_names_are_told_in_part(read):
    inner = "".join(system(component("c"), name=f"s{k}") for k in range(10))
    found = read(system(inner))
    assert told(found, "s0.c is s0_c", "s7.c is s7_c, and 2 more") == [True, True]


def test_units_as_the_schema_does_not_allow_them(read):
    """They convert nothing."""
    after = '<ssd:Units><ssc:Unit name="m/s"/><ssc:Unit name="x"><ssc:BaseUnit m="one"/></ssc:Unit></ssd:Units>'
    found = read(system(component("a") + component("b"), connection("a.y", "b.u")), after=after)
    assert found.connections[0].convert


def test_two_connectors_of_one_name(read):
    twice = (
        '<ssd:Connectors><ssd:Connector name="y" kind="input"/><ssd:Connector name="y" kind="output"/></ssd:Connectors>'
    )
    found = read(system(component("a", shown=twice) + component("b"), connection("a.y", "b.u")))
    assert told(found, "a has two connectors 'y'; the last counts") == [True]
    assert found.connections[0].source == "a.y"


def own(inside):
    """An annotation of ours, which an export writes."""
    return annotated("railcosim", inside)


def named(*names):
    """Components a, b, ... of the gadget with our names for them."""
    return "".join(
        component(letter, own(f'<r:Instance xmlns:r="r" {name}/>')) for letter, name in zip("abcd", names, strict=False)
    )


def test_names_of_ours_come_back(read):
    found = read(system(named('name="cart[2]"', 'name="cart[1]"', 'name="b_"', "")))
    assert list(found.instances) == ["cart[2]", "cart[1]", "b_", "d"]
    assert told(found, "names of instances") == [False]


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        (('name="cart[1]"', 'name="cart[3]"'), ["a", "b"]),  # one of the family is gone
        (('name="cart[1]"', 'name="cart"'), ["a", "b"]),
        (('name="cart"', 'name="cart"'), ["a", "b"]),
        (('name="../x"', 'name="cart[0]"'), ["a", "b"]),
        (("", 'name="a"'), ["a_2", "a"]),  # what is ours comes first
    ],
)
def test_names_that_do_not_go_together_are_left(read, names, expected):
    found = read(system(named(*names)))
    assert list(found.instances) == expected


def test_how_an_instance_runs_by_our_annotation(read):
    options = 'name="a" isolate="true" step_timeout="2.5" memory_limit="64" swapped="true"'
    left = '<r:Left name="fast" value="true"/><r:Left name="limit" value="0.5"/>'
    inside = f'<r:Instance xmlns:r="r" {options}>{left}</r:Instance>'
    one = read(system(component("a", own(inside)))).instances["a"]
    assert (one.isolate, one.step_timeout, one.memory_limit, one.swapped) == (True, 2.5, 64.0, True)
    assert one.start == {"fast": True, "limit": 0.5}
    with pytest.raises(ScenarioError, match=r"ssd:4: step_timeout of Instance is 'soon', not a number"):
        read(system(component("a", own(inside.replace("2.5", "soon")))))


def test_delays_by_our_annotation_add_up(read):
    def late(start, end, facts):
        return connection(start, end, own(f'<r:Connection xmlns:r="r" {facts}/>'))

    inner = system(component("b"), late("i", "b.u", 'delay="2" threshold="0.25"'), connectors(i="input"), name="inner")
    wires = late("a.y", "inner.i", 'delay="1"')
    (found,) = read(system(component("a") + inner, wires)).connections
    assert (found.delay, found.threshold) == (3, 0.25)
    with pytest.raises(ScenarioError, match=r"delay of Connection is '1\.5', not a whole number"):
        read(system(component("a") + inner, wires.replace('"1"', '"1.5"')))


def scenario_of(text):
    return UNITS + EXPERIMENT.format("") + own(f'<r:Scenario xmlns:r="r">{text}</r:Scenario>')


def test_what_only_a_scenario_says_comes_from_our_annotation(archive):
    """Times are those of the standard, whatever the annotation says of them."""
    text = """
title = "Gadgets"
[simulation]
stop_time = 99.0
record = 0.5
seed = 3
[instances.b]
fmu = "other.fmu"
[metrics]
last = "final(a.y)"
"""
    found = load(archive(structure(system(component("a")), scenario_of(text))))
    assert (found.provenance.title, found.judged.metrics) == ("Gadgets", {"last": "final(a.y)"})
    assert times(found) == (1.0, 5.0, 0.05, "gauss-seidel")
    assert (found.stepping.record, found.seed, list(found.instances)) == (0.5, 3, ["a"])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a = ", r"SystemStructure\.ssd:\d+:\d+: .*Invalid value"),
        ("[metrics]\nx = 2020-01-01", r"SystemStructure\.ssd:\d+: a scenario cannot hold datetime\.date"),
        ("simulation = 3", r"SystemStructure\.ssd:\d+: simulation"),
        ("events = [1, 2]", r"SystemStructure\.ssd:\d+: events: is a list of tables"),
        ("[require]\nx = { y = { z = 1 } }", r"SystemStructure\.ssd:\d+: require"),
        ("[colour]\nx = 1", r"SystemStructure\.ssd:\d+: colour: unknown key 'colour'"),
    ],
)
def test_what_is_wrong_with_our_annotation_is_told(archive, text, message):
    with pytest.raises(ScenarioError, match=message):
        load(archive(structure(system(component("a")), scenario_of(text))))
