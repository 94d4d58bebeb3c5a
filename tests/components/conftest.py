"""Gives the sample components, a file in the style of a user's own, loaded by its path; and simulations under way."""

import importlib.util
import sys
from pathlib import Path

import pytest
from railcosim.components import ComponentError, Simulation


@pytest.fixture(scope="session")
def samples():
    name = "railcosim_sample_components"
    if name not in sys.modules:
        spec = importlib.util.spec_from_file_location(name, Path(__file__).parent / "samples.py")
        module = importlib.util.module_from_spec(spec)
        sys.modules[name] = module
        spec.loader.exec_module(module)
    return sys.modules[name]


@pytest.fixture(scope="session")
def running():
    """Start the simulation of a component with values that are set during initialization."""

    def start(component, **inputs):
        simulation = Simulation(component)
        simulation.initialize()
        for name, value in inputs.items():
            simulation.set(name, value)
        simulation.start()
        return simulation

    return start


@pytest.fixture(scope="session")
def refusal():
    """Make a call that a component must refuse; what it says."""

    def say(call):
        with pytest.raises(ComponentError) as caught:
            call()
        return str(caught.value)

    return say
