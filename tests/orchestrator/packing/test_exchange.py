"""Systems as other tools run them: SSP archives that come back the same, and libcosim's system structure."""

import dataclasses
import json
import zipfile
from pathlib import Path
from types import SimpleNamespace

import fmpy
import numpy as np
import pytest
from lxml import etree
from railcosim.fmus.build import native_problem
from railcosim.fmus.references import resolve
from railcosim.orchestrator import Event, ScenarioError, System, load, run
from railcosim.orchestrator.cli.app import call
from railcosim.orchestrator.fmi.archive import Workspace
from railcosim.orchestrator.packing import exchange
from railcosim.orchestrator.packing.exchange import export
from railcosim.orchestrator.run.checking import check
from railcosim.orchestrator.scenario.loading import import_ssp
from railcosim.orchestrator.system import Connection
from railcosim.orchestrator.wiring.links import Wiring

needs_compiler = pytest.mark.skipif(
    bool(native_problem(resolve("PointMassTrain"))), reason="native FMUs cannot be made here"
)
SCHEMAS = Path(fmpy.__file__).parent / "ssp" / "schema"
KINDS = {".ssd": "SystemStructureDescription", ".ssv": "SystemStructureParameterValues"}
UNITS = '<Unit name="m"><BaseUnit m="1"/></Unit><Unit name="km"><BaseUnit m="1" factor="1000"/></Unit><Unit name="?"/>'
ITEMS = '<Item name="park" value="1"/><Item name="drive" value="5"/>'
TYPES = f'<TypeDefinitions><SimpleType name="Gear"><Enumeration>{ITEMS}</Enumeration></SimpleType></TypeDefinitions>'
SCENARIO = """
title = "A gust"
[simulation]
stop_time = 3.0
step = 0.1
[instances.train]
component = "PointMassTrain"
start.speed = 5.0
start.force = 0.0
[instances.gust]
component = "Gust"
start.stop_time = 1.5
[connections]
"train.disturbance" = { from = "gust.acceleration", delay = 1 }
[presets.weak]
"gust.size" = 0.1
[presets.strong]
"gust.size" = 2.0
[require]
forward = "always train.speed > 0"
[metrics]
slowest = "min(train.speed)"
[[events]]
signal = "gust.acceleration"
action = "bias"
value = -0.25
at = 0.5
[[figures]]
title = "speed"
y = ["train.speed"]
"""


@pytest.fixture
def cart(xml, tmp_path):
    """An FMU of every type that need not run; its library is a file of that name."""
    v, discrete, gear = xml["variable"], {"variability": "discrete"}, {"declaredType": "Gear"}
    shown = [
        v("u", "input", start=0.0, unit="m"),
        v("d", "input", start=0.0, unit="km"),
        v("v", "input", start=0.0),
        v("x", "output", dependencies=[], unit="m"),
        v("y", "output", dependencies=["v"], unit="?"),
        v("n", "input", "Integer", 0, **discrete),
        v("m", "output", "Integer", **discrete),
        v("on", "input", "Boolean", False, **discrete),
        v("off", "output", "Boolean", **discrete),
        v("gear", "input", "Enumeration", 1, **discrete, **gear),
        v("next", "output", "Enumeration", **discrete, **gear),
        v("word", "input", "String", "", **discrete),
        v("said", "output", "String", **discrete),
        v("k", "parameter", start=1.0, variability="fixed"),
        v("whole", "parameter", "Integer", 1, variability="fixed"),
        v("flag", "parameter", "Boolean", False, variability="fixed"),
        v("mode", "parameter", "Enumeration", 1, variability="fixed", **gear),
        v("label", "parameter", "String", "", variability="fixed"),
    ]

    def make(name="cart.fmu", **changes):
        text = xml["description"](shown, UNITS, identifier="Cart", **changes)
        files = {
            "modelDescription.xml": text.replace("<ModelVariables>", f"{TYPES}<ModelVariables>"),
            f"binaries/{fmpy.platform}/Cart{fmpy.sharedLibraryExtension}": b"",
        }
        (tmp_path / name).parent.mkdir(exist_ok=True)
        return str(xml["write_archive"](tmp_path / name, files))

    return make


def plain(cart):
    """Two carts and a third of other make, and what goes between any tools."""
    system = System(stop_time=2.0, step=0.1, start_time=1.0, algorithm="jacobi", name="carts & co", title="Carts <&>")
    values = {"k": 1e-300, "whole": -3, "flag": True, "label": 'a "b"\n<c>'}
    system.add("cart[1]", cart("a.fmu"), **values)
    system.add("cart[2]", cart("a.fmu"))
    system.add("cart_1", cart("b/a.fmu"), v=0.1)
    system.connect("cart[1].x", "cart[2].u")
    system.connect("cart[1].y", "cart[2].v", scale=2.0, offset=-1.0)
    system.connect("cart[2].off", "cart[1].on")
    system.connect("cart[2].m", "cart_1.n")
    return system


def full(cart):
    """The same with all that only we read."""
    system = plain(cart)
    system.instances["cart[1]"].start["mode"] = "drive"
    system.instances["cart[1]"].step, system.instances["cart[2]"].isolate = 0.2, True
    system.instances["cart_1"].isolate = "together"
    system.instances["cart[2]"].step_timeout, system.instances["cart[2]"].memory_limit = 5.0, 0.5
    swapped = system.instances["cart_1"]
    swapped.swapped, swapped.start["limit"], swapped.start["fast"] = True, 3.0, True
    system.connections[0].delay = 2
    system.connections += [
        Connection("cart[1].x", "cart[2].d"),
        Connection("cart[1].x", "cart_1.d", convert=False),
        Connection("cart[1].y", "cart_1.u", scale=1.0),
        Connection("cart[2].m", "cart[1].n", map={"1": 10, "-2": 3}),
        Connection("cart_1.off", "cart[2].on", map={"true": False, "false": True}),
        Connection("cart[2].next", "cart[1].gear", map={"park": "drive"}),
        Connection("cart_1.y", "cart[2].n", threshold=0.5),
        Connection("cart[1].said", "cart[2].word"),
        Connection("cart[1].gone", "cart_1.gone", optional=True),
    ]
    system.events = [Event("cart[1].x", "freeze", 1.25, duration=0.5), Event("cart[1].y", "bias", 1.5, 0.25)]
    system.stepping.algorithm, system.stepping.order = "gauss-seidel", ["cart_1", "cart[2]", "cart[1]"]
    system.stepping.record, system.stepping.record_only, system.seed = 0.5, ["cart*.x"], 7
    system.stepping.extrapolation = 1
    system.judged.requirements = {"small": "always cart[i].x < cart_1.limit and cart_1.fast"}
    system.judged.metrics = {"largest": "max(cart[i].x)"}
    system.judged.figures = [{"title": "places", "y": ["cart[:].x"], "bands": [[0, 1e-3]]}]
    system.study = {"runs": 3, "vary": {"cart.k": [1.0, 2.0]}}
    return system


def resolved(system, workspace):
    """Start values and scalar connections of a system, as they will run."""
    wiring = check(system, workspace).wiring
    links = [(str(x.target), str(x.source), x.scale, x.offset, x.delay, x.threshold, x.mapping) for x in wiring.links]
    return wiring.starts, wiring.left, links


def faults(path):
    """What the standard's schemas have against the documents of an archive."""
    found = []
    with zipfile.ZipFile(path) as archive:
        for name in archive.namelist():
            if (kind := KINDS.get(Path(name).suffix)) is not None:
                schema = etree.XMLSchema(file=str(SCHEMAS / f"{kind}.xsd"))
                schema.validate(etree.fromstring(archive.read(name)))
                found += [f"{name}: {error}" for error in schema.error_log]
    return found


@pytest.mark.parametrize("make", [plain, full])
def test_an_archive_keeps_to_the_schemas_and_comes_back_the_same(make, cart, workspace, tmp_path):
    system, path = make(cart), tmp_path / "carts.ssp"
    exported = export(system, path)
    assert exported.files == (path,)
    assert exported.parts == 3
    assert faults(path) == []
    again = load(path)
    assert again.provenance.notes == ()
    assert list(again.instances) == ["cart[1]", "cart[2]", "cart_1"]
    assert resolved(again, workspace) == resolved(system, workspace)
    for figure in again.judged.figures:
        figure.pop("remark", None)  # which a swap leaves
    for part in ("stepping", "judged", "events", "seed", "study"):
        assert getattr(again, part) == getattr(system, part), part
    for name, instance in system.instances.items():
        other = again.instances[name]
        for key in ("step", "isolate", "step_timeout", "memory_limit", "swapped"):
            assert getattr(other, key) == getattr(instance, key), f"{name}: {key}"
    scenario = tmp_path / "carts.toml"
    scenario.write_text(import_ssp(str(path), tmp_path / "fmus", tmp_path), encoding="utf-8")
    imported = load(scenario)
    assert resolved(imported, workspace) == resolved(system, workspace)
    assert (imported.stepping, imported.events) == (system.stepping, system.events)
    before = path.read_bytes()
    export(system, path)
    assert path.read_bytes() == before  # the same system gives the same bytes


def test_names_and_connectors_are_those_that_others_take(cart, foreign, xml, tmp_path):
    system = plain(cart)
    system.add("idle", foreign([xml["variable"]("k", "parameter", start=1.0, variability="fixed")]))
    export(system, tmp_path / "carts.ssp")
    assert faults(tmp_path / "carts.ssp") == []
    with zipfile.ZipFile(tmp_path / "carts.ssp") as archive:
        top = etree.fromstring(archive.read("SystemStructure.ssd"))
        files = archive.namelist()
        start = etree.fromstring(archive.read("resources/cart_1.ssv"))
    components = {one.get("name"): one for one in top.iter("{*}Component")}
    assert list(components) == ["cart_1", "cart_2", "cart_1_2", "idle"]
    assert [one.get("source") for one in components.values()] == [
        *("resources/a.fmu", "resources/a.fmu", "resources/a_2.fmu", "resources/foreign.fmu")
    ]
    assert {name for name in files if name.startswith("resources/a")} == {"resources/a.fmu", "resources/a_2.fmu"}
    shown = {one.get("name"): (one.get("kind"), etree.QName(one[0]).localname) for one in components["cart_1"][0]}
    assert shown == {
        "x": ("output", "Real"),
        "y": ("output", "Real"),
        "m": ("output", "Integer"),
        "off": ("output", "Boolean"),
        "on": ("input", "Boolean"),
    }
    assert {one.get("name"): one[0].get("value") for one in start.iter("{*}Parameter")} == {
        "k": "1e-300",
        "whole": "-3",
        "flag": "true",
        "label": 'a "b"\n<c>',
    }
    assert [one.get("name") for one in top.iter("{*}Unit")] == ["m", "km"]


def test_what_others_do_otherwise_is_told(cart, tmp_path):
    notes = [
        one
        for one in export(plain(cart), tmp_path / "carts.ssp").notes
        if "Cart lists" not in one and "not connected" not in one
    ]
    assert notes == [
        "cart[i].v = cart[i].y: FMPy and fmu-manipulation-toolbox hand values on without the transformation",
    ]
    notes = "\n".join(export(full(cart), tmp_path / "carts.ssp", platforms=["win64", fmpy.platform]).notes)
    for line in (
        "algorithm gauss-seidel: other tools step all instances at once, as jacobi does",
        "extrapolation = 1: other tools do not do that",
        "delay = 2 of cart[i].u = cart[i].x: other tools hand the value on without it",
        "cart[i].n = cart_1.y: that Real feeds Integer is refused by libcosim",
        "cart[i].word = cart[i].said: not every tool hands on String",
        "cart[i].gear = cart[i].next: not every tool hands on Enumeration",
        "steps of their own (cart[1]): of other tools libcosim alone takes them",
        "events: other tools do not have them, and 2 of this system are missing there",
        "Cart, which was given as an FMU, has no binary for win64",
    ):
        assert line in notes
    assert f"binary for {fmpy.platform}" not in notes


def test_what_cannot_be_said_is_refused(cart, arrays, tmp_path):
    system = full(cart)
    system.connections.append(Connection("cart[2].m", "cart_1.gear", map={"1": "drive"}))
    with pytest.raises(ScenarioError, match="a map from one type to another has no place in SSP"):
        export(system, tmp_path / "carts.ssp")
    system.connections.pop()
    system.connect("cart[1].m", "cart_1.v", scale=2.0)
    with pytest.raises(ScenarioError) as caught:
        export(system, tmp_path / "carts.xml")
    for line in ("a map has no place in an Osp", "Real that feeds Integer has no place", "Integer that feeds Real has"):
        assert line in str(caught.value)
    system = plain(cart)
    system.connect("cart[1].m", "cart[1].n", scale=2.0, threshold=0.5)
    with pytest.raises(ScenarioError, match="libcosim transforms Reals alone, not Integer"):
        export(system, tmp_path / "carts.xml")
    with pytest.raises(ScenarioError, match=r"ends in \.ssp or \.xml; name it system\.ssp"):
        export(system, tmp_path / "carts.zip")
    assert not list(tmp_path.glob("carts.*"))
    sized = System(stop_time=1.0, step=0.1)
    sized.add("it", str(arrays()), {"columns": 2})
    with pytest.raises(ScenarioError, match=r"structural parameters \(columns\) are not part of SSP 1\.0"):
        export(sized, tmp_path / "sized.ssp")
    sized.instances["it"].build = {}
    assert any("is FMI 3.0: SSP 1.0 knows FMI 1.0 and 2.0" in one for one in export(sized, tmp_path / "s.ssp").notes)


def test_a_system_structure_of_libcosim(cart, tmp_path):
    """Names, values and connections as libcosim's schema has them; a transformation is a function of its own."""
    system = plain(cart)
    system.instances["cart[2]"].step, system.instances["cart[1]"].start["mode"] = 0.2, "drive"
    exported = export(system, tmp_path / "osp" / "OspSystemStructure.xml")
    assert [path.name for path in exported.files] == ["OspSystemStructure.xml", "a.fmu", "a_2.fmu"]
    assert all(path.is_file() for path in exported.files)
    assert "requirements, metrics and figures have no place" in exported.notes[-1]
    root = etree.parse(exported.files[0]).getroot()
    assert [etree.QName(one).localname for one in root] == [
        *("StartTime", "EndTime", "BaseStepSize", "Algorithm", "Simulators", "Functions", "Connections")
    ]
    assert [one.text for one in root[:4]] == ["1.0", "2.0", "0.1", "fixedStep"]
    simulators = list(root.iter("{*}Simulator"))
    assert [(one.get("name"), one.get("source"), one.get("stepSize")) for one in simulators] == [
        *(("cart_1", "a.fmu", None), ("cart_2", "a.fmu", "0.2"), ("cart_1_2", "a_2.fmu", None))
    ]
    values = {one.get("variable"): one[0] for one in simulators[0].iter("{*}InitialValue")}
    assert {name: (etree.QName(one).localname, one.get("value")) for name, one in values.items()} == {
        "k": ("Real", "1e-300"),
        "whole": ("Integer", "-3"),
        "flag": ("Boolean", "true"),
        "mode": ("Integer", "5"),
        "label": ("String", 'a "b"\n<c>'),
    }
    (function,) = root.iter("{*}LinearTransformation")
    assert dict(function.attrib) == {"name": "transformation_0", "factor": "2.0", "offset": "-1.0"}
    pairs = [[tuple(end.attrib.values()) for end in pair] for pair in next(root.iter("{*}Connections"))]
    assert pairs == [
        [("cart_1", "x"), ("cart_2", "u")],
        [("cart_1", "y"), ("transformation_0", "in")],
        [("cart_2", "v"), ("transformation_0", "out")],
        [("cart_2", "off"), ("cart_1", "on")],
        [("cart_2", "m"), ("cart_1_2", "n")],
    ]
    alone = System(stop_time=1.0, step=0.1)
    alone.add("cart", cart())
    export(alone, tmp_path / "alone.xml")
    assert "Connections" not in (tmp_path / "alone.xml").read_text()


def same_bits(system, *others):
    """Whether runs of systems give the same numbers."""
    first = run(system)
    for other in others:
        again = run(other)
        assert again.names() == first.names()
        assert all(np.asarray(again[name]).tobytes() == np.asarray(first[name]).tobytes() for name in first.names())
        assert str(again.metrics) == str(first.metrics)
        assert [(one.name, one.verdict, one.margin) for one in again.requirements] == [
            (one.name, one.verdict, one.margin) for one in first.requirements
        ]
    return first


def round_trip(system, folder):
    """A system as it comes back from an archive, and from the scenario that is made of that."""
    path = folder / "system.ssp"
    export(system, path)
    assert faults(path) == []
    scenario = folder / "system.toml"
    scenario.write_text(import_ssp(str(path), folder / "fmus", folder), encoding="utf-8")
    return load(path), load(scenario)


def test_components_are_built_for_the_platforms_asked_for(cart, monkeypatch, tmp_path):
    asked = []
    built = {"native": cart("native.fmu"), "python": cart("python.fmu")}

    def package(reference, arguments, kind, platforms=()):
        asked.append((reference, arguments, kind, platforms))
        return Path(built[kind]), kind, ""

    system = System(stop_time=1.0, step=0.1)
    system.add("gust", "Gust")
    with Workspace() as workspace:
        (model,) = check(system, workspace, "python").models.values()
    monkeypatch.setattr(exchange, "package", package)
    for kind in built:
        made = SimpleNamespace(
            system=system,
            models={"gust": dataclasses.replace(model, kind=kind)},
            wiring=Wiring({"gust": {}}),
            notes=(),
        )
        monkeypatch.setattr(exchange, "check", lambda *_, made=made, **__: made)
        export(system, tmp_path / "gust.ssp", platforms=["all"])
        with zipfile.ZipFile(tmp_path / "gust.ssp") as archive:
            assert f"resources/{kind}.fmu" in archive.namelist()
    assert asked == [("Gust", {}, "native", ["all"]), ("Gust", {}, "python", ())]


@needs_compiler
def test_the_command_and_a_run_of_what_it_wrote(tmp_path, capsys):
    source, path = tmp_path / "gust.toml", tmp_path / "gust.ssp"
    source.write_text(SCENARIO, encoding="utf-8")
    options = ["--preset", "strong", "--stop", "2", "--set", "train.speed=6"]
    assert call(["export", str(source), "-o", str(path), *options]) == 0
    out = capsys.readouterr()
    assert str(path) in out.out
    assert "algorithm gauss-seidel: other tools" in out.out + out.err
    assert "presets: what is in force is written; not weak" in out.out + out.err
    assert call(["export", str(source), "-o", str(path), *options, "--json", "--quiet"]) == 0
    told = json.loads(capsys.readouterr().out)["result"]
    assert (told["files"], told["instances"]) == ([str(path)], 2)
    system = load(source, preset="strong", stop_time=2.0, settings=["train.speed=6"])
    assert len(same_bits(system, *round_trip(system, tmp_path)).time) == 21
    again = load(path)
    assert (again.provenance.title, again.provenance.preset) == ("A gust", "strong")
    assert [one["title"] for one in again.judged.figures] == [one["title"] for one in system.judged.figures]


@needs_compiler
@pytest.mark.parametrize(
    ("scenario", "preset", "stop"),
    [
        pytest.param("cailc", "heavy", 30.0, marks=pytest.mark.long),  # trips and what is learned in them
        pytest.param("fribourg_bern", None, 60.0, marks=pytest.mark.campaign),  # delays, a line as data
        pytest.param("predictive_platoon", "no-plans", 62.0, marks=pytest.mark.campaign),  # an event, noise
        pytest.param("fault_tolerant_eight", None, 5.0, marks=pytest.mark.campaign),  # arrays
    ],
)
def test_shipped_scenarios_come_back_to_the_bit(scenario, preset, stop, tmp_path):
    system = load(scenario, preset=preset, stop_time=stop)
    same_bits(system, *round_trip(system, tmp_path))
