"""What the tests of isolation share: instances in processes of their own, and their lives."""

import time
from pathlib import Path

import pytest
from railcosim.orchestrator.errors import FmuError
from railcosim.orchestrator.fmi.models import load_fmu
from railcosim.orchestrator.isolation.choice import house


@pytest.fixture
def apart(hostile, workspace):
    """An instance of hostile.c in a process of its own, not yet initialized; given back at the end."""
    made = []

    def make(deed="", name="it", *, path=None, begun=False, **how):
        model = load_fmu(Path(path or hostile()), workspace)
        made.extend(house([(name, model.interface, model.folder)], **how))
        if deed:
            made[-1].channel("String", ["deed"]).set([deed])
        return _begin(made[-1]) if begun else made[-1]

    yield make
    for one in made:
        one.free()


def _begin(slave):
    slave.setup(0.0, 10.0)
    slave.enter_initialization()
    slave.exit_initialization()
    return slave


def _live(slave, steps=4, pause=0.0):
    """A whole life of half a second per step; the error that ends it, if one does."""
    u, y = slave.channel("Real", ["u"]), slave.channel("Real", ["y"])
    try:
        _begin(slave)
        for k in range(steps):
            time.sleep(pause)
            u.set([1.0])
            slave.step(0.5 * k, 0.5)
            y.get()
            slave.forget(slave.save())
        slave.terminate()
    except FmuError as error:
        return error
    return None


@pytest.fixture(scope="session")
def begin():
    """Lead an instance through its initialization."""
    return _begin


@pytest.fixture(scope="session")
def live():
    """Lead an instance through a whole life of half a second per step; the error that ends it, if one does."""
    return _live
