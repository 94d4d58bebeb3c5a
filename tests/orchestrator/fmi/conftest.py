"""What the tests of FMUs by other makers share: those of foreign.c, and commands run on systems of them."""

import json
import shutil
from dataclasses import dataclass

import fmpy
import pytest
from railcosim.orchestrator.cli import app as cli
from railcosim.orchestrator.errors import FmuFileError
from railcosim.orchestrator.master import compiled
from railcosim.orchestrator.run.recording import Results

LIBRARY = f"Foreign{fmpy.sharedLibraryExtension}"
ITEMS = '<Item name="low" value="1"/><Item name="high" value="3"/>'
GEAR = f'<SimpleType name="Gear"><Enumeration>{ITEMS}</Enumeration></SimpleType>'
VARIES = 'canHandleVariableCommunicationStepSize="true"'


def _variable(name, reference, causality, kind="Real", *, start=None, typed="", **own):
    """A variable as a model description has it."""
    own = {"name": name, "valueReference": reference, "causality": causality, **own}
    named = " ".join(f'{key}="{_escaped(value)}"' for key, value in own.items())
    start = "" if start is None else f'start="{_escaped(start)}"'
    return f"<ScalarVariable {named}><{kind} {start} {typed}/></ScalarVariable>"


def _escaped(text):
    return str(text).replace("&", "&amp;").replace("<", "&lt;").replace('"', "&quot;")


def _signal(name, reference, causality, kind, typed=""):
    start = None if causality == "output" else {"Boolean": "false", "String": ""}.get(kind, 1)
    return _variable(name, reference, causality, kind, start=start, typed=typed, variability="discrete")


REALS = [
    _variable("u", 0, "input", start=0.0),
    _variable("y", 1, "output"),
    _variable("gain", 2, "parameter", start=2.0, variability="tunable"),
    _variable("x", 3, "output", start=0.0, initial="exact"),
    _variable("calls", 4, "output"),
    _variable("at", 5, "parameter", start=5.0, variability="fixed"),
    _variable("longest", 6, "parameter", start=1e9, variability="fixed"),
    _variable("now", 7, "output"),
]
NUMBERS = [
    *REALS,
    _variable("mode", 0, "parameter", "Integer", start=0, variability="fixed"),
    _signal("m", 1, "input", "Integer"),
    _signal("n", 2, "output", "Integer"),
    _signal("gear", 3, "input", "Enumeration", 'declaredType="Gear"'),
    _signal("next", 4, "output", "Enumeration", 'declaredType="Gear"'),
    _signal("on", 0, "input", "Boolean"),
    _signal("off", 1, "output", "Boolean"),
]
ALL = [
    *NUMBERS,
    _variable("label", 0, "parameter", "String", start="", variability="fixed"),
    _signal("word", 1, "input", "String"),
    _signal("said", 2, "output", "String"),
]
VARIABLES = {"reals": REALS, "numbers": NUMBERS, "all": ALL}
"""The variables of foreign.c."""


@pytest.fixture(scope="session")
def libraries(compile_c):
    """The library of foreign.c: as it is, without what few need, and without what all need."""
    kinds = {"whole": (), "bare": ("-DBARE",), "lame": ("-DBARE", "-DLAME")}
    return {kind: compile_c("foreign.c", *options) for kind, options in kinds.items()}


@pytest.fixture(scope="session")
def v():
    """Write a variable as a model description has it."""
    return _variable


@pytest.fixture(scope="session")
def numbers():
    """The variables of foreign.c that are no texts."""
    return NUMBERS


@pytest.fixture
def fmu(libraries, xml, tmp_path):
    """Write an FMU of foreign.c."""

    def make(
        variables="numbers",
        *,
        name="f.fmu",
        binaries=None,
        simulation=VARIES,
        guid="{1}",
        structure=None,
        more="",
        **files,
    ):
        variables = VARIABLES[variables] if isinstance(variables, str) else variables
        outputs = [k for k, text in enumerate(variables, 1) if 'causality="output"' in text]
        unknowns = "".join(f'<Unknown index="{k}"/>' for k in outputs)
        if structure is None and outputs:
            structure = f"<Outputs>{unknowns}</Outputs><InitialUnknowns>{unknowns}</InitialUnknowns>"
        text = (
            f'<?xml version="1.0"?><fmiModelDescription fmiVersion="2.0" modelName="Foreign" guid="{guid}">'
            f'<CoSimulation modelIdentifier="Foreign" {simulation}/><TypeDefinitions>{GEAR}</TypeDefinitions>{more}'
            f"<ModelVariables>{''.join(variables)}</ModelVariables>"
            f"<ModelStructure>{structure or ''}</ModelStructure></fmiModelDescription>"
        )
        binaries = {LIBRARY: "whole"} if binaries is None else binaries
        content = {f"binaries/{fmpy.platform}/{key}": libraries.get(b, b) for key, b in binaries.items()}
        resources = {f"resources/{key}.txt": value for key, value in files.items()}
        return xml["write_archive"](tmp_path / name, {"modelDescription.xml": text, **content, **resources})

    return make


@dataclass
class Outcome:
    """A command's exit code and words; of a run, its record and results."""

    code: int
    out: str
    errors: list[str]
    record: dict
    results: Results | None

    @property
    def notes(self):
        return [line.removeprefix("note: ") for line in self.out.splitlines() if line.startswith("note: ")]


@pytest.fixture
def go(tmp_path, capsys):
    """Write a scenario and run it, or check it, in a directory of its own."""

    def run(fmus, start=None, connections=None, command="run", more="", *, options=(), **simulation):
        lines = ["[simulation]", *(f"{k} = {x}" for k, x in ({"stop_time": 10.0, "step": 0.5} | simulation).items())]
        for name, path in (fmus if isinstance(fmus, dict) else {"it": fmus}).items():
            lines += [f"[instances.{name}]", f"fmu = {json.dumps(str(path))}", f"[instances.{name}.start]"]
            lines += [f"{json.dumps(k)} = {json.dumps(x)}" for k, x in ((start or {}).get(name, {})).items()]
        lines += ["[connections]", *(f"{json.dumps(k)} = {json.dumps(x)}" for k, x in (connections or {}).items())]
        (tmp_path / "s.toml").write_text("\n".join([*lines, more]) + "\n", encoding="utf-8")
        output = tmp_path / "out"
        shutil.rmtree(output, ignore_errors=True)
        capsys.readouterr()
        more_options = ["-o", str(output), "--no-figures"] if command == "run" else []
        code = cli.call([command, str(tmp_path / "s.toml"), *more_options, *options])
        said = capsys.readouterr()
        errors = [line for line in said.err.splitlines() if "% of" not in line]
        record = json.loads((output / "run.json").read_text()) if output.exists() else {}
        return Outcome(
            code, said.out, errors, record, Results.load(output) if (output / "results.csv").exists() else None
        )

    return run


@pytest.fixture
def traced(tmp_path, monkeypatch):
    """The file in which calls are written down."""
    monkeypatch.setenv("FOREIGN_TRACE", str(tmp_path / "trace"))
    return tmp_path / "trace"


@pytest.fixture
def refused(workspace):
    """Why an archive is not unpacked; it names the file, and nothing of the archive stays."""

    def ask(path):
        with pytest.raises(FmuFileError) as caught:
            workspace.unpack(path)
        assert str(path) in str(caught.value)
        assert not list(workspace.folder.iterdir())
        return str(caught.value)

    return ask


@pytest.fixture(params=["compiled", "interpreted"])
def loop(request, monkeypatch):
    """Both step loops."""
    if request.param == "interpreted":
        monkeypatch.setattr(compiled, "kernel", None)
    elif compiled.kernel is None:
        pytest.skip("installed without a C compiler")
