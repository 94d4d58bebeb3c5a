"""FMPy: one FMU by `simulate_fmu`, its inputs given as signals; native and Python FMUs; a host without Python."""

import shutil
import subprocess
import sys
import zipfile

import fmpy
import numpy as np
import pytest
from railcosim.fmus.build import build

LINUX = sys.platform.startswith("linux")


def signals(**columns):
    """Input signals as FMPy takes them: a structured array with `time` first."""
    return np.rec.fromarrays([np.asarray(c, dtype=float) for c in columns.values()], names=list(columns))


def test_the_validator_finds_nothing(scene):
    from fmpy.validation import validate_fmu

    for path in {part.path for part in scene.parts.values()}:
        assert validate_fmu(str(path)) == []


def test_one_train_under_our_force_runs_our_trajectory(scene):
    """The force that each step of our `jacobi` held, given to the train as a signal of steps."""
    ours = scene.ours["jacobi"]
    force = ours["train[2].applied_force"]
    part = scene.parts["train[2]"]
    # Steps are exact only where FMPy finds both edges at one time: each value holds until the next point.
    held = np.append(force[1:], force[-1])
    time = scene.step * np.arange(scene.points)
    result = fmpy.simulate_fmu(
        str(part.path),
        stop_time=scene.stop_time,
        step_size=scene.step,
        output_interval=scene.step,
        start_values={variable.name: value for variable, value in part.starts},
        input=signals(time=np.repeat(time, 2)[1:], force=np.repeat(held, 2)[:-1]),
        output=["position", "speed"],
    )
    found = {f"train[2].{name}": result[name] for name in ("position", "speed")}
    assert scene.deviation("jacobi", found) <= 1e-9


def test_a_python_fmu_runs_in_fmpy_and_agrees_with_the_native_one(native):
    paths = [build("PointMassTrain", kind=kind) for kind in ("python", "native")]
    starts = {"speed_start": 60.0, "position_start": 5.0}
    runs = [
        fmpy.simulate_fmu(str(p), stop_time=5.0, step_size=0.1, output_interval=0.1, start_values=starts) for p in paths
    ]
    for name in ("position", "speed", "acceleration"):
        np.testing.assert_allclose(runs[0][name], runs[1][name], rtol=1e-12)


HOST = """
#include <dlfcn.h>
#include <stdio.h>
int main(int argc, char **argv)
{
    void *library = dlopen(argv[argc - 1], RTLD_NOW | RTLD_LOCAL);
    if (library == NULL) {
        fputs(dlerror(), stdout);
        return 1;
    }
    puts(((const char *(*)(void))dlsym(library, "fmi2GetVersion"))());
    return 0;
}
"""


@pytest.fixture(scope="module")
def host(tmp_path_factory):
    """A program that loads an FMU's library and carries no Python."""
    folder = tmp_path_factory.mktemp("host")
    (folder / "host.c").write_text(HOST)
    compiler = [shutil.which("cc")] if shutil.which("cc") else [sys.executable, "-m", "ziglang", "cc"]
    subprocess.run([*compiler, "-o", folder / "host", folder / "host.c", "-ldl"], check=True, capture_output=True)

    def load(path):
        with zipfile.ZipFile(path) as archive:
            library = next(n for n in archive.namelist() if n.startswith("binaries/linux64/") and n.endswith(".so"))
            place = archive.extract(library, folder / path.parent.name)
        return subprocess.run([folder / "host", place], check=False, capture_output=True, text=True, timeout=60)

    return load


@pytest.mark.skipif(not LINUX, reason="the limit is that of pythonfmu's Linux library")
def test_known_limit_a_host_without_python_cannot_load_a_python_fmu(host, native):
    """pythonfmu 0.7's Linux library does not link libpython. Remedy: the native FMU."""
    refused = host(build("PointMassTrain", kind="python"))
    assert refused.returncode == 1
    assert "undefined symbol: _Py" in refused.stdout
    assert host(build("PointMassTrain", kind="native")).stdout == "2.0\n"
