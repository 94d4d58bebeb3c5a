"""Isolated instances in the compiled step loop: the same bits, and the same errors, as without isolation."""

import re
import shutil
import sys
from dataclasses import replace
from itertools import product
from time import perf_counter

import fmpy
import pytest
from railcosim.orchestrator.errors import FmuError
from railcosim.orchestrator.isolation import HAS_LANES, choice, isolate
from railcosim.orchestrator.master import compiled
from railcosim.orchestrator.run.execution import run
from railcosim.orchestrator.system import Event, System

pytestmark = [
    pytest.mark.skipif(compiled.kernel is None, reason="installed without the compiled step loop"),
    pytest.mark.skipif(not HAS_LANES, reason="there are no lanes here"),
    pytest.mark.skipif(not sys.platform.startswith("linux"), reason="FMUs by hand are compiled for Linux here"),
    pytest.mark.skipif(shutil.which("gcc") is None, reason="FMUs by hand need gcc"),
    pytest.mark.usefixtures("in_time", "nothing_left"),
]
ALGORITHMS = pytest.mark.parametrize("algorithm", ["gauss-seidel", "jacobi"])


@pytest.fixture
def apart(used, contents):
    """Run a system with some instances isolated, compiled, and without isolation; gives the first result."""

    def go(system, *names):
        found = attempt(isolate(system, names))
        assert used
        known = attempt(system)
        assert contents(found) == contents(known)
        assert described(found.error) == described(known.error)
        return found

    return go


def attempt(system):
    try:
        return run(system)
    except FmuError as error:
        return error.run


def described(error):
    return error and (str(error), error.instance, error.time, error.status, error.log)


# -------------------------------------------------------------------- the same bits


@ALGORITHMS
def test_every_type_with_delays_events_and_steps_of_its_own(apart, odd, ring, algorithm):
    system = ring(odd, 3, algorithm=algorithm)
    system.instances["odd[2]"].step = 0.5
    system.events = [Event("odd[1].on", "override", 2.0, value=True, duration=3.0)]
    result = apart(system, "all")
    assert result["odd[2].n"][-1] >= 10
    assert set(result["odd[1].off"]) == {0.0, 1.0}


@pytest.mark.parametrize("isolated", [["all"], ["together"], ["a", "c"]])
def test_isolated_neighbours_that_hand_nothing_on_step_at_once(apart, odd, instantiated, isolated):
    """With an event, a delay and a step of one's own; in a cycle, in which one instance is a step late."""
    system = System(stop_time=9.0, step=0.25, order=list("abcd"))
    for name in "abcd":
        system.add(name, odd, u=1.0)
    for source, target in ("ac", "bc", "cd", "da"):
        system.connect(f"{source}.x", f"{target}.{'v' if source == 'b' else 'u'}", offset=0.5)
    system.connect("a.n", "b.m", delay=1)
    system.connect("d.off", "b.on")
    system.instances["d"].step = 0.5
    system.events = [Event("a.u", "bias", 2.0, value=0.5, duration=3.0), Event("c.x", "freeze", 4.0, duration=1.0)]
    apart(system, *isolated)
    system.connections = [x for x in system.connections if x.delay == 0]
    apart(system, *isolated)
    names = [batch.names for batch in instantiated(isolate(system, isolated)).algorithm.program()]
    assert names == [("a",), ("b",), ("c",), ("d",)] if isolated == ["a", "c"] else [("a", "b"), ("c",), ("d",)]


@pytest.mark.sample(4)
@pytest.mark.parametrize("isolated", ["all", "together"])
@pytest.mark.parametrize("modes", [(41, 41), (3, 0), (0, 23), (3, 33), (10, 3)])
def test_of_isolated_neighbours_the_first_that_fails_is_named(apart, odd_fmu, tmp_path, *, modes, isolated):
    path = odd_fmu(tmp_path, "canHandleVariableCommunicationStepSize")
    system = System(stop_time=9.0, step=0.25)
    for name, mode in zip("ab", modes, strict=True):
        system.add(name, path, u=1.0, mode=mode)
    system.add("c", path)
    for k, name in enumerate("ab"):
        system.connect(f"{name}.x", f"c.{'uv'[k]}")
        system.connect("c.x", f"{name}.u")
    result = apart(system, isolated)
    assert (result.error is None) == (modes == (41, 41))


@pytest.mark.parametrize("isolated", ["all", "together"])
@pytest.mark.parametrize("modes", [(3, 4), (3, 5), (5, 3), (5, 5), (41, 5)])
def test_a_neighbour_that_fails_as_well_is_seen_to(apart, odd_fmu, tmp_path, caplog, *, modes, isolated):
    """They step at once, and the first is told of: a fatal one is not given back, a pending step is cancelled once."""
    system = System(stop_time=9.0, step=0.25)
    path = odd_fmu(tmp_path, "canHandleVariableCommunicationStepSize")
    for name, mode in zip("abc", (*modes, 0), strict=True):
        system.add(name, path, u=1.0, mode=mode)
    for source, target in zip("abcc", ("c.u", "c.v", "a.u", "b.u"), strict=True):
        system.connect(f"{source}.x", target)
    assert apart(system, isolated).error.instance == ("b" if modes[0] == 41 else "a")
    assert not caplog.records


@pytest.mark.parametrize("mode", [4, 5])
def test_an_isolated_neighbour_of_one_that_fails_here(apart, able, caplog, mode):
    """With steps that vary: who was fatal does not come back to a state, a pending step is cancelled before."""
    system = coupled(able, "adaptive", mode)
    system.instances["a"].start["mode"] = 3
    assert apart(system, "b").error
    assert not caplog.records


@ALGORITHMS
def test_whoever_is_not_waited_for_in_the_loop_is_waited_for_outside(apart, odd, ring, algorithm, hurried):
    assert apart(ring(odd, 2, algorithm=algorithm), "all").status == "completed"


@pytest.mark.parametrize(("version", "mode"), [(1, 4), (1, 7), (1, 23), (3, 8), (3, 9), (3, 13), (3, 23)])
def test_other_versions_of_fmi_that_fail_or_end(apart, lagging, version, mode):
    """All the rest of what they may do is in the long tests of the compiled loop for either."""
    system = lagging(version)
    system.instances["b"].start["mode"] = mode
    assert apart(system, "b").status == {7: "completed", 8: "terminated"}.get(mode, "failed")


@pytest.mark.parametrize("mode", [3, 8])
def test_a_step_of_its_own_that_failed_is_told_before_an_event(apart, plainly, mode):
    """Its outputs are due later, and nothing else may be asked of it before."""
    path = plainly(3, ('valueReference="3" dependencies="1 2"', 'valueReference="3" dependencies="2"'))
    system = System(stop_time=6.0, step=0.25)
    system.add("it", path, mode=mode)
    system.instances["it"].step = 0.5
    system.events.append(Event("it.gain", "set", 5.25, value=2.0))
    found, known = attempt(isolate(system, ["it"])), attempt(system)
    assert described(found.error) == described(known.error)
    assert (found.status, found.time[-1], known.time[-1]) == (known.status, 5.25, 5.0)


@pytest.mark.parametrize(("version", "mode"), [(1, 6), (3, 6), (3, 8), (3, 11)])
def test_so_it_is_with_steps_of_other_versions_that_are_not_over(apart, lagging, version, mode, hurried):
    system = lagging(version, algorithm="jacobi")
    system.instances["b"].start["mode"] = mode
    assert apart(system, "all").status == ("terminated" if mode == 8 else "completed")


def test_an_fmu_that_gives_nothing(apart, compile_c, xml, tmp_path, hurried):
    """Nothing is read of it that would wait for its steps."""
    files = {
        "modelDescription.xml": xml["description"]([], identifier="Odd"),
        f"binaries/{fmpy.platform}/Odd{fmpy.sharedLibraryExtension}": compile_c("odd.c"),
    }
    system = System(stop_time=9.0, step=0.25)
    system.add("mute", str(xml["write_archive"](tmp_path / "mute.fmu", files)))
    assert len(apart(system, "mute").time) == 37


def test_a_state_is_saved_between_two_blocks(hostile, instantiated):
    """Then the process takes messages, at the time that the loop has got to; and calls through the lane again."""
    system = System(stop_time=4.0, step=0.25)
    system.add("it", hostile(mute=True), u=1.0)
    system.connect("it.x", "it.v")
    master = instantiated(isolate(system, ["it"]))
    rows = []

    def see(steps, found):
        rows.extend(list(row) for row in found)
        return True

    assert master.run(0.0, 0.25, 16, 1, see, until=8)
    states = {name: slave.save() for name, slave in master.slaves.items()}
    assert {slave.time for slave in master.slaves.values()} == {2.0}
    kept = master.save()
    assert master.run(0.0, 0.25, 16, 1, see, first=8)
    first = rows[8:]
    for name, slave in master.slaves.items():
        slave.restore(states[name])
    master.restore(kept)
    del rows[8:]
    assert master.run(0.0, 0.25, 16, 1, see, first=8)
    assert rows[8:] == first


def test_without_room_for_its_values_it_is_called_by_messages(used, odd, ring, monkeypatch):
    monkeypatch.setattr(choice, "_CELLS_PER_VARIABLE", 0)
    monkeypatch.setattr(choice, "_SPARE_CELLS", 1)
    assert run(isolate(ring(odd, 2, 1.0), ["all"])).status == "completed"
    assert not used


# -------------------------------------------------------------------- failures


@pytest.mark.sample(3)
@pytest.mark.parametrize(
    ("mode", "algorithm"),
    [
        *((mode, "gauss-seidel") for mode in (3, 23, 33, 1, 10, 41)),
        *(
            pytest.param(mode, algorithm, marks=pytest.mark.long)
            for mode, algorithm in [
                *((mode, "gauss-seidel") for mode in (4, 63, 73, 40, 42, 44)),
                *((mode, "jacobi") for mode in (3, 4, 23, 33, 1, 10, 40, 41, 42, 44)),
            ]
        ),
    ],
)
def test_whatever_it_does_is_told_as_without_isolation(apart, odd_fmu, ring, tmp_path, *, algorithm, mode):
    """A status of a step, of reading, of setting; what is not finite; discarded steps; how numbers are rounded."""
    system = ring(odd_fmu(tmp_path, "canHandleVariableCommunicationStepSize"), 3, algorithm=algorithm)
    system.instances["odd[1]"].start["mode"] = mode
    assert len(apart(system, "odd[1]").time) == (41 if mode in (1, 40, 41, 44) else 20 if mode in (10, 23, 63) else 21)


@pytest.mark.sample(4)
@ALGORITHMS
@pytest.mark.parametrize("modes", [(41, 41), (40, 3), (41, 23), (10, 41)])
def test_in_a_process_that_they_share_each_fails_for_itself(apart, odd_fmu, ring, tmp_path, *, modes, algorithm):
    """Two in the same step: what one is asked because of that leaves it to be told that the other failed."""
    system = ring(odd_fmu(tmp_path, "canHandleVariableCommunicationStepSize"), 3, algorithm=algorithm)
    for name, mode in zip(("odd[0]", "odd[2]"), modes, strict=True):
        system.instances[name].start["mode"] = mode
    result = apart(system, "together")
    assert (result.status == "completed") == (modes == (41, 41))
    assert len(result.time) >= 20


@pytest.mark.parametrize("scale", [1e9, -1e9])
def test_a_number_that_no_whole_one_holds(apart, odd, mine, scale):
    system = System(stop_time=4.0, step=0.25)
    system.add("a", odd, u=1.0, v=1.0)
    system.add("b", odd)
    system.connect("a.x", "b.m", scale=scale * 10.0, threshold=0.5)
    result = apart(system, "b")
    assert "its type Integer holds -2147483648 to 2147483647" in str(result.error)


ENDS = {
    "null": r"its process crashed in {} \(SIGSEGV\)",
    "exit": r"its process ended in {} \(exit code 7\)",
    "kill": r"its process was killed in {} \(SIGKILL\), most likely by the system, for lack of memory",
    "hang": r"did not return from {} within 1 s; its process was ended; set step_timeout to allow more wall time",
    "close_all": r"its process lost its line to the master .* or before: the FMU closes descriptors that are not its",
}


@pytest.mark.sample(5)
@pytest.mark.parametrize(
    ("where", "what", "algorithm"),
    [
        *(("step", what, "gauss-seidel") for what in ENDS),
        *((where, what, "gauss-seidel") for where in ("get", "set") for what in ("null", "hang")),
        ("save", "null", "iterative"),
        ("step", "exit", "iterative"),
        ("save", "hang", "adaptive"),
        ("get", "null", "adaptive"),
    ],
)
def test_a_process_that_is_lost(used, hostile, where, what, algorithm):
    system = System(stop_time=4.0, step=0.5, algorithm=algorithm, tolerance=1e-2)
    system.add("it", hostile(mute=True), deed=f"{where} {what} 1")
    system.instances["it"] = replace(system.instances["it"], isolate=True, step_timeout=1.0)
    system.add("other", hostile(mute=True))
    system.connect("other.x", "it.u")
    if algorithm != "gauss-seidel":
        system.connect("it.x", "other.u", offset=1.0)
        system.stepping = replace(
            system.stepping, tolerances={f"{name}.calls": [1.0, 1e9] for name in system.instances}
        )
    result = attempt(system)
    assert used
    call = {"step": "DoStep", "get": "GetReal", "set": "SetReal", "save": "GetFMUstate"}[where]
    assert result.error.instance == "it"
    assert re.match(rf"it, t = [0-9.]+ s: {ENDS[what].format(f'fmi2{call}')}", str(result.error))


@pytest.mark.parametrize(
    "how",
    [
        {"refresh": True},
        {"extrapolation": 1},
        {"algorithm": "iterative"},
        {"algorithm": "iterative", "extrapolation": 1},
    ],
    ids=str,
)
def test_the_time_of_one_that_is_lost_as_it_is_set(used, hostile, monkeypatch, how):
    """After a step or before it, which may be one that is repeated: as the loop in Python tells it."""
    system = System(**{"stop_time": 4.0, "step": 0.5, "tolerance": 1e-2} | how)
    for name, deed in (("other", ""), ("it", "set null 1")):
        system.add(name, hostile(mute=True), deed=deed, v=1.0)
        system.instances[name].isolate = True
    system.connect("other.y", "it.v", scale=0.5)
    system.connect("other.x", "it.u")
    system.connect("it.x", "other.u", offset=1.0)
    found = described(attempt(system).error)
    assert used
    monkeypatch.setattr(compiled, "kernel", None)
    assert found == described(attempt(system).error)
    assert found[2] == 1.0


@pytest.mark.long
@pytest.mark.parametrize("algorithm", ["iterative", "adaptive"])
def test_who_hangs_is_waited_for_once(hostile, algorithm):
    """Where others have given their states back, too."""
    system = System(stop_time=4.0, step=0.5, algorithm=algorithm, tolerance=1e-2)
    for name, deed in (("other", ""), ("it", "forget hang 1")):
        system.add(name, hostile(mute=True), deed=deed, v=1.0)
    system.connect("other.x", "it.u")
    system.connect("it.x", "other.u", offset=1.0)
    tolerances = {f"{name}.calls": [1.0, 1e9] for name in system.instances}
    system.stepping = replace(system.stepping, tolerances=tolerances)
    system.instances["it"] = replace(system.instances["it"], isolate=True, step_timeout=4.0)
    begin = perf_counter()
    error = attempt(system).error
    assert 4.0 < perf_counter() - begin < 8.0
    assert "did not return from fmi2FreeFMUstate within 4 s" in str(error)


DEEDS = {14: ("step", "null"), 15: ("step", "hang"), 16: ("step", "exit"), 17: ("get", "null"), 18: ("set", "null")}
NAMES = {1: ("fmi{}Boolean", "fmiDoStep"), 3: ("fmi3{}UInt16", "fmi3DoStep")}


@pytest.mark.sample(6)
@pytest.mark.parametrize("version", [1, 3])
@pytest.mark.parametrize("mode", DEEDS)
def test_a_process_that_is_lost_by_an_fmu_of_another_version(both, lagging, version, mode):
    """The very call is named, though several are what sets or reads variables of one type of ours."""
    system = lagging(version, stop_time=8.0)
    system.instances["b"] = replace(system.instances["b"], isolate=True, step_timeout=1.0)
    system.instances["b"].start["mode"] = mode
    result = both(system)
    where, what = DEEDS[mode]
    values, step = NAMES[version]
    call = step if where == "step" else values.format(where.title())
    assert re.match(rf"b, t = 5 s: {ENDS[what].format(call)}", str(result.error))


def test_slow_is_not_hanging_and_what_was_forked_does_not_go_on(hostile):
    for deed in ("slow", "come_back"):
        system = System(stop_time=1.0, step=0.25)
        system.add("it", hostile(mute=True), deed=f"step {deed} 0.5")
        system = isolate(system, ["it"])
        assert run(system)["it.calls"][-1] == 4.0


# -------------------------------------------------------------------- what is repeated, refreshed and continued


def coupled(path, algorithm, mode=0, **how):
    """a and b of odd.c in a cycle, each with what the other gives, in every type; b does what its mode says."""
    system = System(**{"stop_time": 8.0, "step": 0.25, "algorithm": algorithm, "tolerance": 1e-3} | how)
    for name in ("a", "b"):
        system.add(name, path, v=0.5, u=1.0)
    system.connect("a.x", "b.u", scale=0.5)
    system.connect("b.x", "a.u", offset=1.0)
    system.connect("b.y", "a.v", scale=0.2)
    system.connect("b.n", "a.m")
    system.connect("a.off", "b.on")
    system.instances["b"].start["mode"] = mode
    return system


@pytest.mark.parametrize("isolated", [["all"], ["together"], ["b"]])
@pytest.mark.parametrize("how", [{}, {"extrapolation": 2}], ids=str)
@pytest.mark.parametrize("algorithm", ["iterative", "adaptive"])
def test_from_saved_states(apart, able, isolated, how, algorithm):
    assert apart(coupled(able, algorithm, stop_time=3.0, **how), *isolated).status == "completed"


STEPS = 1, 2, 3, 4, 5, 10, 23, 33, 40, 41, 42, 44, 63, 73
STATES = 103, 104, 113, 114, 123, 124
QUICK = ("gauss-seidel", 84), ("gauss-seidel", 92), ("iterative", 40), ("iterative", 103), ("iterative", 113)
QUICK += ("iterative", 123), ("adaptive", 5), ("adaptive", 104), ("adaptive", 113), ("adaptive", 124)
MODES = [("gauss-seidel", mode) for mode in (83, 84, 91, 92)]
MODES += [(algorithm, mode) for algorithm in ("iterative", "adaptive") for mode in (*STEPS, *STATES, 83, 84, 91, 92)]


@pytest.mark.parametrize(
    ("algorithm", "mode"),
    [pytest.param(*each, marks=[pytest.mark.long] * (each not in QUICK), id=f"{each[0]}-{each[1]}") for each in MODES],
)
def test_whatever_it_does_in_a_step_that_is_repeated(apart, able, mode, algorithm):
    """As above, and of derivatives and states."""
    result = apart(coupled(able, algorithm, mode, extrapolation=2 * (80 < mode < 100)), "b")
    assert 4.5 < result.time[-1] <= 8.0


THIRD = [(algorithm, mode) for algorithm in ("iterative", "adaptive") for mode in (0, 3, 6, 7, 8, 9, 11, 12, 13, 23)]
QUICK_3 = ("iterative", 0), ("iterative", 11), ("iterative", 13), ("adaptive", 0), ("adaptive", 8), ("adaptive", 11)


@pytest.mark.parametrize(
    ("algorithm", "mode"),
    [
        pytest.param(*each, marks=[pytest.mark.long] * (each not in QUICK_3), id=f"{each[0]}-{each[1]}")
        for each in THIRD
    ],
)
def test_fmi_3_in_a_step_that_is_repeated(apart, lagging, mode, algorithm):
    """Whatever it does there, steps that are cut short among it."""
    system = lagging(3, algorithm=algorithm, stop_time=6.0)
    system.instances["b"].start["mode"] = mode
    ends = {0: "completed", 6: "completed", 7: "completed", 8: "terminated", 11: "completed"}
    assert apart(system, "together" if mode in (0, 11) else "b").status == ends.get(mode, "failed")


@pytest.mark.parametrize("algorithm", ["iterative", "adaptive"])
def test_of_what_is_repeated_nobody_waits_long_in_the_loop(apart, able, algorithm, hurried):
    result = apart(coupled(able, algorithm, stop_time=1.0, extrapolation=1), "together")
    assert result.status == "completed"


@pytest.mark.parametrize(
    ("algorithm", "mode"),
    [
        *(("jacobi", mode) for mode in (0, 23, 33)),
        *(pytest.param(*each, marks=pytest.mark.long) for each in product(["gauss-seidel", "adaptive"], [0, 23, 33])),
    ],
)
def test_feed_through_is_refreshed(apart, able, mode, algorithm):
    """In a circle; set and read at the end of a step, which may fail."""
    system = coupled(able, algorithm, mode, refresh=True, tolerance=1e-2)
    system.connect("a.y", "b.v", scale=0.5)
    result = apart(system, "together")
    assert (result.status == "completed") == (mode == 0)
    assert result["b.y"][5:] == pytest.approx((result["b.x"] + 0.5 * result["a.y"])[5:], abs=1e-9)


@pytest.mark.parametrize("refused", [30, 31])
def test_a_state_that_cannot_be_saved(apart, species, refused):
    """At the begin of a step or at its end, before or after its neighbour's was saved."""
    path = species([], f"-DREFUSED={refused}")
    system = System(stop_time=1.0, step=0.05, algorithm="adaptive", tolerance=1e-4)
    system.add("prey", path, a=1.0, b=-0.1, start=20.0)
    system.add("predator", species([]), a=-0.4, b=0.02, start=5.0)
    system.connect("predator.y", "prey.u")
    system.connect("prey.y", "predator.u")
    assert "fmi2GetFMUstate failed" in str(apart(system, "prey").error)


@pytest.mark.parametrize("isolated", [[], ["together"]])
@pytest.mark.parametrize("algorithm", ["iterative", "adaptive"])
def test_states_are_given_back(used, species, isolated, algorithm):
    """At no time are there more than two of each instance."""
    system = System(stop_time=1.0, step=0.05, algorithm=algorithm, tolerance=1e-4)
    path = species([], counted=True)
    system.add("prey", path, a=1.0, b=-0.1, start=20.0)
    system.add("predator", path, a=-0.4, b=0.02, start=5.0)
    system.connect("predator.y", "prey.u")
    system.connect("prey.y", "predator.u")
    result = run(isolate(system, isolated))
    assert used
    assert len(result.time) > 20
    assert 1.0 <= result["prey.states"][2:].max() <= 4.0
