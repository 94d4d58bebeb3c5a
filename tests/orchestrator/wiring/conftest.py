"""What the tests of the wiring share: components with an output, an input and a parameter of every type; systems."""

import pytest
from railcosim.orchestrator.fmi.models import load_models
from railcosim.orchestrator.system import System
from railcosim.orchestrator.wiring.resolution import wire

BODY = """
class Source(Base):
    '''One output of every type, and some units.'''

    metres = State("m", 1.0, output=True)
    kilometres = Memory("km", 2.0, output=True)
    kmh = Memory("km/h", 36.0, output=True)
    celsius = Memory("degC", 20.0, output=True)
    seconds = Memory("s", 3.0, output=True)
    plain = Memory("1", 4.0, output=True)
    whole = Memory("1", 5, type=int, output=True)
    truth = Memory("1", True, output=True)
    word = Memory("1", "six", output=True)
    row = Memory("m", shape=(3,), output=True)

    def derivatives(self):
        return {"metres": 0.0}

    def update(self):
        return {n: getattr(self, n) for n in "kilometres kmh celsius seconds plain whole truth word row".split()}


class Sink(Base):
    '''One input of every type.'''

    metres = Input("m", optional=True)
    speed = Input("m/s", optional=True)
    kelvin = Input("K", optional=True)
    plain = Input("1", optional=True)
    whole = Input("1", 0, type=int, optional=True)
    truth = Input("1", False, optional=True)
    word = Input("1", "", optional=True)
    row = Input("m", shape=(3,), optional=True)
    pair = Input("m", shape=(2,), optional=True)
    y = Output("m")

    def outputs(self):
        return {"y": self.metres}


class Settings(Base):
    '''Parameters of every type, with bounds.'''

    gain = Parameter("1/s", 1.0, minimum=0.0, maximum=2.0)
    gears = Parameter("1", 2, type=int, minimum=1, maximum=9)
    on = Parameter("1", False)
    label = Parameter("1", "name")
    row = Parameter("m", shape=(3,))
    one = Parameter("m", shape=(1,))
    x = State("m", 0.0, output=True)
    y = Output("m")

    def derivatives(self):
        return {"x": self.gain}

    def outputs(self):
        return {"y": self.x}


class Needy(Base):
    '''Needs one input and would like another.'''

    recommended_step = 0.1
    sample_time = Parameter("s", 0.2)
    needed = Input("m")
    needed_row = Input("m", shape=(2,))
    wanted = Input("m", optional=True)
    y = Memory("m", 0.0, output=True)

    def update(self):
        return {"y": self.needed}


class Random(Base):
    '''Random.'''

    hold = Parameter("s", 0.1)
    draw = Noise(hold)
    y = Output("1")

    def outputs(self):
        return {"y": self.draw}
"""


@pytest.fixture
def mine(components):
    return components(BODY)


@pytest.fixture
def resolve(workspace):
    """Wire a system of components in this process."""

    def run(system):
        models = load_models(system, workspace, "plain")
        return wire(system, {name: model.interface for name, model in models.items()})

    return run


@pytest.fixture
def pair(mine):
    def make():
        system = System()
        system.add("a", mine("Source"))
        system.add("b", mine("Sink"))
        return system

    return make


@pytest.fixture
def connected(pair, resolve):
    """Wire one connection between a source and a sink."""

    def run(source, target, **how):
        system = pair()
        system.connect(source, target, **how)
        return resolve(system)

    return run
