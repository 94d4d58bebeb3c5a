"""OMSimulator 3, where it is installed: its PyPI package fetches a binary while it is built, so CI has none.

Not run on the machine where this was written. OMSimulator orders by dependencies and gives inputs the outputs of the
same point, and reads outputs after a set: our FMUs give fresh ones, so its fixed-step master `ma` closes the loop as
our `gauss-seidel` does.
"""

import numpy as np
import pytest

pytestmark = pytest.mark.long

WEAKLY_COUPLED = 1
"""The number of this kind of system in OMSimulator's interface of C."""


def name_of(part):
    return "model.root." + part.name.replace("[", "_").replace("]", "")  # it takes no brackets


def simulate(scene, folder):
    """Positions and speeds of all trains, by OMSimulator's interface of C: that of Python writes SSP archives."""
    from OMSimulator.capi import Capi

    engine = Capi
    engine.setTempDirectory(str(folder))
    assert engine.newModel("model") == 0
    assert engine.addSystem("model.root", WEAKLY_COUPLED) == 0
    for part in scene.parts.values():
        assert engine.addSubModel(name_of(part), str(part.path)) == 0
        for variable, value in part.starts:
            set_value = {"Real": engine.setReal, "Integer": engine.setInteger, "Boolean": engine.setBoolean}
            typed = {"Real": float, "Integer": int, "Boolean": bool}[variable.type](value)
            assert set_value[variable.type](f"{name_of(part)}.{variable.name}", typed) == 0
    for link in scene.links:
        source, target = f"{name_of(link.source)}.{link.output.name}", f"{name_of(link.target)}.{link.input.name}"
        assert engine.addConnection(source, target) == 0
    engine.setStartTime("model", 0.0)
    engine.setStopTime("model", scene.stop_time)
    engine.setFixedStepSize("model.root", scene.step)
    engine.setResultFile("model", "", 1)
    assert engine.instantiate("model") == 0
    assert engine.initialize("model") == 0
    found = {f"{name}.{s}": [] for name in scene.parts if name.startswith("train") for s in ("position", "speed")}
    for k in range(scene.points):
        if k:
            assert engine.stepUntil("model", k * scene.step) == 0
        for signal, values in found.items():
            part, variable = signal.rsplit(".", 1)
            value, status = engine.getReal(f"{name_of(scene.parts[part])}.{variable}")
            assert status == 0
            values.append(value)
    engine.terminate("model")
    engine.delete("model")
    return {name: np.array(values) for name, values in found.items()}


def test_the_scenario_is_our_gauss_seidel(scene, need, tmp_path):
    need("OMSimulator")
    assert scene.deviation("gauss-seidel", simulate(scene, tmp_path)) <= 1e-9
