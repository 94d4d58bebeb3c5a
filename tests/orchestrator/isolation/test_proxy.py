"""One instance in a process of its own: the face of any other, and whatever its FMU does is an error, not our end."""

import os
import random
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from railcosim.orchestrator.errors import FmuError, StoppedError
from railcosim.orchestrator.fmi.interface import Interface
from railcosim.orchestrator.fmi.models import load_fmu
from railcosim.orchestrator.isolation import launch
from railcosim.orchestrator.isolation import messages as doorbell
from railcosim.orchestrator.isolation import process as host_process
from railcosim.orchestrator.isolation import proxy as isolated
from railcosim.orchestrator.isolation.proxy import IsolatedSlave

pytestmark = [
    pytest.mark.skipif(not sys.platform.startswith("linux"), reason="FMUs by hand are compiled for Linux here"),
    pytest.mark.usefixtures("in_time", "nothing_left"),
]
VARIABLES = {"Real": (["u", "v"], ["x", "y", "calls"]), "Integer": (["m"], ["n"]), "Boolean": (["on"], ["off"]),
             "String": (["word"], ["said"])}  # fmt: skip
VALUES = {
    "Real": lambda dice: [dice.uniform(-9.0, 9.0), dice.choice([-0.0, 1e-320, 1e308, float("inf")])],
    "Integer": lambda dice: [dice.randrange(-(2**31), 2**31 - 1)],
    "Boolean": lambda dice: [dice.randrange(2)],
    "String": lambda dice: [dice.choice(["", "Zürich", "a b\nc", "x" * 90])],
}


@pytest.fixture
def apart(hostile, workspace):
    """An instance of hostile.c in a process of its own, not yet initialized; given back at the end."""
    made = []

    def make(deed="", name="it", *, path=None, begun=False, **how):
        model = load_fmu(Path(path or hostile()), workspace)
        made.append(IsolatedSlave(name, model.interface, model.folder, **how))
        if deed:
            made[-1].channel("String", ["deed"]).set([deed])
        return begin(made[-1]) if begun else made[-1]

    yield make
    for one in made:
        one.free()


def begin(slave):
    slave.setup(0.0, 10.0)
    slave.enter_initialization()
    slave.exit_initialization()
    return slave


def live(slave, steps=4, pause=0.0):
    """A whole life of half a second per step; the error that ends it, if one does."""
    u, y = slave.channel("Real", ["u"]), slave.channel("Real", ["y"])
    try:
        begin(slave)
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


# -------------------------------------------------------------------- the face of an instance


def test_every_type_is_set_stepped_and_read(apart):
    it = apart(begun=True)
    for kind, values in (("Real", [2.0, 0.5]), ("Integer", [41]), ("Boolean", [1]), ("String", ["zürich "])):
        it.channel(kind, VARIABLES[kind][0]).set(values)
    it.step(0.0, 0.25)
    assert it.channel("Real", ["y", "x"]).get() == [1.0, 0.5]
    assert it.time == 0.25
    assert it.channel("Integer", ["n"]).get() == [42]
    assert it.channel("String", ["said"]).get() == ["zürich zürich "]
    truths = it.channel("Boolean", ["off"]).get()
    assert truths == [0]
    assert type(truths[0]) is int
    assert it.channel("Real", ["pid"]).get() == [it.pid]
    assert it.pid != os.getpid()
    it.terminate()


def test_it_is_fresh_after_a_set_a_step_and_a_restored_state(apart):
    it = apart(begun=True)
    u, y = it.channel("Real", ["u", "v"]), it.channel("Real", ["y"])
    found, state = [], None
    for k in range(4):
        u.set([1.0, 10.0 * k])
        found += y.get()
        state = state or it.save()
        it.step(0.5 * k, 0.5)
        found += y.get()
    it.restore(state)
    assert it.time == 0.0
    assert found + y.get() == [0.0, 0.5, 10.5, 11.0, 21.0, 21.5, 31.5, 32.0, 0.0]


class Pair:
    """The same instance twice, here and in a process of its own, to be asked the same."""

    def __init__(self, here, there, seed):
        self.both, self.dice, self.states, self.now = (here, there), random.Random(seed), [], 0.0
        self.inputs = {kind: self.channels(kind, names) for kind, (names, _) in VARIABLES.items()}
        self.outputs = [self.channels(kind, names) for kind, (_, names) in VARIABLES.items()]
        self.part = self.channels("Real", ["v"])

    def channels(self, kind, names):
        return [one.channel(kind, names) for one in self.both]

    def same(self, ask):
        here, there = map(ask, self.both)
        assert repr(there) == repr(here)

    def set(self):
        kind = self.dice.choice(list(VARIABLES))
        values = VALUES[kind](self.dice)
        for one in self.inputs[kind]:
            one.set(values)

    def set_a_part(self):
        for one in self.part:
            one.set([self.now])

    def get(self):
        here, there = (one.get() for one in self.dice.choice([*self.outputs, *self.inputs.values()]))
        assert repr(there) == repr(here)

    def step(self):
        final = bool(self.dice.randrange(2))
        for one in self.both:
            one.step(self.now, 0.125, final=final)
        self.now += 0.125

    def save(self):
        self.states.append([one.save() for one in self.both])

    def restore(self):
        if self.states:
            for one, state in zip(self.both, self.dice.choice(self.states), strict=True):
                one.restore(state)
            self.now = self.both[0].time

    def serialize(self):
        if self.states:
            chosen = zip(self.both, self.dice.choice(self.states), strict=True)
            self.states.append([one.deserialize(one.serialize(state)) for one, state in chosen])

    def forget(self):
        if self.states:
            for one, state in zip(self.both, self.states.pop(), strict=True):
                one.forget(state)

    def interpolate(self):
        for one in self.both:
            one.interpolate(["u"], [1], [0.25])

    def derive(self):
        self.same(lambda one: one.directional_derivatives(["x", "y"], ["v"], [2.0]))

    def live(self, count):
        acts = [self.set, self.set_a_part, self.get, self.get, self.step, self.step, self.save, self.restore]
        acts += [self.serialize, self.forget, self.interpolate, self.derive]
        for _ in range(count):
            self.dice.choice(acts)()
            if self.dice.randrange(2):  # waits for a step that is under way
                self.same(lambda one: [*one.channel("Real", ["x"]).get(), one.time])


@pytest.mark.parametrize("seed", range(6))
def test_whatever_it_is_asked_its_answers_are_those_without_isolation(apart, alone, hostile, monkeypatch, seed):
    """Also where there is no room, or not enough, in the shared memory."""
    room = (None, 0, 3)[seed % 3]
    if room is not None:
        monkeypatch.setattr(isolated, "_CELLS_PER_VARIABLE", 0)
        monkeypatch.setattr(isolated, "_SPARE_CELLS", room)
    Pair(begin(alone(hostile())), apart(begun=True), seed).live(500)


def test_a_state_written_here_is_read_in_another_process(apart):
    first, second = apart(begun=True), apart(name="other", begun=True)
    first.channel("Real", ["u"]).set([4.0])
    first.step(0.0, 1.0)
    second.restore(second.deserialize(first.serialize(first.save())))
    assert second.time == 1.0
    assert second.channel("Real", ["x", "pid"]).get() == [4.0, first.pid]


def test_thousands_of_values(apart, workspace, hostile, monkeypatch):
    """More than a frame, and than what a socket holds."""
    it = apart(begun=True)
    names = ["u", "v"] * 40_000
    wide, values = it.channel("Real", names), [float(k) for k in range(80_000)]
    wide.set(values)
    assert wide.get() == [79_998.0, 79_999.0] * 40_000
    words = it.channel("String", ["word"] * 5_000)
    words.set(["w" * 100] * 5_000)
    assert words.get() == ["w" * 100] * 5_000


@pytest.mark.parametrize("version", [1, 3])
def test_other_versions_of_fmi(apart, alone, by_hand, version):
    path = by_hand(version)
    pair = [begin(alone(path)), apart(path=path, begun=True)]
    for k in range(5):
        for one in pair:
            one.channel("Real", ["u"]).set([1.0 + k])
            one.step(0.25 * k, 0.25)
        here, there = (one.channel("Real", ["x", "y"]).get() for one in pair)
        assert there == here


def test_whole_numbers_that_need_64_bits_without_sign(apart, by_hand):
    it = apart(path=by_hand(3))
    names = [v.name for v in it.interface.variables.values() if v.fmi_type == "UInt64" and v.causality == "input"]
    begin(it)
    channel = it.channel("Integer", names)
    channel.set([2**64 - 1] * len(names))
    assert channel.get() == [2**64 - 1] * len(names)


def test_python_fmus(apart, components, workspace):
    from railcosim.fmus.build import build

    body = "class Sum(Base):\n    '''A sum.'''\n    u = Input('m', 0.0)\n    y = Output('m')\n    x = State('m', 0.0, "
    body += "output=True)\n    def derivatives(self):\n        return {'x': self.u}\n    def outputs(self):\n        "
    body += "return {'y': maths.sqrt(self.u) + 1.0}\n"
    it = apart(path=build(components(body)("Sum"), {}, kind="python"), begun=True)
    u, y = it.channel("Real", ["u"]), it.channel("Real", ["y", "x"])
    u.set([4.0])
    it.step(0.0, 0.5)
    assert y.get() == [3.0, 2.0]
    u.set([-1.0])
    with pytest.raises(FmuError, match="math domain error"):
        y.get()


def test_unknown_variables(apart):
    with pytest.raises(KeyError):
        apart().channel("Real", ["nobody"])


def test_a_pipe_that_is_not_inherited(apart, monkeypatch):
    """As on Windows, where the process connects to a port and shows a password."""
    monkeypatch.setattr(launch, "INHERITS", False)
    it = apart(begun=True)
    it.channel("Real", ["u"]).set([1.0])
    it.step(0.0, 1.0)
    assert it.channel("Real", ["x"]).get() == [1.0]


# -------------------------------------------------------------------- failures


@pytest.mark.parametrize("status", ["discard", "error", "fatal"])
@pytest.mark.parametrize("where", ["step", "get", "set", "enter", "exit", "terminate"])
def test_a_bad_status_is_the_error_it_is_without_isolation(apart, alone, hostile, where, status):
    told = []
    for one in (alone(hostile()), apart()):
        one.channel("String", ["deed"]).set([f"{where} {status} {1.0 if where in ('step', 'get', 'set') else 0.0}"])
        error = live(one)
        told.append((type(error), str(error), error.instance, error.time, error.status, error.log))
    assert told[0] == told[1]
    assert told[0][4] == status


def test_the_wish_to_end_is_handed_on(apart, foreign, xml):
    path = foreign([xml["variable"]("y", "output")], "    def step(self, t, h, v):\n        return t < 1.0\n")
    it = apart(path=path, begun=True)
    it.step(0.0, 1.0)
    with pytest.raises(StoppedError, match="it, t = 1 s: asks for the end of the simulation"):
        it.step(1.0, 1.0)


ENDS = {
    "null": r"its process crashed in {} \(SIGSEGV\)",
    "abort": r"its process crashed in {} \(SIGABRT\)",
    "exit": r"its process ended in {} \(exit code 7\)",
    "kill": r"its process was killed in {} \(SIGKILL\), most likely by the system, for lack of memory",
    "hang": r"did not return from {} within 1 s; its process was ended; set step_timeout to allow more wall time",
}
CALLS = {
    "enter": ("EnterInitializationMode", 0.0),
    "exit": ("ExitInitializationMode", 0.0),
    "set": ("SetReal", 1.0),
    "step": ("DoStep", 1.0),
    "get": ("GetReal", 1.0),
    "save": ("GetFMUstate", 1.0),
    "terminate": ("Terminate", 2.0),
}


@pytest.mark.parametrize(
    ("where", "what"),
    [*((where, "null") for where in CALLS), *(("step", what) for what in ENDS), ("terminate", "hang")],
)
def test_a_process_that_is_lost(apart, where, what):
    call, when = CALLS[where]
    it = apart(f"{where} {what} {when}", "odd[1]", step_timeout=1.0)
    error = live(it)
    assert (error.instance, error.time, error.status) == ("odd[1]", when, "")
    assert re.fullmatch(rf"odd\[1\], t = {when:g} s: {ENDS[what].format(f'fmi2{call}')}", str(error))
    u, y = it.channel("Real", ["u"]), it.channel("Real", ["y"])
    for after in (lambda: u.set([1.0]), y.get, lambda: it.step(0.0, 1.0), it.save, it.terminate):
        with pytest.raises(FmuError) as again:
            after()
        assert str(again.value) == str(error), "after its end nothing is called any more"
    it.forget(None)


@pytest.mark.parametrize("what", ["abort", "exit", "hang"])
@pytest.mark.parametrize("where", ["instantiate", "setup"])
def test_a_process_that_is_lost_before_it_can_be_told_anything(apart, hostile, where, what):
    it = apart(path=hostile(f"{where} {what}"), step_timeout=1.0)
    it.channel("Real", ["u"]).set([1.0])
    call, at = {"instantiate": ("Instantiate", ""), "setup": ("SetupExperiment", ", t = 0 s")}[where]
    with pytest.raises(FmuError, match=rf"^it{at}: {ENDS[what].format(f'fmi2{call}')}$"):
        it.setup(0.0, 1.0)


def test_an_instance_that_is_refused(apart, hostile):
    it = apart(path=hostile("instantiate error"))
    with pytest.raises(FmuError, match=r"^it: cannot be instantiated: it gives no instance\n    \[error\] it: error$"):
        it.setup(0.0, 1.0)
    with pytest.raises(FmuError, match="cannot be instantiated"):
        it.enter_initialization()


def test_a_library_that_does_not_load(apart, workspace, hostile):
    path = hostile()
    next(load_fmu(Path(path), workspace).folder.glob("binaries/*/*")).write_bytes(b"not a library")
    with pytest.raises(FmuError, match="cannot be instantiated: Failed to load shared library"):
        apart(path=path, begun=True)


@pytest.mark.parametrize("what", ENDS)
def test_a_process_that_is_lost_when_it_is_freed(apart, caplog, what):
    it = apart(f"free {what}", step_timeout=1.0, begun=True)
    it.terminate()
    it.free()
    it.free()
    (record,) = caplog.records
    assert record.levelname == "WARNING"
    assert "fmi2FreeInstance" in record.getMessage()


def test_a_crash_tells_what_the_fmu_said_last(apart):
    it = apart("step cry 1")
    begin(it)
    it.step(0.0, 1.0)
    with pytest.raises(FmuError) as caught:
        it.step(1.0, 1.0)
    assert caught.value.log == ["[warning] it: beware", "printed at 1 s"]
    assert str(caught.value).endswith("(SIGSEGV)\n    [warning] it: beware\n    printed at 1 s")


def test_what_an_fmu_prints_is_not_shown_and_does_not_fill_the_disk(apart, workspace, capfd):
    it = apart("step print", begun=True)
    (output,) = workspace.folder.glob("host_*/output")
    most = 0
    for k in range(3000):
        it.step(0.1 * k, 0.1)
        most = max(most, output.stat().st_size)
    until = time.monotonic() + 10.0
    while output.stat().st_size >= most and time.monotonic() < until:
        time.sleep(0.1)
    assert output.stat().st_size < most, "it was cut"
    assert capfd.readouterr() == ("", "")


def test_slow_is_not_hanging(apart):
    it = apart("step slow 0.5", step_timeout=5.0, begun=True)
    x = it.channel("Real", ["calls"])
    for k in range(4):
        it.step(0.5 * k, 0.5)
        assert x.get() == [k + 1.0]


def test_a_leak_ends_at_the_limit(apart):
    error = live(apart("step leak", memory_limit=100.0), 20)
    assert error.status == "error"
    assert error.log == ["[error] it: no memory is left"]
    assert re.search(
        "fmi2DoStep failed; it had [0-9]+ of the 100 MiB that memory_limit allows: a likely reason", str(error)
    )


def test_a_crash_for_lack_of_memory(apart):
    error = live(apart("step gulp", memory_limit=100.0), 20, pause=0.1)
    assert re.search(r"crashed in fmi2DoStep \(SIGSEGV\); it had \d+ of the 100 MiB that memory_limit", str(error))


def test_a_crash_under_a_limit(apart):
    error = live(apart("step null", memory_limit=100.0))
    assert str(error) == "it, t = 0 s: its process crashed in fmi2DoStep (SIGSEGV); its memory_limit was 100 MiB"


def test_a_limit_that_leaves_enough(apart):
    it = apart("step leak", memory_limit=100.0, begun=True)
    for k in range(3):
        it.step(0.5 * k, 0.5)
    it.terminate()


def test_what_a_lost_process_has_started_is_ended_too(apart):
    it = apart("step fork", step_timeout=1.0, begun=True)
    with pytest.raises(FmuError, match=r"its process crashed in fmi2DoStep \(SIGABRT\)"):
        it.step(0.0, 1.0)
    until = time.monotonic() + 10.0
    while members_of(it.pid) and time.monotonic() < until:
        time.sleep(0.05)
    assert not members_of(it.pid)


def members_of(group):
    """Processes of a group, the dead ones aside."""
    found = []
    for place in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, _, member = place.read_text().rpartition(")")[2].split()[:3]
        except OSError:
            continue
        if int(member) == group and state != "Z":
            found.append(place.parent.name)
    return found


def test_a_process_that_does_not_start(apart, monkeypatch):
    monkeypatch.setattr(launch, "_BOOT", "raise SystemExit('no way')")
    with pytest.raises(FmuError, match=r"^it: its process could not be started \(exit code 1\)\n    no way$"):
        apart(begun=True)


def test_no_process_at_all(apart, monkeypatch):
    monkeypatch.setattr(sys, "executable", "/no/python")
    with pytest.raises(
        FmuError, match=r"^it: its process cannot be started: .*No such file or directory: '/no/python'$"
    ):
        apart()


def test_a_process_that_is_lost_between_two_calls(apart):
    """And whose memory cannot be trusted."""
    it = apart(begun=True)
    it._process.memory[:16] = b"\xff" * 16
    os.kill(it.pid, signal.SIGSEGV)
    with pytest.raises(FmuError, match=r"^it, t = 0 s: its process crashed between two calls \(SIGSEGV\)$"):
        it.terminate()


def test_a_process_that_does_not_listen(apart):
    it = apart(step_timeout=0.5, begun=True)
    os.kill(it.pid, signal.SIGSTOP)
    with pytest.raises(FmuError, match=r"did not return from what it was asked for within 0\.5 s"):
        it.terminate()


@pytest.mark.parametrize("inherits", [True, False])
def test_a_process_that_takes_too_long_to_start(apart, monkeypatch, inherits):
    monkeypatch.setattr(launch, "INHERITS", inherits)
    monkeypatch.setattr(host_process, "PATIENCE", 0.5)
    monkeypatch.setattr(launch, "_BOOT", "import time; time.sleep(60)")
    with pytest.raises(FmuError, match=r"^it: its process did not start within 0.5 s$"):
        apart(step_timeout=0.5, begun=True)


def test_what_cannot_be_read_is_no_answer(apart, monkeypatch):
    it = apart(begun=True)
    monkeypatch.setattr(doorbell, "content", lambda body: int("garbage"))
    with pytest.raises(FmuError, match="its process sends what cannot be read"):
        it.save()
    assert not Path(f"/proc/{it.pid}").exists()


def test_a_second_interruption_does_not_wait(apart):
    it = apart("step hang 1", begun=True)
    it.step(0.0, 1.0)

    def interrupt(*_):
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGUSR1, interrupt)
    helper = subprocess.Popen([sys.executable, "-c", f"import os, time; time.sleep(0.3); os.kill({os.getpid()}, 10)"])
    try:
        with pytest.raises(KeyboardInterrupt):
            it.step(1.0, 1.0)
    finally:
        helper.wait()
        signal.signal(signal.SIGUSR1, before)
    assert not Path(f"/proc/{it.pid}").exists()
    with pytest.raises(FmuError, match="was interrupted"):
        it.terminate()


# -------------------------------------------------------------------- nobody is left

MASTER = """
import sys, threading, time
from pathlib import Path
from railcosim.orchestrator.fmi.archive import Workspace
from railcosim.orchestrator.isolation.proxy import IsolatedSlave
from railcosim.orchestrator.fmi.models import load_fmu

def work():
    model = load_fmu(Path(sys.argv[1]), Workspace())
    it = IsolatedSlave("it", model.interface, model.folder)
    it.channel("String", ["deed"]).set([sys.argv[2]])
    it.setup(0.0, 10.0)
    it.enter_initialization()
    it.exit_initialization()
    print(it.pid, flush=True)
    it.step(0.0, 1.0)
    time.sleep(60)

if sys.argv[3] == "thread":
    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
else:
    work()
"""


@pytest.mark.long
@pytest.mark.parametrize("thread", ["main", "thread"])
@pytest.mark.parametrize("deed", ["step hang", "nothing"])
def test_a_process_ends_with_its_master_even_inside_a_step(hostile, deed, thread, tmp_path):
    command = [sys.executable, "-c", MASTER, hostile(), deed, thread]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, text=True, env=os.environ | {"TMPDIR": str(tmp_path)}
    ) as master:
        process = Path(f"/proc/{int(master.stdout.readline())}")
        time.sleep(0.3)
        assert process.exists()
        master.kill()
    until = time.monotonic() + 10.0
    while process.exists() and time.monotonic() < until:
        time.sleep(0.05)
    assert not process.exists()


def test_an_instance_that_was_never_used(apart):
    it = apart()
    pid = it.pid
    it.free()
    assert not Path(f"/proc/{pid}").exists()


def test_the_names_of_calls_are_the_standards():
    from railcosim.orchestrator.fmi.binding.versions import SLAVES, call_name

    for version, slave in SLAVES.items():
        interface = Interface("m", "m", "g", {}, {}, {}, version=version)
        for call in doorbell.CALLS[1:]:
            kind = next(iter(slave.TYPES))
            name = call_name(interface, call, kind, ())
            assert name in slave.SIGNATURES or name == call
