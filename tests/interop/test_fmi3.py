"""FMUs of FMI 3.0 that other tools make, in our master: a train boxed by two packagers runs as the train alone does."""

import importlib.util
import logging
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.container_fmu import Configuration
from fmpy.container_fmu.cli import create_container_fmu
from fmpy.container_fmu.config import Component
from fmpy.model_description import CoSimulation, ModelDescription, ModelVariable, Unknown
from railcosim.fmus.build import build, native_problem
from railcosim.fmus.references import resolve
from railcosim.orchestrator import System, run
from railcosim.orchestrator.validation import validate
from railcosim.orchestrator.validation.probing import PROBES

PROBLEM = native_problem(resolve("PointMassTrain"))
pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(bool(PROBLEM), reason=PROBLEM or "never"),
]
OUTPUTS = ("position", "speed", "acceleration")


def by_toolbox(train: Path, folder: Path) -> Path:
    """The container of fmu-manipulation-toolbox: its runtime is C."""
    if importlib.util.find_spec("fmu_manipulation_toolbox") is None:
        pytest.skip("fmu-manipulation-toolbox is not installed")
    from fmu_manipulation_toolbox.container import FMUContainer

    logging.getLogger("fmu_manipulation_toolbox").setLevel(logging.CRITICAL)
    container = FMUContainer("boxed", folder, fmi_version=3)
    container.get_fmu(str(train), "train")
    container.add_input("force", "train", "force")
    for name in OUTPUTS:
        container.add_output("train", name, name)
    container.make_fmu("boxed.fmu", step_size=0.1)
    return folder / "boxed.fmu"


def by_fmpy(train: Path, folder: Path) -> Path:
    """FMPy's container: its runtime is Rust."""
    described = fmpy.read_model_description(str(train))
    inner = {v.name: v for v in described.modelVariables}
    component = Component("train", train, described)
    time = ModelVariable("time", 0, "Float64", causality="independent", variability="continuous")
    shown = [ModelVariable("force", 0, "Float64", causality="input", variability="continuous", start="0")]
    shown += [ModelVariable(name, 0, "Float64", causality="output", variability="continuous") for name in OUTPUTS]
    description = ModelDescription(
        fmiVersion="3.0",
        modelName="boxed",
        instantiationToken="{boxed}",
        coSimulation=CoSimulation(modelIdentifier="boxed", fixedInternalStepSize=0.1),
        modelVariables=[time, *shown],
        outputs=[Unknown(variable=v) for v in shown[1:]],
        initialUnknowns=[Unknown(variable=v) for v in shown[1:]],
    )
    mappings = {v: [(component, inner[v.name])] for v in shown}
    (folder / "unzipped").mkdir()
    create_container_fmu(
        Configuration(False, description, [component], [], mappings), folder / "unzipped", folder / "boxed.fmu"
    )
    return folder / "boxed.fmu"


@pytest.mark.parametrize("make", [by_toolbox, by_fmpy])
def test_a_boxed_train(tmp_path, make):
    train = build("PointMassTrain", kind="native")
    boxed = make(train, tmp_path)
    system = System(step=0.1, stop_time=60.0)
    for name, model in {"alone": train, "boxed": boxed}.items():
        system.add(name, str(model), force=2e5)
    result = run(system)
    assert result["alone.speed"][-1] > 1.0
    for name in OUTPUTS:
        assert np.array_equal(result[f"alone.{name}"], result[f"boxed.{name}"]), name
    verdicts = {finding.check: finding for finding in validate(boxed).findings}
    for probe in ("instantiate", "simulate", "starts", "instances"):
        assert verdicts[PROBES[probe]].verdict == "pass", verdicts[PROBES[probe]]
