"""What the tests of packaging share: every component there is, FMUs of them in a cache of our own, a raw FMI driver."""

import ast
import ctypes
import functools
import importlib.util
import os
import zipfile
from pathlib import Path

import fmpy
import pytest
from fmpy.fmi2 import FMU2Slave, defaultCallbacks, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE
from fmpy.logging import addLoggerProxy
from lxml import etree
from railcosim.components import CATALOGUE
from railcosim.components.component import Component
from railcosim.fmus.build import build, build_component
from railcosim.fmus.references import resolve

SAMPLES = Path(__file__).parents[1] / "components" / "samples.py"


@functools.cache
def references():
    """Every catalogue component and every sample, as the command line would name them."""
    classes = [node for node in ast.parse(SAMPLES.read_text()).body if isinstance(node, ast.ClassDef)]
    return [*CATALOGUE, *(f"{SAMPLES}:{node.name}" for node in classes)]


def pytest_generate_tests(metafunc):
    if "reference" in metafunc.fixturenames:
        found = references()
        metafunc.parametrize("reference", found, ids=[name.rpartition(":")[2] for name in found])


@pytest.fixture(scope="session", autouse=True)
def cache(session_cache):
    """The session's cache: no test may be served by what an earlier version left in the user's."""
    session_cache.mkdir(parents=True, exist_ok=True)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RAILCOSIM_CACHE", str(session_cache))
        yield


@pytest.fixture(scope="session")
def sample():
    """Reference of a sample component by its class name."""
    return lambda name: f"{SAMPLES}:{name}"


@pytest.fixture
def write_component(tmp_path):
    """Write a user's component file (and others beside it); gives the reference of its class C."""

    def write(body, name="my_controller.py", folder="user", **others):
        place = tmp_path / folder
        place.mkdir(parents=True, exist_ok=True)
        (place / name).write_text(body, encoding="utf-8")
        for module, text in others.items():
            (place / f"{module}.py").write_text(text, encoding="utf-8")
        return f"{place / name}:C"

    return write


@pytest.fixture(scope="session")
def built():
    """FMUs of components whose files stay as they are, built once: what most tests only want to look at."""
    paths = {}

    def once(reference, arguments=None):
        key = f"{reference} {arguments}"
        if reference not in references():
            return build(reference, arguments)
        if key not in paths:
            paths[key] = build(reference, arguments)
        return paths[key]

    return once


@pytest.fixture(scope="session")
def model(built):
    """Parsed modelDescription.xml of a component's FMU."""

    def parse(reference, arguments=None):
        with zipfile.ZipFile(built(reference, arguments)) as archive:
            return etree.fromstring(archive.read("modelDescription.xml"))

    return parse


@functools.cache
def describe(folder):
    return fmpy.read_model_description(folder, validate=False)


class Instance:
    """One FMU instance driven by bare FMI calls; values go by scalar name, with the setter of the variable's type.

    After a refused call the importer may only free the instance, and so does this driver: any other call is an error
    of the test.
    """

    def __init__(self, folder, name):
        self.description = describe(str(folder))
        self.variables = {v.name: v for v in self.description.modelVariables}
        self.log = []
        self.dead = False
        self.time = 0.0

        def logger(_, instance, status, category, message):
            self.log.append(message.decode())

        self._callbacks = fmi2CallbackFunctions()
        self._callbacks.logger = fmi2CallbackLoggerTYPE(logger)
        self._callbacks.allocateMemory = defaultCallbacks.allocateMemory
        self._callbacks.freeMemory = defaultCallbacks.freeMemory
        addLoggerProxy(ctypes.byref(self._callbacks))
        here = os.getcwd()
        self._fmu = FMU2Slave(
            guid=self.description.guid,
            unzipDirectory=str(folder),
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            instanceName=name,
        )
        self._fmu.instantiate(callbacks=self._callbacks, loggingOn=True)  # pythonfmu tells errors only then
        os.chdir(here)

    def call(self, name, *arguments):
        assert not self.dead, "after a refused call only freeInstance may follow"
        try:
            return getattr(self._fmu, name)(*arguments)
        except Exception:
            self.dead = True
            raise

    def initialize(self, **starts):
        self.enter(**starts)
        return self.start()

    def enter(self, **starts):
        self.call("setupExperiment")
        for name, value in starts.items():  # of a state the start value, which is a parameter
            array, bracket, index = name.partition("[")
            start = f"{array}_start{bracket}{index}"
            self.set({start if start in self.variables else name: value})
        self.call("enterInitializationMode")
        return self

    def start(self):
        self.call("exitInitializationMode")
        return self

    def set(self, values):
        for name, value in values.items():
            self.set_as(self.variables[name].type, name, value)

    def set_as(self, kind, name, value):
        self.call(f"set{kind}", [self.variables[name].valueReference], [value])

    def get(self, name):
        variable = self.variables[name]
        value = self.call(f"get{variable.type}", [variable.valueReference])[0]
        return {"String": bytes.decode, "Boolean": bool}.get(variable.type, lambda v: v)(value)

    def outputs(self):
        return {name: self.get(name) for name, v in self.variables.items() if v.causality == "output"}

    def everything(self):
        return {name: self.get(name) for name in self.variables}

    def step(self, length, count=1):
        rows = []
        for _ in range(count):
            self.call("doStep", self.time, length)
            self.time += length
            rows.append(self.outputs())
        return rows

    def refused(self, name, *arguments):
        """Make a call that must be refused; what the log says."""
        with pytest.raises(Exception, match="fmi2") as caught:
            getattr(self, name)(*arguments)
        assert caught.value.status >= 3
        return self.log[-1]

    def free(self):
        self._fmu.freeInstance()


@pytest.fixture(scope="session")
def unpack(tmp_path_factory):
    """Unpack an FMU file once; gives the folder."""
    folders = {}

    def unpack_once(path):
        if path not in folders:
            folders[path] = tmp_path_factory.mktemp("fmu")
            with zipfile.ZipFile(path) as archive:
                archive.extractall(folders[path])
        return folders[path]

    return unpack_once


@pytest.fixture
def instantiate(unpack, built):
    """Instances of a component's FMU (or of an FMU file), freed at the end of the test."""
    instances = []

    def make(reference, arguments=None, name="it"):
        path = reference if isinstance(reference, Path) else built(reference, arguments)
        instances.append(Instance(unpack(path), name))
        return instances[-1]

    yield make
    for instance in instances:
        instance.free()


@pytest.fixture(scope="session")
def driver():
    """The module `bare.py`."""
    spec = importlib.util.spec_from_file_location("bare", Path(__file__).with_name("bare.py"))
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def load(unpack, driver):
    """Instances of a component's native FMU behind the bare functions of the standard; freed at the end of the test."""
    made = []

    def make(reference, arguments=None, profile="standard", **options):
        if isinstance(reference, Component):
            path = build_component(reference, "native", profile=profile)
        else:
            path = build(reference, arguments, kind="native", profile=profile)
        made.append(driver.Fmu(unpack(path), **options))
        return made[-1]

    yield make
    for fmu in made:
        if fmu.instance is not None:
            fmu.free()


@pytest.fixture(scope="session")
def component_class():
    return resolve


HERE = Path(__file__).parent
LARGE = ("CoupledSubwayTrain", "FaultTolerantCruise")
"""Models of which everything takes seconds."""
FEW = {"PointMassTrain", "ComfortCruise", "RadioLink", "Chain", "Dice", "Estimator", "Everything", "Learner", "Slope"}
"""Models that have between them what a component can have."""


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """What every model is put through, the large ones are in the long tier; where that is much, all but a few are.

    What is a campaign stays one.
    """
    for item in items:
        model = item.name.partition("[")[2].partition("]")[0].partition("-")[0] if item.path.parent == HERE else ""
        many = item.get_closest_marker("few") and model not in FEW
        if model and (many or model.startswith(LARGE)) and not item.get_closest_marker("campaign"):
            item.add_marker(pytest.mark.long)
