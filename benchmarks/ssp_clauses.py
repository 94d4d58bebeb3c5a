"""Small SSP archives, one for each clause of the standard over which tools part, with the value that it gives by hand.

They are of gauges, y = 2 u + 10 m/s, which also show km/h: `a` gives 10 m/s, or 36 km/h, and `b` behind it 30 m/s.
Where a value is set, it is `a` that it is set for. All is at rest, so that neither the order of steps nor a delay
matters: the last value of one signal of one component at the top counts.
"""

import importlib.util
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any

from lxml import etree
from railcosim.fmus.build import build

HERE = Path(__file__).parent


def _writer() -> ModuleType:
    """What the tests of our reader write their archives with."""
    path = HERE.parent / "tests" / "orchestrator" / "ssp" / "conftest.py"
    spec = importlib.util.spec_from_file_location("ssp_writer", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


w = _writer()
_TIMES = '<ssd:DefaultExperiment startTime="0" stopTime="1"/>'
_SPEEDS = w.UNITS.replace("ssd:Units", "ssv:Units")
_LINEAR = '<ssc:LinearTransformation factor="3" offset="1"/>'
_TWICE = '<ssc:LinearTransformation factor="2" offset="1"/>'


@dataclass(frozen=True)
class Clause:
    """One clause.

    Attributes:
        heading: of the section of the standard. says: what it says, in our words.
        value: of the signal, found by hand; why: how.
        inside: the root system. files: what stands beside the structure.
        part: the FMU of the components, "gauge" or "store".
        unconverted: what a tool gives that leaves numbers alone where units differ, which the standard allows.
    """

    heading: str
    says: str
    value: float
    why: str
    inside: str
    signal: str = "a.y"
    files: Mapping[str, str | bytes] = field(default_factory=dict)
    part: str = "gauge"
    unconverted: float | None = None


def _shown(**kinds: str) -> str:
    """Connectors, all of which have a type: one without is too much for some."""
    return str(w.connectors(**kinds)).replace('"></ssd:Connector>', '"><ssc:Real/></ssd:Connector>')


def _gauge(name: str, bound: str = "", **kinds: str) -> str:
    """A gauge with connectors of these kinds, `y` alone by default: one that nothing leads to is too much for some."""
    shown = _shown(**(kinds or {"y": "output m/s"}))
    return str(w.component(name, bound, source="resources/gauge.fmu", shown=shown))


def _set(*values: tuple[str, float], **attributes: str) -> str:
    """A binding of inline values."""
    return str(w.binding(w.parameters(*((name, w.real(value)) for name, value in values)), **attributes))


def _inner() -> str:
    """A structure of its own, which hands out what its gauge gives."""
    inside = w.system(_gauge("g"), w.connection("g.y", "out"), _shown(out="output"))
    return str(w.structure(inside, w.UNITS + _TIMES, name="inner"))


def _clauses() -> list[Clause]:
    both = {"u": "input m/s", "y": "output m/s"}
    a, b, dial = _gauge("a"), _gauge("b", **both), _gauge("a", dial="output km/h")
    pair = a + b
    through = w.system("", w.connection("i", "o"), _shown(i="input", o="output"), name="t")
    through = through.replace("<ssd:Elements></ssd:Elements>", "")
    within = w.system(b, w.connection("i", "b.u") + w.connection("b.y", "o"), _shown(i="input", o="output"), name="s")
    table = w.mapping(("offset", "bias", _TWICE, ""))
    speed = w.mapping(("speed", "bias", _TWICE, ""))
    inline = f"<ssd:ParameterMapping>{table}</ssd:ParameterMapping>"
    kmh = w.parameters(("speed", w.real(18, "km/h")), units=_SPEEDS)
    given = w.parameters(("offset", w.real(3)), ("bias", w.real(4)))
    bus = '<ssd:SignalDictionaryReference name="{}" dictionary="bus">{}</ssd:SignalDictionaryReference>'
    entry = '<ssb:SignalDictionary version="1.0"><ssb:DictionaryEntry name="v"><ssc:Real/></ssb:DictionaryEntry>'
    words = f'<ssd:SignalDictionary name="bus">{entry}</ssb:SignalDictionary></ssd:SignalDictionary>'
    refs = bus.format("r", _shown(v="inout")) + bus.format("q", _shown(v="inout"))
    nested = w.component(
        "n", source="resources/inner.ssp", shown=_shown(out="output"), type="application/x-ssp-package"
    )
    store = w.component("a", w.bindings(_set(("x", 7), ("u", 0))), "resources/store.fmu", _shown(x="output"))
    dialled = w.connection("a.dial", "b.u")
    bound = w.bindings
    return [
        Clause("Connectors", "what is not connected keeps its start value", 10.0, "2·0 + 10", w.system(b), "b.y"),
        Clause("Connectors", "a type may be left out", 10.0, "bias = 10",
               w.system(w.component("a", "", "resources/gauge.fmu", w.connectors(y="output")))),
        Clause("Connections", "start and end give no direction", 30.0, "2·10 + 10",
               w.system(pair, w.connection("b.u", "a.y")), "b.y"),
        Clause("Connections", "a system's connectors hand on, in and out", 70.0, "2·(2·10 + 10) + 10",
               w.system(a + within + _gauge("c", **both),
                        w.connection("a.y", "s.i") + w.connection("s.o", "c.u")), "c.y"),
        Clause("Allowed Connections", "a system's input straight to its output", 30.0, "2·10 + 10",
               w.system(pair + through, w.connection("a.y", "t.i") + w.connection("t.o", "b.u")), "b.y"),
        Clause("Connections", "units of both ends are converted", 30.0, "36 km/h are 10 m/s; 2·10 + 10",
               w.system(dial + b, dialled), "b.y", unconverted=82.0),
        Clause("Connections", "not with `suppressUnitConversion`", 82.0, "2·36 + 10",
               w.system(dial + b, w.connection("a.dial", "b.u", suppressUnitConversion="true")), "b.y"),
        Clause("LinearTransformation", "factor · source + offset", 72.0, "2·(3·10 + 1) + 10",
               w.system(pair, w.connection("a.y", "b.u", _LINEAR)), "b.y"),
        Clause("LinearTransformation", "after the conversion of units", 72.0, "36 km/h are 10 m/s; 2·(3·10 + 1) + 10",
               w.system(dial + b, w.connection("a.dial", "b.u", _LINEAR)), "b.y", unconverted=228.0),
        Clause("ParameterBindings", "values inline", 5.0, "bias = 5", w.system(_gauge("a", bound(_set(("bias", 5)))))),
        Clause("ParameterBindings", "values in a file", 5.0, "bias = 5",
               w.system(_gauge("a", bound(w.binding("", source="resources/a.ssv")))),
               files={"resources/a.ssv": w.parameters(("bias", w.real(5)))}),
        Clause("ParameterBindings", "start values of other variables", 18.0, "u = 4: 2·4 + 10",
               w.system(_gauge("a", bound(_set(("u", 4)))))),
        Clause("ParameterBindings", "start values of outputs", 7.0, "x = 7, and it rests", w.system(store), "a.x",
               part="store"),
        Clause("ParameterBindings", "of one level, the later binding", 7.0, "5, then 7",
               w.system(_gauge("a", bound(_set(("bias", 5)), _set(("bias", 7)))))),
        Clause("ParameterBindings", "of several levels, the higher", 8.0, "5 at the component, 8 at the system",
               w.system(_gauge("a", bound(_set(("bias", 5)))), bound=bound(_set(("a.bias", 8))))),
        Clause("ParameterBindings", "`prefix`", 6.0, "at the system, prefix `a.`",
               w.system(a, bound=bound(_set(("bias", 6), prefix="a.")))),
        Clause("ParameterMapping", "a mapping in a file", 7.0, "offset = 3 to bias: 2·3 + 1; bias = 4 is not mapped",
               w.system(_gauge("a", bound(w.binding(given, '<ssd:ParameterMapping source="resources/a.ssm"/>')))),
               files={"resources/a.ssm": table}),
        Clause("ParameterMapping", "a mapping inline", 7.0, "the same",
               w.system(_gauge("a", bound(w.binding(given, inline))))),
        Clause("MappingEntry", "units are converted, then transformed", 11.0, "18 km/h are 5 m/s; 2·5 + 1",
               w.system(_gauge("a", bound(w.binding(kmh, f"<ssd:ParameterMapping>{speed}</ssd:ParameterMapping>")),
                               y="output m/s", bias="parameter m/s")), unconverted=37.0),
        Clause("Allowed Connections", "a system's parameter to a component's", 5.0, "p = 5",
               w.system(_gauge("a", y="output m/s", bias="parameter m/s"), w.connection("p", "a.bias"),
                        _shown(p="parameter"), bound(_set(("p", 5))))),
        Clause("SignalDictionaries", "one signal, wherever it is referred to", 30.0, "2·10 + 10",
               w.system(pair + refs, w.connection("a.y", "r.v") + w.connection("q.v", "b.u"),
                        more=f"<ssd:SignalDictionaries>{words}</ssd:SignalDictionaries>"), "b.y"),
        Clause("Component", "an SSP archive in place of a system", 30.0, "2·10 + 10",
               w.system(nested + b, w.connection("n.out", "b.u")), "b.y", files={"resources/inner.ssp": _inner()}),
    ]  # fmt: skip


CLAUSES = _clauses()


def parts(folder: Path) -> dict[str, bytes]:
    """The FMUs, by what clauses call them."""
    return {"gauge": build(f"{HERE / 'gauge.py'}:Gauge", kind="native").read_bytes(), "store": _store(folder)}


def _store(folder: Path) -> bytes:
    """A lag that rests, of which the output itself has a start value, as those of others have: ours have parameters."""
    from ring import light  # noqa: PLC0415

    path = light(build(f"{HERE / 'lag.py'}:Lag", kind="native"), folder)
    with zipfile.ZipFile(path) as old:
        files = {name: old.read(name) for name in old.namelist()}
    root: Any = etree.fromstring(files["modelDescription.xml"])
    variables = list(root.iter("ScalarVariable"))
    index = next(k for k, one in enumerate(variables, 1) if one.get("name") == "x")
    root.remove(root.find("VendorAnnotations"))  # by which we know that a parameter stands for the start value
    variables[index - 1].set("initial", "exact")
    variables[index - 1][0].set("start", "0")
    for unknown in root.iterfind("ModelStructure/InitialUnknowns/Unknown"):
        if unknown.get("index") == str(index):
            unknown.getparent().remove(unknown)
    return bytes(w.packed(files | {"modelDescription.xml": etree.tostring(root)}))


def write(clause: Clause, fmus: Mapping[str, bytes], path: Path) -> Path:
    """The archive of a clause."""
    fmu = fmus[clause.part]
    files: dict[str, str | bytes] = {"SystemStructure.ssd": w.structure(clause.inside, w.UNITS + _TIMES)}
    for name, content in clause.files.items():
        whole = {"SystemStructure.ssd": content, "resources/gauge.fmu": fmu}
        files[name] = w.packed(whole) if name.endswith(".ssp") else content
    path.write_bytes(w.packed(files | {f"resources/{clause.part}.fmu": fmu}))
    return path
