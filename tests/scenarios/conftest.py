"""Gives the reference solutions, loaded by their path, and the deviations from one that several tables share."""

import functools
import importlib.util
import runpy
import sys
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def reference():
    name = "railcosim_comfort_reference"
    if name not in sys.modules:
        spec = importlib.util.spec_from_file_location(name, Path(__file__).parent / "reference.py")
        module = importlib.util.module_from_spec(spec)
        sys.modules[name] = module
        spec.loader.exec_module(module)
    return sys.modules[name]


@pytest.fixture(scope="session")
def deviation(reference):
    """`comfort_system.deviation` from the reference; what a run of the same arguments gave is given again."""
    path = Path(__file__).parent / "comfort_system.py"
    return functools.cache(functools.partial(runpy.run_path(str(path))["deviation"], reference))


@pytest.fixture(scope="session")
def platoon():
    """The reference solution of the three laws of the tunable potential's specification."""
    name = "railcosim_platoon_reference"
    if name not in sys.modules:
        spec = importlib.util.spec_from_file_location(name, Path(__file__).parent / "platoon_reference.py")
        module = importlib.util.module_from_spec(spec)
        sys.modules[name] = module
        spec.loader.exec_module(module)
    return sys.modules[name]
