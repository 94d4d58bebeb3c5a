"""What the tests of the orchestrator share: a cache of their own, components of a user's, FMUs of another maker's."""

import ast
import contextlib
import functools
import hashlib
import os
import shutil
import signal
import subprocess
import zipfile
from pathlib import Path
from xml.sax.saxutils import quoteattr

import fmpy
import pytest
import pythonfmu
from railcosim.orchestrator.fmi.archive import Workspace
from railcosim.orchestrator.fmi.models import load_fmu

TOYS = Path(__file__).parents[1] / "toys.py"
_WRAPPER = next(
    (Path(pythonfmu.__file__).parent / "resources" / "binaries" / fmpy.platform).glob("*pythonfmu-export.*")
)

_HEADERS = Path(fmpy.__file__).parent / "c-code"
_PLACES = ("ON_INSTANTIATE", "ON_RESET", "ON_GET", "ON_STEP", "ON_RESTORE", "ON_FREE")
_LAG = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="Lag" guid="{1}" generationTool="a test">
  <CoSimulation modelIdentifier="Lag" canGetAndSetFMUstate="true"/>
  <ModelVariables>
    <ScalarVariable name="y" valueReference="0" causality="output"><Real/></ScalarVariable>
    <ScalarVariable name="u" valueReference="1" causality="input"><Real start="0"/></ScalarVariable>
    <ScalarVariable name="k" valueReference="2" causality="parameter" variability="fixed">
      <Real start="1"/>
    </ScalarVariable>
  </ModelVariables>
  <ModelStructure>
    <Outputs><Unknown index="1"/></Outputs><InitialUnknowns><Unknown index="1"/></InitialUnknowns>
  </ModelStructure>
</fmiModelDescription>
"""

_SLAVE = '''import math

globals().setdefault("_references", []).append(globals())  # pythonfmu drops one it does not own


class Fmi2Slave:
    """Keeps values by reference, and writes down every call in a file if there is one."""

    def __init__(self, **wrapper):
        self.name, self.v, self.kept = wrapper["instance_name"], dict(START), []

    def note(self, call):
        if TRACE:
            with open(TRACE, "a") as stream:
                stream.write(f"{self.name} {call}\\n")

    def _get_log_queue(self):
        return self.kept

    def setup_experiment(self, *_):
        self.note("setup")

    def enter_initialization_mode(self):
        self.note("enter")

    def exit_initialization_mode(self):
        self.note("exit")

    def terminate(self):
        self.note("terminate")

    def do_step(self, t, h):
        self.note("step")
        return self.step(t, h, self.v) is not False

    def step(self, t, h, v):
        pass

    def refresh(self, v):
        pass

    def get(self, references):
        self.note("get")
        self.refresh(self.v)
        return [self.v[k] for k in references]

    def set(self, references, values):
        self.note("set")
        self.v.update(zip(references, values))

    get_real = get_integer = get_boolean = get_string = get
    set_real = set_integer = set_boolean = set_string = set


class Slave(Fmi2Slave):
'''


@pytest.fixture(scope="session", autouse=True)
def own_cache(session_cache):
    """The session's cache: no test may be served by what an earlier version left in the user's."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RAILCOSIM_CACHE", str(session_cache))
        yield


@pytest.fixture(scope="session")
def mine(session_cache):
    """Reference of a toy component by its class name: a component of a user's, in a file of theirs.

    The file has this toy alone, in its lines: a user's file is run each time one of its components is asked for.
    """
    text = TOYS.read_text(encoding="utf-8")
    places = {node.name: node for node in ast.parse(text).body if isinstance(node, ast.ClassDef)}

    @functools.cache
    def alone(cls):
        lines = text.splitlines()
        for node in (node for name, node in places.items() if name != cls):
            lines[node.lineno - 1 : node.end_lineno] = [""] * (node.end_lineno - node.lineno + 1)
        path = session_cache.with_name("toys") / cls / TOYS.name
        path.parent.mkdir(parents=True, exist_ok=True)
        own = path.with_suffix(f".{os.getpid()}")
        own.write_text("\n".join(lines) + "\n", encoding="utf-8")
        own.replace(path)  # other processes of the session write the same
        return f"{path}:{cls}"

    return alone


@pytest.fixture
def workspace():
    with Workspace() as place:
        yield place


def variable(name, causality, kind="Real", start=None, dependencies=None, **attributes):
    """A scalar variable of a hand-written model description, for `foreign`."""
    return {"name": name, "causality": causality, "kind": kind, "start": start, "on": dependencies, **attributes}


def description(variables, units="", *, identifier="Foreign", simulation="", version="2.0"):
    """A model description as another tool might write it."""
    lines = []
    for reference, v in enumerate(variables):
        own = {k: v[k] for k in ("variability", "initial") if k in v}
        typed = {k: v[k] for k in ("unit", "min", "max", "declaredType") if k in v}
        if v["start"] is not None and v["causality"] != "output":
            typed["start"] = str(v["start"]).lower() if isinstance(v["start"], bool) else v["start"]
        lines.append(
            f'<ScalarVariable name="{v["name"]}" valueReference="{reference}" causality="{v["causality"]}"'
            f"{''.join(f' {k}={quoteattr(str(x))}' for k, x in own.items())}>"
            f"<{v['kind']}{''.join(f' {k}={quoteattr(str(x))}' for k, x in typed.items())}/></ScalarVariable>"
        )
    index = {v["name"]: k + 1 for k, v in enumerate(variables)}
    shown = [v for v in variables if v["causality"] == "output"]
    outputs = "".join(
        f'<Unknown index="{index[v["name"]]}"'
        + ("/>" if v["on"] is None else f' dependencies="{" ".join(str(index[n]) for n in v["on"])}"/>')
        for v in shown
    )
    initial = "".join(f'<Unknown index="{index[v["name"]]}"/>' for v in shown)
    structure = f"<Outputs>{outputs}</Outputs><InitialUnknowns>{initial}</InitialUnknowns>" if shown else ""
    return (
        f'<?xml version="1.0" encoding="UTF-8"?>\n<fmiModelDescription fmiVersion="{version}" modelName="{identifier}"'
        f' guid="{{1}}" generationTool="PythonFMU by hand"><CoSimulation modelIdentifier="{identifier}" {simulation}/>'
        f"{f'<UnitDefinitions>{units}</UnitDefinitions>' if units else ''}"
        f"<ModelVariables>{''.join(lines)}</ModelVariables><ModelStructure>{structure}</ModelStructure>"
        "</fmiModelDescription>"
    )


def write_archive(path, files):
    """A zip of the given contents by entry name."""
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return path


@pytest.fixture
def foreign(tmp_path):
    """Make an FMU of another maker: no annotation of ours, and whatever is in the model description.

    ``body`` gives the methods ``step(self, t, h, v)`` and ``refresh(self, v)`` on values by value reference.
    """

    def make(
        variables, body="    pass\n", *, name="foreign.fmu", trace="", platform=fmpy.platform, library="Foreign", **of
    ):
        start = {k: v["start"] if v["start"] is not None else 0.0 for k, v in enumerate(variables)}
        script = f"START, TRACE = {start!r}, {str(trace)!r}\n{_SLAVE}{body}"
        module = f"foreign_{hashlib.sha256(script.encode()).hexdigest()[:16]}"
        files = {
            "modelDescription.xml": description(variables, **of),
            "resources/slavemodule.txt": module,
            f"resources/{module}.py": script,
            f"binaries/{platform}/{library}{fmpy.sharedLibraryExtension}": _WRAPPER.read_bytes(),
        }
        return str(write_archive(tmp_path / name, files))

    return make


@pytest.fixture(scope="session")
def xml():
    """The writers of hand-made descriptions and archives, by name."""
    return {"variable": variable, "description": description, "write_archive": write_archive}


FOREIGN = Path(__file__).parent / "foreign"
GCC = shutil.which("gcc")


@pytest.fixture(scope="session")
def compile_c(tmp_path_factory):
    """A C file beside the tests as the content of a shared library."""
    made = {}

    def build(name, *options):
        if GCC is None:
            pytest.skip("FMUs by hand need gcc")
        if (name, *options) not in made:
            target = tmp_path_factory.mktemp("c") / f"{name}{fmpy.sharedLibraryExtension}"
            subprocess.run([GCC, "-shared", "-fPIC", "-O1", *options, FOREIGN / name, "-o", target, "-lm"], check=True)
            made[name, *options] = target.read_bytes()
        return made[name, *options]

    return build


@pytest.fixture
def by_hand(compile_c, tmp_path):
    """The FMU of fmi1.c or fmi3.c, with parts of its description replaced, and another library's name."""
    facts = {1: ("First", fmpy.platform), 3: ("Third", fmpy.platform_tuple)}

    def pack(version, *changes, library=None, name=None, options=()):
        identifier, platform = facts[version]
        text = (FOREIGN / f"fmi{version}.xml").read_text(encoding="utf-8")
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        files = {
            "modelDescription.xml": text,
            f"binaries/{platform}/{library or identifier}{fmpy.sharedLibraryExtension}": compile_c(
                f"fmi{version}.c", *options
            ),
        }
        return write_archive(tmp_path / (name or f"{identifier.lower()}.fmu"), files)

    return pack


@pytest.fixture(scope="session")
def lag_description():
    """The description of the FMU of `lag`."""
    return _LAG


@pytest.fixture
def lag(compile_c, tmp_path):
    """A small FMU in C, with code of choice put in at some places: dy/dt = k + u - y, Euler."""

    def make(description=_LAG, library="Lag", platform=fmpy.platform, name="lag.fmu", options=(), **code):
        defined = [f"-D{place}={code.get(place.lower(), '')}" for place in _PLACES]
        defined += [f"-D{name.upper()}={text}" for name, text in code.items() if name.upper() not in _PLACES]
        binary = compile_c("lag.c", f"-I{_HEADERS}", *defined, *options)
        path = tmp_path / name
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr("modelDescription.xml", description)
            archive.writestr(f"binaries/{platform}/{library}{fmpy.sharedLibraryExtension}", binary)
        return path

    return make


@pytest.fixture
def arrays(compile_c, tmp_path):
    """The FMU of arrays3.c, with parts of its description replaced."""

    def pack(*changes):
        text = (FOREIGN / "arrays3.xml").read_text(encoding="utf-8")
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        library = f"binaries/{fmpy.platform_tuple}/Arrays{fmpy.sharedLibraryExtension}"
        return write_archive(tmp_path / "arrays.fmu", {"modelDescription.xml": text, library: compile_c("arrays3.c")})

    return pack


@pytest.fixture
def shaped(compile_c, tmp_path):
    """The FMU of shaped3.c, with parts of its description replaced."""

    def pack(*changes, name="shaped.fmu"):
        text = (FOREIGN / "shaped3.xml").read_text(encoding="utf-8")
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        library = f"binaries/{fmpy.platform_tuple}/Shaped{fmpy.sharedLibraryExtension}"
        return write_archive(tmp_path / name, {"modelDescription.xml": text, library: compile_c("shaped3.c")})

    return pack


@pytest.fixture
def odd(odd_fmu, tmp_path):
    """The FMU of odd.c: y depends directly on v."""
    return odd_fmu(tmp_path)


@pytest.fixture(scope="session")
def odd_fmu(compile_c):
    """Writes the FMU of odd.c into a folder; ``able`` are the abilities that it is said to have."""

    def write(folder, *able):
        simulation = " ".join(f'{name}="true"' for name in able)
        return str(write_archive(folder / "odd.fmu", _odd_files(compile_c("odd.c"), simulation)))

    return write


def _odd_files(binary, simulation):
    v, discrete = variable, {"variability": "discrete"}
    shown = [
        v("u", "input", start=0.0, unit="m"),
        v("v", "input", start=0.0),
        v("x", "output", dependencies=[], unit="m"),
        v("y", "output", dependencies=["v"]),
        v("m", "input", "Integer", 0, **discrete),
        v("n", "output", "Integer", **discrete),
        v("on", "input", "Boolean", False, **discrete),
        v("off", "output", "Boolean", **discrete),
        v("mode", "parameter", "Integer", 0, variability="tunable"),
    ]
    unit = '<Unit name="m"><BaseUnit m="1"/></Unit>'
    return {
        "modelDescription.xml": description(shown, unit, identifier="Odd", simulation=simulation),
        f"binaries/{fmpy.platform}/Odd{fmpy.sharedLibraryExtension}": binary,
    }


@pytest.fixture
def alone(workspace):
    """An instance of an FMU file, not yet initialized; given back at the end."""
    made = []

    def make(path, name="it", structure=None):
        made.append(load_fmu(Path(path), workspace, structure=structure or {}).instantiate(name))
        return made[-1]

    yield make
    for one in made:
        one.free()


@pytest.fixture
def hostile(compile_c, tmp_path):
    """The FMU of hostile.c; ``deed`` is what it does before it can be told; one that is ``mute`` gives no text."""
    v, discrete = variable, {"variability": "discrete"}
    shown = [
        v("u", "input", start=0.0),
        v("v", "input", start=0.0),
        v("x", "output", dependencies=[]),
        v("y", "output", dependencies=["v"]),
        v("calls", "output", dependencies=[]),
        v("pid", "output", dependencies=[]),
        v("m", "input", "Integer", 0, **discrete),
        v("n", "output", "Integer", dependencies=["m"], **discrete),
        v("on", "input", "Boolean", False, **discrete),
        v("off", "output", "Boolean", dependencies=["on"], **discrete),
        v("deed", "parameter", "String", "", variability="fixed"),
        v("word", "input", "String", "", **discrete),
        v("said", "output", "String", dependencies=["word"], **discrete),
    ]
    abilities = "canGetAndSetFMUstate canSerializeFMUstate providesDirectionalDerivative canInterpolateInputs "
    abilities += "canHandleVariableCommunicationStepSize"

    def pack(deed="", *, simulation="", name="hostile.fmu", mute=False):
        able = " ".join(f'{ability}="true"' for ability in f"{abilities} {simulation}".split())
        files = {
            "modelDescription.xml": description(shown[: -1 if mute else None], identifier="Hostile", simulation=able),
            f"binaries/{fmpy.platform}/Hostile{fmpy.sharedLibraryExtension}": compile_c("hostile.c"),
            "resources/deed.txt": deed,
        }
        return str(write_archive(tmp_path / name, files))

    return pack


@pytest.fixture
def in_time():
    """A test that hangs fails instead."""

    def late(*_):
        raise TimeoutError("the test hangs")

    if not hasattr(signal, "SIGALRM"):  # on Windows
        yield
        return
    before = signal.signal(signal.SIGALRM, late)
    signal.alarm(90)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


@pytest.fixture
def nothing_left():
    """A test that leaves processes of isolated instances behind fails."""
    yield
    left = []
    for place in Path("/proc").glob("[0-9]*/cmdline"):
        with contextlib.suppress(OSError):
            parent = int((place.parent / "stat").read_text().rpartition(")")[2].split()[1])
            if parent == os.getpid() and "isolation.host" in place.read_text().split("\0"):
                left.append(place.parent.name)
    assert not left
