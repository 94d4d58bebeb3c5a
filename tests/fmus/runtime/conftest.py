"""What the tests of the C runtime share: scripts in a process of their own, integrators, and how near is near."""

import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent
SAMPLES = HERE / "samples.py"
BARE = Path(__file__).parents[1] / "bare.py"
MODULES = """
import importlib.util, sys
from pathlib import Path

def module(name, path):
    spec = importlib.util.spec_from_file_location(name, path)
    sys.modules[name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(sys.modules[name])
    return sys.modules[name]

bare, tests = module("bare", sys.argv[1]), module("tests", sys.argv[2])
"""


@pytest.fixture(scope="session")
def in_another_process():
    """Run a script that knows `bare.py` as ``bare`` and a test file as ``tests``; gives what it prints."""

    def run(script, file, *arguments):
        command = [sys.executable, "-c", MODULES + script, BARE, file, *arguments]
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout

    return run


@pytest.fixture
def integrators(load):
    """Makes instances of integrators of their inputs."""
    return lambda: load(f"{SAMPLES}:Integrators")


@pytest.fixture(scope="session")
def near():
    """A value up to a few roundings of the sub-steps."""
    return lambda value: pytest.approx(value, rel=1e-14)


@pytest.fixture
def exchanged(load):
    """Instances for model exchange; those for co-simulation of the same FMU are made by ``kind=1``."""

    def make(reference, kind=0):
        place = next(
            (f for f in ("exchange_samples", "samples") if f"class {reference}(" in (HERE / f"{f}.py").read_text()),
            None,
        )
        return load(f"{HERE / place}.py:{reference}" if place else reference, profile="model-exchange", kind=kind)

    return make
