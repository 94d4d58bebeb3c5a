"""team.c: several threads give what one gives, whatever FMUs do."""

import itertools
import shutil
import sys

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from railcosim.orchestrator.fmi.guard import watching
from railcosim.orchestrator.master import compiled
from railcosim.orchestrator.master.plans import plan
from railcosim.orchestrator.run.execution import execute, run
from railcosim.orchestrator.system import Event, System

GCC = shutil.which("gcc")
pytestmark = [
    pytest.mark.skipif(not getattr(compiled.kernel, "HAS_THREADS", 0), reason="no compiled step loop, or no threads"),
    pytest.mark.skipif(not sys.platform.startswith("linux"), reason="FMUs by hand are compiled for Linux here"),
    pytest.mark.skipif(GCC is None, reason="FMUs by hand need gcc"),
]


@pytest.mark.parametrize("threads", [2, 3, 5, 64])
def test_threads_give_the_same_bits(both, used, odd, ring, contents, *, threads):
    """Also with instances that step at their own rate, delays, and events; more threads than instances are not had."""
    system = ring(odd, 7, algorithm="jacobi")
    system.instances["odd[3]"].step = 0.5
    system.instances["odd[4]"].step = 2.5
    system.events = [
        Event("odd[2].x", "bias", at=2.0, value=0.5, duration=3.0),
        Event("odd[5].u", "ramp", at=1.0, rate=0.1),
        Event("odd[1].off", "override", at=4.0, value=True),
    ]
    alone = contents(run(system))
    used.clear()
    assert contents(both(system, threads=threads)) == alone
    parts = [len(arguments[1]) for arguments in used]
    assert set(parts) == {2 * min(threads, 7)}


@pytest.mark.parametrize("mode", [3, 4, 10, 23, 33])
def test_of_several_threads_that_fail_the_first_is_told(both, odd, mode, ring):
    """As it would be without threads: the first instance of those whose call comes first."""
    system = ring(odd, 6, algorithm="jacobi")
    for k in (2, 3, 5):
        system.instances[f"odd[{k}]"].start["mode"] = mode
    assert both(system, threads=3).error.instance == "odd[2]"
    system.instances["odd[5]"].start["mode"] = 33  # it is set before anyone is stepped, a step after others are read
    assert both(system, threads=3).error.instance == ("odd[5]" if mode in (3, 4) else "odd[2]")


@pytest.mark.skipif(watching.calls is None, reason="FMUs are not guarded here")
@pytest.mark.parametrize(("algorithm", "threads"), [("gauss-seidel", 1), ("jacobi", 1), ("jacobi", 3)])
def test_who_would_end_the_process_is_told(both, lag, algorithm, threads):
    """As if it had failed: the way back from its call leads into the loop, compiled or not, whoever takes the step."""
    system = System(step=0.1, stop_time=1.0, algorithm=algorithm)
    for name, code in {"a": "", "b": "if (t > 0.45) exit(7);", "c": "", "d": "if (t > 0.45) exit(8);"}.items():
        system.add(name, str(lag(name=f"{name}.fmu", on_step=code)))
    for source, target in itertools.pairwise("abcda"):
        system.connect(f"{source}.y", f"{target}.u")
    error = both(system, threads=threads).error
    assert str(error).startswith("b, t = 0.5 s: fmi2DoStep called exit(7), which would have")


# -------------------------------------------------------------------- whatever FMUs do

ABLE = "canHandleVariableCommunicationStepSize", "canGetAndSetFMUstate"
DEEDS = [*[0] * 6, 1, 2, 3, 4, 9, 10, 22, 23, 33, 40, 40, 41, 41, 42, 43, 44, 62, 73]
"""Modes of odd.c, the harmless ones and discarded steps more often than others."""
OUTPUTS, INPUTS = ["x", "y", "n", "off"], {"u": "Real", "v": "Real", "m": "Integer", "on": "Boolean"}
COUNT = st.integers(2, 7)


@st.composite
def systems(draw, count=COUNT):
    """Instances of odd.c with what they do from t = 5 s on, connected at random, some with steps of their own."""
    size = draw(count)
    system = System(stop_time=7.5, step=0.25, algorithm="jacobi", record=draw(st.sampled_from([0.25, 0.75])))
    for k in range(size):
        system.add(f"odd[{k}]", "odd.fmu", mode=draw(st.sampled_from(DEEDS)), u=0.1 * k, v=1.0)
        system.instances[f"odd[{k}]"].step = draw(st.sampled_from([None, None, None, 0.5, 1.5]))
        for target, kind in INPUTS.items():
            source = draw(st.sampled_from([None, *OUTPUTS]))
            source = None if (source, target) == ("y", "v") else source  # y depends on v at once: loops may not settle
            if source is not None:
                sender, how = draw(st.integers(0, size - 1)), {"delay": draw(st.integers(0, 2))}
                if kind == "Real":
                    how |= {"scale": draw(st.sampled_from([1.0, 0.3])), "offset": draw(st.sampled_from([0.0, 0.1]))}
                elif (source, target) not in (("n", "m"), ("off", "on")):
                    how["threshold"] = 0.5
                system.connect(f"odd[{sender}].{source}", f"odd[{k}].{target}", **how)
    for k in range(draw(st.integers(0, 2))):
        system.events.append(
            Event(f"odd[{k}].x", "bias", at=draw(st.sampled_from([1.0, 5.5])), value=0.5, duration=1.0)
        )
    return system


def told(system, contents, threads):
    """All that is told of a run."""
    found = execute(system, threads=threads)
    error = found.error and (str(found.error), found.error.instance, found.error.time, found.error.log)
    return found.status, error, found.coupling, found.notes, contents(found)


@pytest.fixture(scope="module")
def agree(odd_fmu, contents, tmp_path_factory):
    """Holds that a system gives the same with any number of threads, and with the loop in Python."""
    folder = tmp_path_factory.mktemp("threads")
    path = odd_fmu(folder, *ABLE)

    def hold(system):
        for instance in system.instances.values():
            instance.model = path
        alone = told(system, contents, 1)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(compiled, "kernel", None)
            assert told(system, contents, 1) == alone
        for threads in (2, 5):
            assert told(system, contents, threads) == alone
        return alone

    return hold


def doing(deeds):
    """Four instances by what they do; with two threads the first two share one."""
    system = System(stop_time=7.5, step=0.25, algorithm="jacobi")
    for k, deed in enumerate(deeds):
        system.add(f"odd[{k}]", "odd.fmu", mode=deed, u=0.1 * k, v=1.0)
        system.connect(f"odd[{k}].x", f"odd[{(k + 1) % len(deeds)}].v")
        system.connect(f"odd[{k}].n", f"odd[{(k + 1) % len(deeds)}].m")
    return system


def test_discarded_steps_are_taken_in_parts(agree):
    """Two in a thread, and one in each; all steps are there, and as exact as they are in parts."""
    for deeds in ([40, 41, 0, 0], [40, 41, 41, 0]):
        status, *_, (time, *_) = agree(doing(deeds))
        assert (status, len(time[1])) == ("completed", 31 * 8)


@pytest.mark.sample(4)
@pytest.mark.parametrize(
    ("deeds", "culprit", "what"),
    [
        ([40, 3, 2, 0], "odd[1]", "fmi2DoStep failed"),  # met when the first has been helped, after the third
        ([40, 41, 2, 3], "odd[2]", "discarded the step"),
        ([40, 41, 40, 3], "odd[3]", "fmi2DoStep failed"),
        ([40, 0, 40, 22], "odd[3]", "fmi2GetReal failed"),
        ([40, 0, 10, 22], "odd[2]", "output 'y' is nan"),
        ([3, 0, 0, 33], "odd[3]", "fmi2SetReal failed"),
        ([40, 0, 62, 22], "odd[2]", "fmi2GetInteger failed"),
        ([0, 3, 73, 33], "odd[2]", "fmi2SetInteger failed"),
        ([40, 42, 3, 0], "odd[1]", "asks for the end"),
        ([40, 3, 42, 0], "odd[1]", "fmi2DoStep failed"),
    ],
)
def test_of_failures_and_discarded_steps_the_first_is_told(agree, deeds, culprit, what):
    status, error, *_ = agree(doing(deeds))
    assert status == ("terminated" if 42 in deeds[:2] else "failed")
    assert error[1] == culprit
    assert what in error[0]


@pytest.mark.parametrize("call", [0, 20, 30, 60, 70])
def test_who_was_fatal_is_not_given_back_though_another_is_told(agree, call):
    """odd.c aborts where it is, and that would be told; alone, the last two have not got there yet."""
    _, error, _, notes, _ = agree(doing([0, call + 3, call + 4, call + 4]))
    assert (error[1], notes) == ("odd[1]", [])


def test_of_those_who_leave_their_calls_at_once_nobody_is_given_back(contents, lag):
    """All of them at t = 0.5 s, where there are three threads; given back after that, each leaves that call, too."""
    system = System(step=0.1, stop_time=1.0, algorithm="jacobi")
    for k in range(3):
        code = {"on_step": f"if (t > 0.45) exit({k + 1});", "on_free": "if (M->t > 0.35) exit(9);"}
        system.add(f"lag[{k}]", str(lag(name=f"{k}.fmu", **code)))
    alone, together = (told(system, contents, threads) for threads in (1, 3))
    assert together[1] == alone[1]
    assert "fmi2DoStep called exit(1)" in together[1][0]
    assert len(alone[3]) == 2  # those who have not left a call say so as they are given back
    assert together[3] == []


def test_whom_it_takes_to_be_restored(agree):
    """Two of them: the run begins anew twice."""
    status, error, coupling, *_ = agree(doing([43, 40, 0, 43]))
    assert (status, error, coupling["rollback"]["instances"]) == ("completed", None, ["odd[0]", "odd[3]"])


def test_everyone_who_changes_how_numbers_are_rounded_is_told(agree):
    """And changes those of nobody else, of the same FMU or in the same thread."""
    status, _, _, notes, found = agree(doing([44, 0, 44, 0]))
    assert [note.partition(" ")[0] for note in notes if "rounding" in note] == ["odd[0]", "odd[2]"]
    assert (status, found) == ("completed", agree(doing([0, 0, 0, 0]))[-1])
    notes = agree(doing([44, 3, 44, 0]))[3]  # the third steps only where there are threads
    assert [note.partition(" ")[0] for note in notes] == ["odd[0]"]


def test_like_calls_of_unwatched_instances_are_made_in_one(agree, monkeypatch):
    """Also where one of them discards its step in the midst; what is due at other times, or of others, stands apart."""
    monkeypatch.setattr(plan, "is_watched", lambda slave: False)
    system = doing([0, 40, 0, 40, 41, 0, 0, 0])
    for k, step in enumerate([0.5, None, 0.5, 1.5]):
        system.instances[f"odd[{4 + k}]"].step = step
    system.connect("odd[1].x", "odd[0].u")
    system.connections = [x for x in system.connections if x.target != "odd[0].v"]
    assert agree(system)[0] == "completed"


@settings(max_examples=5, deadline=None)
@given(system=systems())
def test_random_systems(agree, system):
    agree(system)


@pytest.mark.parametrize(
    "examples", [pytest.param(60, marks=pytest.mark.long), pytest.param(500, marks=pytest.mark.campaign)]
)
def test_many_random_systems(agree, examples):
    @settings(max_examples=examples, deadline=None)
    @given(system=systems(st.integers(2, 12)))
    def rule(system):
        agree(system)

    rule()
