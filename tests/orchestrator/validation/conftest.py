"""What the tests of `validate` share: what one probe finds."""

import pytest
from railcosim.orchestrator.fmi.archive import Workspace
from railcosim.orchestrator.fmi.models import load_fmu
from railcosim.orchestrator.validation.probing import PROBES, try_out


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
