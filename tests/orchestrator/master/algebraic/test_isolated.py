"""Algebraic loops in the compiled loop with instances in processes of their own: as without isolation."""

import shutil
import sys

import fmpy
import pytest
from railcosim.orchestrator.isolation import HAS_LANES, isolate
from railcosim.orchestrator.isolation.process import HostProcess
from railcosim.orchestrator.master import compiled
from railcosim.orchestrator.run.execution import run
from railcosim.orchestrator.system import Connection, Event, System

pytestmark = [
    pytest.mark.skipif(compiled.kernel is None, reason="installed without the compiled step loop"),
    pytest.mark.skipif(not HAS_LANES, reason="there are no lanes here"),
    pytest.mark.skipif(not sys.platform.startswith("linux"), reason="FMUs by hand are compiled for Linux here"),
    pytest.mark.skipif(shutil.which("gcc") is None, reason="FMUs by hand need gcc"),
    pytest.mark.usefixtures("in_time", "nothing_left"),
]
ISOLATED = pytest.mark.parametrize("isolated", [["all"], ["together"], ["p"]], ids=" ".join)
START = {"a": -0.5, "c": -1.0}, {"a": 1.5, "b": 0.5, "c": 0.5}


@pytest.fixture
def apart(outcome, used):
    """Run a system with some instances isolated, compiled, and without; gives what it fails of, and what it counts."""

    def go(system, *names, **how):
        found = outcome(isolate(system, names), **how)
        assert used
        assert found == outcome(system, **how)
        return found[1:]

    return go


@pytest.mark.parametrize("derives", [True, False])
@pytest.mark.parametrize("f", range(6))
def test_bent_ones(apart, bent, coupled, derives, f):
    """Two processes, one that both share, one isolated and one here; held and swept."""
    start = [{"a": 0.5, "b": -0.75, "c": -1.0, "f": f}, {"a": -1.5, "b": 0.5, "c": 0.5, "f": f}]
    system = coupled(bent(derives=derives), *start, algorithm=("gauss-seidel", "jacobi")[f % 2])
    error, counts = apart(system, ("all", "together", "p")[f // 2])
    assert error is None
    assert counts["algebraic_loop"]["solutions"] > 0


def test_arrays(apart, looped_arrays):
    """Of FMI 3.0: a value of each element is asked for, with one reference for all."""
    assert apart(looped_arrays, "all")[0] is None


@pytest.mark.parametrize("mode", [0, 3, 11, 12, 23])
def test_fmi_3(apart, lagging, mode):
    """What it does in a step, or in reading, which may be that of a guess."""
    system = lagging(3, algebraic_loops="solve", stop_time=6.0)
    system.connections = [c for c in system.connections if c.target not in ("a.u", "b.u")]
    system.connect("a.y", "b.u", scale=0.3)
    system.connect("b.y", "a.u", scale=-0.5, offset=1.0)
    system.instances["b"].start["mode"] = mode
    error, counts = apart(system, "all")
    assert (error is None) == (mode in (0, 11))
    assert counts is None or counts["algebraic_loop"]["solutions"] > 0


WAYS = {
    "refresh": {"refresh": True},
    "a gain": {"events": [Event("p.u", "connect", 0.5, source=Connection("q.y", "p.u", scale=-2.0), duration=1.0)]},
    "an output": {"events": [Event("p.y", "bias", 0.5, value=0.5, duration=0.5)]},
    "a parameter": {"events": [Event("p.a", "set", 0.5, value=2.0)]},
}


@ISOLATED
@pytest.mark.parametrize("way", WAYS)
def test_events_and_refresh(apart, bent, coupled, isolated, way):
    """What leads into the loop, and what follows it; what is no part of it."""
    system = coupled(bent(), *START, **{key: value for key, value in WAYS[way].items() if key != "events"})
    for name, b in (("before", 1.0), ("after", 2.0), ("late", 1.0)):
        system.add(name, bent(), a=1.0, b=b)
    system.connections = [c for c in system.connections if c.target != "q.v"]
    system.connect("before.y", "q.v")
    system.connect("p.y", "after.u")
    system.connect("p.y", "late.u", delay=2)
    system.connect("late.y", "before.u", scale=0.01)
    system.events += WAYS[way].get("events", [])
    assert apart(system, *isolated)[0] is None


def test_inputs_that_go_on(apart, bent, coupled, able):
    system = coupled(bent(), *START, extrapolation=1)
    system.add("lag", able)
    system.connect("p.y", "lag.u")
    system.connect("lag.x", "lag.v", scale=0.5)
    assert apart(system, "together")[0] is None


def test_a_promise_without_a_function(apart, bent, coupled):
    assert apart(coupled(bent("-DMUTE"), {"a": 3.0}, {"a": -2.0, "c": 1.0}), "p")[0] is None


QUICK = {(103, True), (104, True), (203, True), (303, False), (400, True), (406, True), (407, True)}
MODES = [(mode, derives) for mode in (102, 103, 104, 109, 203, 204, 303, 304, 400, 406) for derives in (True, False)]


@pytest.mark.parametrize(
    ("mode", "derives"),
    [pytest.param(*each, marks=[pytest.mark.long] * (each not in QUICK)) for each in [*MODES, (407, True)]],
)
def test_one_that_fails_in_between(apart, bent, coupled, mode, derives):
    """Whoever refuses derivatives, is fatal as it is asked, or fails to be set, perhaps before it is asked, or read."""
    system = coupled(bent(derives=derives), {"a": 3.0, "mode": mode}, {"a": -2.0, "c": 1.0})
    error, _ = apart(system, "all")
    goes_on = mode in (102, 103, 400) or (mode in (104, 109) and not derives)
    assert error is None if goes_on else error[1] == "p"


@pytest.mark.parametrize("mode", [401, 402, 403, 404, pytest.param(405, marks=pytest.mark.long)])
def test_what_ends_a_solution(apart, bent, mode):
    """There is none, or what is tried is refused: as slopes are found, as a step is, as it is begun once more."""
    system = System(stop_time=2.0, step=0.25, algebraic_loops="solve")
    system.add("p", bent(derives=mode == 405), a=1.0, c=-2.1, f=4, mode=mode)
    if mode < 405:
        system.instances["p"].start |= {"a": 0.9, "c": 1.0, "f": 0}
    system.connect("p.y", "p.u")
    assert apart(system, "p")[0] is not None


@pytest.mark.parametrize("level", [4.5, -1.0])
def test_truth_values_and_whole_numbers(apart, mine, level):
    """y = t, or 10 + t while y is above a level; on upside down there is no solution at all."""
    system = System(stop_time=8.0, step=1.0, algebraic_loops="solve")
    system.add("switch", mine("Switch"))
    system.add("level", mine("Level"), level=abs(level))
    system.add("clock", mine("Clock"))
    system.connect("clock.t", "switch.w")
    system.connect("switch.y", "level.u")
    system.connect("level.on", "switch.on")
    if level < 0.0:
        system.add("bend", mine("Affine"), gain=-1.0)
        system.connections = [c for c in system.connections if c.target != "switch.w"]
        system.instances["level"].start |= {"upside_down": True, "level": 4.5}
        system.connect("clock.t", "bend.u", offset=-12.0)
        system.connect("bend.y", "switch.w")
    error, _ = apart(system, "all", kind="native")
    assert (error is None) == (level > 0.0)


@pytest.mark.parametrize("refresh", [True, False])
def test_steps_that_vary(apart, varying, refresh):
    assert apart(varying(step=0.5, refresh=refresh), "a", "last", kind="native")[0] is None


def test_steps_that_vary_and_no_solution(apart, unsolvable):
    assert "has no solution" in apart(unsolvable, "together", kind="native")[0][0]


def test_nobody_waits_long_in_the_loop(apart, bent, coupled, hurried):
    """Python waits for what is asked in the midst of a solution, which goes on."""
    for derives in (True, False):
        assert apart(coupled(bent(derives=derives), *START, stop=1.0), "all")[0] is None


# -------------------------------------------------------------------- lost in a solution


@pytest.fixture
def ringed(hostile):
    """Makes two of hostile.c of which y = x + v goes round, and of which one does its deed."""

    def make(deed, **how):
        system = System(**{"stop_time": 2.0, "step": 0.25, "algebraic_loops": "solve"} | how)
        system.add("it", hostile(mute=True), deed=deed, u=1.0)
        system.add("other", hostile(mute=True), u=1.0)
        system.connect("it.y", "other.v", scale=0.5)
        system.connect("other.y", "it.v", scale=-2.0, offset=1.0)
        system.instances["it"].step_timeout = 1.0
        return isolate(system, ["it"])

    return make


@pytest.fixture
def alike(outcome, used, monkeypatch):
    """Run a system compiled and in Python, isolated both times; gives what it fails of."""

    def go(system):
        found = outcome(system)
        assert used
        with monkeypatch.context() as patch:
            patch.setattr(compiled, "kernel", None)
            known = outcome(system)
        assert found[1:] == known[1:]
        assert _of_itself(found) == _of_itself(known)
        return found[1]

    return go


def _of_itself(found):
    """The values, but for numbers of processes."""
    return [column for column in found[0] if not column[0].endswith(".pid")]


@pytest.mark.parametrize(
    ("where", "what"),
    [
        *(("derive", what) for what in ("null", "exit", "hang", "fatal", "error")),
        *(("set", what) for what in ("null", "hang", "error")),
    ],
)
def test_one_that_is_lost_in_a_solution(ringed, alike, where, what):
    """Told as by the loop in Python; what was solved before is kept."""
    error = alike(ringed(f"{where} {what} 1"))
    if (where, what) == ("derive", "error"):
        assert error is None
        return
    text, instance, time, *_ = error
    assert (instance, time) == ("it", 1.0)
    assert {"derive": "fmi2GetDirectionalDerivative", "set": "fmi2SetReal"}[where] in text


@pytest.mark.parametrize("algorithm", ["gauss-seidel", "adaptive"])
def test_nobody_is_waited_for_who_is_interrupted(ringed, used, monkeypatch, algorithm):
    """A second Ctrl-C, while Python waits for what the loop has asked."""
    wait = HostProcess._wait

    def interrupt(process):
        if process.is_riding:
            raise KeyboardInterrupt
        wait(process)

    monkeypatch.setattr(HostProcess, "_wait", interrupt)
    tolerances = {"it.calls": [1.0, 1e9], "other.calls": [1.0, 1e9]}
    system = ringed("derive hang 1", algorithm=algorithm, tolerance=1e-2, tolerances=tolerances)
    result = run(system)
    assert used
    assert (result.status, result.time[-1]) == ("interrupted", 0.75)


def test_slow_is_not_hanging(ringed, outcome, used):
    """Each call for derivatives takes longer than the loop waits for it."""
    fast, slow = (outcome(ringed(deed, stop_time=0.5)) for deed in ("", "derive slow 0.25"))
    assert used
    assert fast[1:] == slow[1:]


@pytest.mark.parametrize("how", [{"algebraic_loops": "solve"}, {"extrapolation": 1}], ids=str)
def test_one_that_gives_nothing(apart, mine, compile_c, xml, tmp_path, *, how):
    """Nothing is read of it that would tell that it refuses what it is given."""
    v = xml["variable"]
    shown = [v("u", "input", start=0.0), v("mode", "parameter", "Integer", 0)]
    text = xml["description"](shown, identifier="Odd", simulation='canInterpolateInputs="true"')
    files = {
        "modelDescription.xml": text.replace('valueReference="1"', 'valueReference="8"'),
        f"binaries/{fmpy.platform}/Odd{fmpy.sharedLibraryExtension}": compile_c("odd.c"),
    }
    system = System(stop_time=8.0, step=0.5, **how)
    system.add("lag", mine("Lag"))
    system.add("a", mine("Affine"), gain=-3.0)
    system.add("taker", str(xml["write_archive"](tmp_path / "taker.fmu", files)), mode=33)
    system.connect("lag.x", "a.w")
    system.connect("a.y", "a.u")
    system.connect("a.y", "taker.u")
    error, _ = apart(system, "taker", kind="native")
    assert error[1:4] == ("taker", 5.0, "error")
