"""FMPy's container FMU: the comfort scenario as one block, made with FMPy's own packager.

Its runtime (``container_fmu.so`` of FMPy 0.3.32) steps all models, then serves the connections one after the other in
the order of its file, reading each output when its turn comes. Three things follow, and are shown here. `orchestrate
pack` therefore uses the container of fmu-manipulation-toolbox (see test_fmu_manipulation_toolbox.py).
"""

import json
import shutil
import zipfile

import fmpy
import numpy as np
import pytest
from fmpy.container_fmu import Configuration
from fmpy.container_fmu.cli import create_container_fmu
from fmpy.container_fmu.config import Component, Connection
from fmpy.model_description import CoSimulation, ModelDescription, ModelVariable, Unknown

pytestmark = pytest.mark.long

FLOAT = {"Real": "Float64", "Integer": "Int32", "Boolean": "Boolean"}
FIRST = {"Real": float, "Integer": int}


def package(scene, folder, links, first_inputs):
    """The container as FMPy 0.3.32 writes it: Path of the file, names of the outputs."""
    kinds = {path: number for number, path in enumerate(dict.fromkeys(part.path for part in scene.parts.values()))}
    files = {  # FMUs of one model with other data are other files
        name: folder / f"{part.interface.model}_{kinds[part.path]}.fmu" for name, part in scene.parts.items()
    }
    for name, part in scene.parts.items():
        shutil.copy(part.path, files[name])
    described = {name: fmpy.read_model_description(file) for name, file in files.items()}
    components = {name: Component(name, files[name], described[name]) for name in scene.parts}
    inner = {(name, v.name): v for name, d in described.items() for v in d.modelVariables}
    # Value reference 0 is the time: it has to be the first variable, or every other one is read one place off.
    variables, mappings = [ModelVariable("time", 0, "Real", causality="independent", variability="continuous")], {}

    def add(name, causality, variability, target, start=None):
        variable = ModelVariable(name, 0, target.type, causality=causality, variability=variability, start=start)
        variables.append(variable)
        mappings[variable] = [(components[name.partition(".")[0]], target)]

    for name, part in scene.parts.items():
        for v in part.outputs:
            add(f"{name}.{v.name}", "output", v.variability, inner[name, v.name])
        for v, value in part.starts:
            text = str(bool(value)).lower() if v.type == "Boolean" else repr(value)
            add(f"{name}.{v.name}_start", "parameter", "fixed", inner[name, v.name], text)
    for link in links if first_inputs else ():
        name = f"{link.target.name}.{link.input.name}"
        add(
            f"{name}_start",
            "parameter",
            "fixed",
            inner[link.target.name, link.input.name],
            repr(FIRST[link.input.type](link.first)),
        )
    description = ModelDescription(
        fmiVersion="2.0",
        modelName="platoon",
        instantiationToken="{platoon}",
        variableNamingConvention="structured",
        coSimulation=CoSimulation(modelIdentifier="platoon", fixedInternalStepSize=scene.step),
        modelVariables=variables,
        outputs=[Unknown(variable=v) for v in variables if v.causality == "output"],
        initialUnknowns=[Unknown(variable=v) for v in variables if v.causality == "output"],
    )
    connections = [
        Connection(
            components[link.source.name],
            [inner[link.source.name, link.output.name]],
            components[link.target.name],
            [inner[link.target.name, link.input.name]],
        )
        for link in links
    ]
    configuration = Configuration(False, description, list(components.values()), connections, mappings)
    (folder / "unzipped").mkdir()
    create_container_fmu(configuration, folder / "unzipped", folder / "platoon.fmu")
    return folder / "platoon.fmu"


def mended(path):
    """The same container with the type names that FMPy's runtime knows."""
    result = path.with_name("mended.fmu")
    with zipfile.ZipFile(path) as old, zipfile.ZipFile(result, "w") as new:
        for entry in old.namelist():
            content = old.read(entry)
            if entry == "resources/container.json":
                data = json.loads(content)
                for connection in data["connections"]:
                    connection["variableType"] = FLOAT.get(connection["variableType"], connection["variableType"])
                content = json.dumps(data).encode()
            new.writestr(entry, content)
    return result


def simulate(scene, path):
    result = fmpy.simulate_fmu(str(path), stop_time=scene.stop_time, step_size=scene.step, output_interval=scene.step)
    return {name: result[name] for name in result.dtype.names if name in scene.ours["jacobi"]}


def plants_last(scene):
    """Outputs that depend on nothing new are read last: by the time of each, its model's inputs are still the old."""
    rank = {name: k for k, name in enumerate(scene.order)}
    return sorted(scene.links, key=lambda link: -rank[link.target.name])


def states(found):
    names = (".position", ".speed", "target.value", "gust.acceleration")
    return {name: values for name, values in found.items() if name.endswith(names)}


def test_known_defect_its_packager_writes_a_type_its_runtime_rejects(scene, tmp_path, capfd):
    """FMPy 0.3.32 writes "Real" for FMI 2 connections. Remedy: "Float64" in ``resources/container.json``."""
    path = package(scene, tmp_path, scene.links, first_inputs=False)
    with pytest.raises(Exception, match="Failed to instantiate"):
        simulate(scene, path)
    assert "unknown variant `Real`" in capfd.readouterr().out
    assert len(simulate(scene, mended(path))["train[1].speed"]) == scene.points


def test_forces_handed_on_first_give_our_jacobi(scene, tmp_path):
    """Connections in reverse order of stepping, and the inputs' first values as start values."""
    found = simulate(scene, mended(package(scene, tmp_path, plants_last(scene), first_inputs=True)))
    assert set(found) == scene.outputs()
    assert scene.deviation("jacobi", states(found)) <= 1e-9


def test_forces_handed_on_last_give_our_gauss_seidel(scene, tmp_path):
    """Our FMUs give fresh outputs after a set, so a controller's force reaches its train in the same exchange."""
    found = simulate(scene, mended(package(scene, tmp_path, plants_last(scene)[::-1], first_inputs=False)))
    assert scene.deviation("gauss-seidel", states(found)) <= 1e-9


def test_known_defect_initialization_serves_each_connection_once(scene, tmp_path):
    """Inputs whose source settles later keep their start values. Remedy: first values as start values (above)."""
    found = simulate(scene, mended(package(scene, tmp_path, plants_last(scene), first_inputs=False)))
    ours = scene.ours["jacobi"]["train[2].applied_force"][0]
    assert abs(found["train[2].applied_force"][0] - ours) > 1e5
    assert np.max(np.abs(found["train[4].position"] - scene.ours["jacobi"]["train[4].position"])) > 1.0
