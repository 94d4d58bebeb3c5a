"""Ten learning trips in another tool: the memory along the trip lives inside the FMU and needs nothing of the master.

The three units of the specification's section 9 (timetable, CAILC, train) with a trip monitor, every 50 ms, stepped in
parallel: the controller is told of one sample of delay, and the timetable looks one sample ahead.
"""

import importlib.util
from pathlib import Path

import pytest
from railcosim.orchestrator.system import System

pytestmark = pytest.mark.long

HERE = Path(__file__).parent


def module(path):
    spec = importlib.util.spec_from_file_location(path.stem + "_of_trips", path)
    loaded = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(loaded)
    return loaded


def test_ten_trips_in_the_toolbox_s_container_are_ours(native, need, make_scene, tmp_path):
    need("fmu_manipulation_toolbox")
    trips = module(HERE.parent / "scenarios" / "metro_system.py").Trips(10, step=0.05, algorithm="jacobi")
    assert isinstance(trips.result.system, System)
    scene = make_scene(trips.result.system, ("jacobi",))
    toolbox = module(HERE / "test_fmu_manipulation_toolbox.py")
    found = toolbox.simulate(scene, toolbox.package(scene, tmp_path, sequential=False))
    assert set(found) == scene.outputs()
    assert scene.deviation("jacobi", found) <= 1e-9
    # It learned there too: the independent simulation's values of the first two trips, as in test_cailc_sampling.
    assert [trips.largest("augmented_error", k) for k in (1, 2)] == pytest.approx([0.012491809, 0.007363353], abs=6e-10)
    assert max(found["monitor.finished_augmented_error"][-3:]) < 0.1
