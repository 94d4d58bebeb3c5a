"""Our FMI 3.0 exports: to the bit what FMI 2.0 gives, in our master, over the reference signals, and behind FMPy."""

import csv
import itertools
import shutil
import zipfile
from dataclasses import replace
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.build import build_platform_binary
from fmpy.validation import validate_fmu
from railcosim.components import CATALOGUE
from railcosim.fmus.build import build, native_problem
from railcosim.fmus.references import resolve
from railcosim.orchestrator import load, run
from railcosim.orchestrator.fmi import Workspace, load_fmu

PROBLEM = native_problem(resolve("PointMassTrain"))
pytestmark = pytest.mark.skipif(bool(PROBLEM), reason=PROBLEM or "never")


def rows_of(path):
    """The reference inputs of an FMU: time and values by name; where there are none, times alone."""
    with zipfile.ZipFile(path) as archive:
        names = [f"documentation/{path.stem}_{what}.csv" for what in ("in", "ref")]
        (name, *_) = [name for name in names if name in archive.namelist()]
        rows = list(csv.DictReader(archive.read(name).decode().splitlines()))
    return [(float(row.pop("time")), row if name.endswith("_in.csv") else {}) for row in rows]


def replayed(path, workspace):
    """All outputs after each step over the reference inputs, bit by bit."""
    model = load_fmu(path, workspace)
    slave = model.instantiate("it")
    kinds = {"Real": float, "Integer": int, "Boolean": lambda text: bool(int(text))}
    try:
        (begin, _), *_, (end, _) = rows = rows_of(path)
        slave.setup(begin, end)
        slave.enter_initialization()
        slave.exit_initialization()
        found = []
        for (time, inputs), (later, _) in itertools.pairwise(rows):
            for name, text in inputs.items():
                kind = model.interface.variables[name].type
                slave.channel(kind, [name]).set([kinds[kind](text)])
            slave.step(time, later - time)
            shown = [v for v in model.interface.of("output") if v.type in kinds]
            found.append([slave.channel(v.type, [v.name]).get()[0] for v in shown])
        return np.array(found, float).tobytes(), [v.name for v in shown]
    finally:
        slave.free()


def check(name):
    paths = {fmi: build(name, kind="native", fmi=fmi) for fmi in ("2", "3")}
    assert validate_fmu(str(paths["3"])) == []
    with Workspace() as workspace:
        assert replayed(paths["3"], workspace) == replayed(paths["2"], workspace)
    description = fmpy.read_model_description(str(paths["3"]))
    result = fmpy.simulate_fmu(str(paths["3"]), stop_time=3 * float(description.defaultExperiment.stepSize))
    assert all(np.isfinite(result[name]).all() for name in result.dtype.names if result[name].dtype.kind == "f")


@pytest.mark.long
@pytest.mark.parametrize("name", ["PointMassTrain", "Sensor", "Cailc"])  # continuous; with noise; with a tape
def test_a_component_gives_the_bits_of_fmi_2(name):
    check(name)


@pytest.mark.parametrize("name", [pytest.param(n, marks=pytest.mark.campaign) for n in CATALOGUE])
def test_every_component_gives_the_bits_of_fmi_2(name):
    check(name)


@pytest.mark.long
@pytest.mark.skipif(shutil.which("cmake") is None, reason="needs cmake")
def test_fmpy_builds_the_sources_as_they_are_described(tmp_path):
    path = build("PointMassTrain", kind="native", fmi="3")
    folder = Path(fmpy.extract(str(path), str(tmp_path / "sources")))
    shutil.rmtree(folder / "binaries")
    (tmp_path / "build").mkdir()
    build_platform_binary(folder, tmp_path / "build")
    starts = {"speed_start": 60.0, "force": 250e3}
    one, other = (fmpy.simulate_fmu(str(fmu), stop_time=10.0, start_values=starts) for fmu in (path, folder))
    assert np.abs(one["speed"] - other["speed"]).max() < 1e-12  # cmake's flags let the compiler contract


def swapped(system):
    """Every instance replaced by the FMI 3.0 export of its component."""
    instances = {
        name: replace(each, model=str(build(each.model, each.build, kind="native", fmi="3")), build={})
        for name, each in system.instances.items()
    }
    return replace(system, instances=instances)


@pytest.mark.long
def test_a_scenario_of_fmi_3_gives_the_bits_of_fmi_2():
    system = load("comfort_cruise", stop_time=60.0)
    first, second = run(system, kind="native", figures=False), run(swapped(system), figures=False)
    expected, found = first.results, second.results
    assert {model.interface.version for model in second.checked.models.values()} == {"3.0"}
    for name in expected:
        assert found[name].tobytes() == expected[name].tobytes(), name
