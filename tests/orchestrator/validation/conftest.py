"""What the tests of `validate` share: the FMU of lag.c, with code of choice."""

import zipfile
from pathlib import Path

import fmpy
import pytest
from railcosim.orchestrator.fmi.archive import Workspace
from railcosim.orchestrator.fmi.models import load_fmu
from railcosim.orchestrator.validation.probing import PROBES, try_out

HEADERS = Path(fmpy.__file__).parent / "c-code"
PLACES = ("ON_INSTANTIATE", "ON_RESET", "ON_GET", "ON_STEP", "ON_RESTORE")
DESCRIPTION = """<?xml version="1.0" encoding="UTF-8"?>
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


@pytest.fixture(scope="session")
def lag_description():
    """The description of the FMU of `lag`."""
    return DESCRIPTION


@pytest.fixture
def lag(compile_c, tmp_path):
    """A small FMU in C, with code of choice put in at some places: dy/dt = k + u - y, Euler."""

    def make(description=DESCRIPTION, library="Lag", platform=fmpy.platform, **code):
        defined = [f"-D{place}={code.get(place.lower(), '')}" for place in PLACES]
        defined += [f"-D{name.upper()}={text}" for name, text in code.items() if name.upper() not in PLACES]
        binary = compile_c("lag.c", f"-I{HEADERS}", *defined)
        path = tmp_path / "lag.fmu"
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr("modelDescription.xml", description)
            archive.writestr(f"binaries/{platform}/{library}{fmpy.sharedLibraryExtension}", binary)
        return path

    return make


@pytest.fixture
def found(lag, lag_description):
    """What one probe finds of the FMU of `lag`."""

    def find(probe, claims="", depends=None, start="1", **code):
        text = lag_description.replace('<Real start="1"/>', f'<Real start="{start}"/>')
        text = text.replace("canGetAndSetFMUstate", f"{claims} canGetAndSetFMUstate")
        if depends is not None:
            text = text.replace('<Outputs><Unknown index="1"', f'<Outputs><Unknown index="1" dependencies="{depends}"')
        path = lag(text, **code)
        with Workspace() as workspace:
            model = load_fmu(path, workspace)
            findings = try_out(model.interface, model.folder, path, 60.0, (probe,))
        (finding,) = (each for each in findings if each.check == PROBES[probe])
        return finding.verdict, finding.detail

    return find
