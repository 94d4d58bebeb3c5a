"""One instance behind the small face: an FMU, or the same component in this process."""

import os
import sys
from collections import deque
from pathlib import Path

import pytest
from railcosim.orchestrator.errors import FmuError, ScenarioError, StoppedError
from railcosim.orchestrator.fmi.binding import libraries as module
from railcosim.orchestrator.fmi.binding import messages
from railcosim.orchestrator.fmi.binding.fmi2 import FmuSlave
from railcosim.orchestrator.fmi.binding.libraries import forget_paths
from railcosim.orchestrator.fmi.models import load_fmu, load_models
from railcosim.orchestrator.system import System

BOTH = pytest.mark.parametrize("kind", ["python", "plain"])
TYPES = """
class AllTypes(Base):
    '''All types, in scalars and in arrays.'''

    gain = Parameter("1", 2.0, tunable=True, description="factor")
    u = Input("m", 0.0, description="real")
    n = Input("1", 0, type=int, description="integer")
    on = Input("1", False, description="boolean")
    word = Input("1", "", description="text")
    row = Input("1", shape=(3,), description="array of reals")
    doors = Input("1", False, shape=(2,), description="array of booleans")
    max_step = Parameter("s", 1.0, description="so that no rounding comes in")
    x = State("m", 1.0, output=True, description="integral of u")
    y = Output("m", description="gain times u")
    m = Output("1", int, description="n + 1")
    off = Output("1", bool, description="not on")
    said = Output("1", str, description="word, twice")
    back = Output("1", shape=(3,), description="row, backwards")
    shut = Output("1", bool, shape=(2,), description="not doors")

    def derivatives(self):
        return {"x": self.u}

    def outputs(self):
        return {
            "y": self.gain * self.u,
            "m": self.n + 1,
            "off": maths.logical_not(self.on),
            "said": self.word + self.word,
            "back": self.row[::-1],
            "shut": maths.logical_not(self.doors),
        }
"""


@pytest.fixture
def slave(workspace):
    """Instances of a model, given back at the end."""
    made = []

    def make(model, kind="python", name="it"):
        system = System()
        system.add(name, model)
        made.append(load_models(system, workspace, kind)[name].instantiate(name))
        return made[-1]

    yield make
    for one in made:
        one.free()
    forget_paths(workspace.folder)


def begin(slave):
    slave.setup(0.0, 10.0)
    slave.enter_initialization()
    slave.exit_initialization()
    return slave


@BOTH
def test_every_type_is_set_stepped_and_read(slave, components, kind):
    it = slave(components(TYPES)("AllTypes"), kind)
    it.setup(0.0, 10.0)
    it.channel("Real", ["gain"]).set([3.0])
    it.enter_initialization()
    it.exit_initialization()
    reals = it.channel("Real", ["u", "row[1]", "row[2]", "row[3]"])
    reals.set([2.0, 1.0, 2.0, 3.0])
    it.channel("Integer", ["n"]).set([41])
    it.channel("Boolean", ["on", "doors[1]", "doors[2]"]).set([1, 0, 1])
    it.channel("String", ["word"]).set(["zürich "])
    it.step(0.0, 0.25)
    assert it.time == 0.25
    assert it.channel("Real", ["y", "x", "back[1]", "back[2]", "back[3]"]).get() == [6.0, 1.5, 3.0, 2.0, 1.0]
    assert it.channel("Integer", ["m"]).get() == [42]
    assert it.channel("String", ["said"]).get() == ["zürich zürich "]
    truths = it.channel("Boolean", ["off", "shut[1]", "shut[2]"]).get()
    assert truths == [0, 1, 0]
    assert {type(t) for t in truths} == {int}, "as it is written to a file, a boolean is 0 or 1 in every kind"
    it.terminate()


@BOTH
def test_part_of_an_array_leaves_the_rest(slave, components, kind):
    it = begin(slave(components(TYPES)("AllTypes"), kind))
    it.channel("Real", ["row[1]", "row[2]", "row[3]"]).set([1.0, 2.0, 3.0])
    it.channel("Real", ["row[2]"]).set([20.0])
    assert it.channel("Real", ["back[1]", "back[2]", "back[3]"]).get() == [3.0, 20.0, 1.0]


@BOTH
def test_a_failure_says_instance_time_status_cause_and_line(slave, mine, kind):
    reference = mine("Fails")
    it = begin(slave(reference, kind, "brake"))
    y = it.channel("Real", ["y"])
    for k in range(10):
        it.step(k * 0.5, 0.5)
        y.get()
    it.step(5.0, 0.5)
    with pytest.raises(FmuError) as caught:
        y.get()
    error, text = caught.value, str(caught.value)
    assert (error.instance, error.time) == ("brake", 5.5)
    assert error.status in ("fatal", "error")
    assert text.startswith(f"brake, t = 5.5 s, status {error.status}: ")
    assert "ValueError: math domain error" in text
    source = Path(reference.rpartition(":")[0])
    line = next(k for k, text in enumerate(source.read_text().splitlines(), 1) if "maths.sqrt(self.until" in text)
    assert f"[toys.py:{line}, in outputs]" in text


def test_in_process_the_cause_is_kept_for_a_debugger(slave, mine):
    it = begin(slave(mine("Fails"), "plain"))
    it.step(0.0, 6.0)
    with pytest.raises(FmuError) as caught:
        it.channel("Real", ["y"]).get()
    assert isinstance(caught.value.__cause__, ValueError)


@BOTH
def test_a_start_value_out_of_bounds_fails_when_initialization_ends(slave, components, kind):
    it = slave(
        components("class Low(Base):\n    p = Parameter('m', 1.0, minimum=0.0)\n    y = Output('m')\n"
                   "    def outputs(self):\n        return {'y': self.p}\n")("Low"), kind
    )  # fmt: skip
    it.setup(0.0, 1.0)
    it.channel("Real", ["p"]).set([-1.0])
    it.enter_initialization()
    with pytest.raises(FmuError, match=r"Low\.p = -1\.0 is outside"):
        it.exit_initialization()


def test_each_fmu_has_its_own_log(slave, mine):
    """FMPy's helper for log messages remembers one logger for the whole process: not to be the last one's."""
    reference = mine("Fails")
    first, second = begin(slave(reference, name="first")), begin(slave(reference, name="second"))
    first.step(0.0, 6.0)
    with pytest.raises(FmuError) as caught:
        first.channel("Real", ["y"]).get()
    assert any("first (Fails) at t = 6.0 s: ValueError" in line for line in caught.value.log)
    assert list(second.log) == []


def test_what_an_fmu_says_is_not_printed(slave, mine, capfd):
    it = begin(slave(mine("Fails")))
    it.step(0.0, 6.0)
    with pytest.raises(FmuError):
        it.channel("Real", ["y"]).get()
    assert capfd.readouterr().out == ""


def test_a_python_fmu_whose_step_says_no_ends_the_simulation(slave, foreign, xml):
    it = begin(
        slave(foreign([xml["variable"]("y", "output")], "    def step(self, t, h, v):\n        return t < 2.0\n"))
    )
    it.step(0.0, 1.0)
    it.step(1.0, 1.0)
    with pytest.raises(StoppedError, match="it, t = 2 s: asks for the end of the simulation"):
        it.step(2.0, 1.0)


def test_after_a_fatal_status_nothing_is_called_any_more(slave, mine, monkeypatch):
    """Not even freeInstance: in an FMU of pythonfmu 0.7 it would drop its objects twice, and end the process."""
    freed = []
    bad, good = (begin(slave(mine("Fails"), name=name)) for name in ("bad", "good"))
    monkeypatch.setitem(good.functions, "fmi2FreeInstance", freed.append)  # the same functions are bad's
    bad.step(0.0, 6.0)
    with pytest.raises(FmuError) as caught:
        bad.channel("Real", ["y"]).get()
    assert caught.value.status == "fatal"
    bad.free()
    good.free()
    assert freed == [good.pointer]


def test_instances_share_a_library_which_is_given_back_with_the_last(slave, components):
    """FMPy loads and inspects it for each instance: half a second for 256 of them."""
    before = dict(module._LIBRARIES)
    reference = components(TYPES)("AllTypes")
    first, second = (begin(slave(reference, name=name)) for name in ("first", "second"))
    (path,) = module._LIBRARIES.keys() - before.keys()
    assert module._LIBRARIES[path].users == 2
    assert first.functions is second.functions
    assert first.pointer != second.pointer
    for one in (first, second):
        one.channel("Real", ["u"]).set([float(one is second)])
    assert [one.channel("Real", ["u"]).get() for one in (first, second)] == [[0.0], [1.0]]
    first.free()
    first.free()  # nothing more happens
    second.step(0.0, 0.5)
    second.free()
    assert path not in module._LIBRARIES


@pytest.mark.parametrize("status", [-1, 6, 42])
def test_a_status_that_the_standard_does_not_know_is_a_failure(slave, components, status):
    it = begin(slave(components(TYPES)("AllTypes"), name="it"))
    with pytest.raises(FmuError, match=rf"^it, t = 0 s, status {status} \(unknown\): fmi2GetReal failed$"):
        it.check("fmi2GetReal", status)


def test_loading_does_not_move_the_working_directory(slave, foreign, xml):
    here = os.getcwd()
    slave(foreign([xml["variable"]("y", "output")]))
    assert os.getcwd() == here


def test_forget_paths(slave, components, workspace):
    before = list(sys.path)
    slave(components(TYPES)("AllTypes"))
    assert any(entry.startswith(str(workspace.folder)) for entry in sys.path)
    forget_paths(workspace.folder)
    assert sys.path == before


def test_a_library_that_is_not_named_after_the_model(slave, foreign, xml):
    it = begin(slave(foreign([xml["variable"]("y", "output", start=4.0)], library="other_name")))
    assert it.channel("Real", ["y"]).get() == [4.0]


def test_no_library_for_this_platform(workspace, foreign, xml):
    path = foreign([xml["variable"]("y", "output")], platform="amiga")
    model = load_fmu(Path(path), workspace)  # it can still be described
    system = System()
    system.add("it", path)
    with pytest.raises(ScenarioError, match=rf"^instance 'it': {path} has no binary for \w+; it brings amiga$"):
        load_models(system, workspace)
    with pytest.raises(FmuError, match="it: cannot be instantiated: Foreign has no binary"):
        FmuSlave("it", model.interface, model.folder)


def test_a_library_that_does_not_load(workspace, foreign, xml, tmp_path):
    path = Path(foreign([xml["variable"]("y", "output")]))
    model = load_fmu(path, workspace)
    next(model.folder.glob("binaries/*/*")).write_bytes(b"not a library")
    with pytest.raises(FmuError, match=r"^it: cannot be instantiated: Failed to load shared library"):
        model.instantiate("it")


def test_a_long_line_of_a_log_is_cut_and_the_rest_is_counted():
    log = deque()
    messages.LOGS[b"a"] = log
    try:
        assert messages.keep_message([b"a"], 3, b"x" * 1000 + b"\nshort")
    finally:
        del messages.LOGS[b"a"]
    assert list(log) == ["[error] " + "x" * 492 + "... (508 more characters)", "[error] short"]
