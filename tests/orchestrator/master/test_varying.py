"""Steps of varying length, compiled: the same bits as in Python, whatever happens on the way."""

import sys
from types import SimpleNamespace

import numpy as np
import pytest
from railcosim.orchestrator.master import compiled, varying
from railcosim.orchestrator.system import Connection, Event, System

pytestmark = [
    pytest.mark.skipif(compiled.kernel is None, reason="installed without the compiled step loop"),
    pytest.mark.skipif(not sys.platform.startswith("linux"), reason="FMUs by hand are compiled for Linux here"),
]

TEXTS = (
    ('<String name="said" valueReference="111" causality="output"/>', ""),
    ('<Binary name="blob" valueReference="121" causality="output"/>', ""),
    *((f'    <{kind} valueReference="{k}"/>\n', "") for kind in ("Output", "InitialUnknown") for k in (111, 121)),
)
"""What takes from the FMU of fmi3.c the outputs that are no numbers."""


def couple(fmu, stop=4.0, **how):
    """A predator and its prey: each with what a, b and start are."""
    it = System(**{"stop_time": stop, "step": 1.0, "algorithm": "adaptive", "tolerance": 1e-4} | how)
    it.add("prey", fmu, a=1.0, b=-0.1, start=20.0)
    it.add("predator", fmu, a=-0.4, b=0.02, start=5.0)
    it.connect("predator.y", "prey.u")
    it.connect("prey.y", "predator.u")
    return it


@pytest.mark.parametrize("on", [[], ["u"]])
def test_steps_are_as_long_as_in_python(both, used, species, on):
    """With outputs that may show inputs, and without."""
    result = both(couple(species(on)))
    told = result.coupling["adaptive"]
    assert told["accepted"] == len(result.time) - 1 > 100
    assert told["rejected"] > 0
    assert len(used) < 10


GOES_ON = 40, 43, 44, 83, 91
MODES = 2, 3, 4, 5, 9, 10, 23, 30 + 3, 40, 42, 43, 44, 63, 73, 83, 84, 91, 102, 103, 104, 113, 114, 123, 124


@pytest.mark.sample(16)
@pytest.mark.parametrize("mode", MODES)
def test_an_fmu_that_does_as_it_is_told(both, able, mode):
    """From 5 s on it fails in one way or another: it may be tried again in a shorter step, or not."""
    result = both(odds(able, mode, extrapolation=int(mode > 80)), log=False)
    assert (result.status == "completed") == (mode in GOES_ON)
    assert 4.5 < result.time[-1] <= 8.0


def odds(able, mode=0, **how):
    """a and b of odd.c, each with what the other gives, in every type."""
    system = System(**{"stop_time": 8.0, "step": 0.25, "algorithm": "adaptive", "tolerance": 1e-3} | how)
    for name in ("a", "b"):
        system.add(name, able, v=0.5, u=1.0)
    system.connect("a.x", "b.u", scale=0.5)
    system.connect("b.x", "a.u", offset=1.0)
    system.connect("b.y", "a.v", scale=0.2)
    system.connect("b.n", "a.m")
    system.connect("a.off", "b.on")
    system.instances["b"].start["mode"] = mode
    return system


EVENTS = (
    Event("b.x", "bias", at=1.1, value=0.3, duration=1.7),
    Event("a.u", "ramp", at=2.03, rate=0.1, duration=1.0),
    Event("b.y", "ramp", at=2.5, rate=-0.2),
    Event("a.off", "freeze", at=3.0, duration=0.5),
)


@pytest.mark.parametrize("record", [None, 0.3])
@pytest.mark.parametrize("how", [{}, {"refresh": True}, {"extrapolation": 2}], ids=str)
def test_events(both, able, how, record):
    """Landed on; what they change of inputs is shown again as it was."""
    result = both(odds(able, events=[*EVENTS], record=record, **how))
    assert result.status == "completed"
    if record is None:
        assert {1.1, 2.03, 3.0} <= set(result.time.tolist())


def test_an_input_that_follows_another_output(both, able):
    system = odds(able, events=[Event("a.u", "connect", at=2.0, duration=3.0, source=Connection("b.y", "a.u"))])
    assert both(system).status == "completed"


def test_a_circle_of_feed_through(both, able):
    """y of both is x + v, and v the other's y."""
    system = odds(able, refresh=True, tolerance=1e-2)
    system.connect("a.y", "b.v", scale=0.5)
    result = both(system)
    assert result.status == "completed"
    assert result["b.y"][5:] == pytest.approx((result["b.x"] + 0.5 * result["a.y"])[5:], abs=1e-9)


@pytest.mark.parametrize("extrapolation", [0, 1])
def test_jumps(both, mine, extrapolation):
    """Each is passed in a shortest step, in the compiled loop as well; what went on before is none of it."""
    system = System(stop_time=4.0, step=1.0, algorithm="adaptive", tolerance=1e-9, extrapolation=extrapolation)
    for k, at in enumerate((0.6, 1.3, 2.2)):
        system.add(f"wall{k}", mine("Wall"), at=at)
        system.add(f"sum{k}", mine("Integral"))
        system.connect(f"wall{k}.y", f"sum{k}.u")
    told = both(system, kind="native").coupling["adaptive"]
    assert [jump["signal"] for jump in told["first_jumps"]] == ["sum0.x", "sum1.x", "sum2.x"]


def test_an_error_beyond_all_numbers(both, able):
    """Over 4 s b.x is 1.6e308 in a whole step and -1.6e308 in two halves: further apart than there are numbers."""
    system = System(stop_time=4.0, step=4.0, algorithm="adaptive", tolerance=1e-2)
    system.add("a", able, u=1.0)
    system.add("b", able)
    system.connect("a.x", "b.u", scale=-4e307, offset=4e307)
    assert both(system).coupling["adaptive"]["rejected"] > 0


def test_a_tolerance_that_cannot_be_kept(both, species):
    """A shortest step of its own; and a solver whose error does not become less: eight such steps in a row, no more."""
    system = couple(species([]), tolerances={"prey.y": [0.0, 1e-7]}, min_step=0.05)
    assert "prey.y cannot be kept within its tolerance" in str(both(system).error)
    rough = both(couple(species([], "-DROUGH"), tolerance=1e-9))
    assert rough.error is not None
    assert rough.coupling["adaptive"]["jumps"] == 8


def test_at_calendar_times(both, mine):
    begin = 1.7e9
    system = System(start_time=begin, stop_time=begin + 0.4, step=0.1, algorithm="adaptive", tolerance=1e-12)
    system.add("wall", mine("Wall"), at=begin + 0.13)
    system.add("sum", mine("Integral"))
    system.connect("wall.y", "sum.u")
    assert both(system, kind="native").coupling["adaptive"]["jumps"] == 1


@pytest.mark.parametrize(("record", "after"), [(None, 3), (0.5, 3), (None, 1)])
def test_an_observer_ends_a_run(species, instantiated, record, after):
    """Where it says so, with the values of that point; the first step is taken in Python."""
    master, seen = instantiated(couple(species(["u"]))), []

    def observe(steps, rows):
        seen.append((steps, master.time, list(master.values), [*rows]))
        master.rescue()
        return len(seen) < after

    master.coupling.time, master._stop_time = 0.0, 4.0
    assert not master.run(0.0, 1.0, 4, 0.0 if record is None else record, observe)
    assert len(seen) == after
    assert master.steps == seen[-1][0]
    if record is None:
        assert list(seen[-1][3][-1]) == [master.time, *master.values]


@pytest.mark.parametrize("record", [None, 0.1])
def test_an_fmu_that_would_end_the_process(both, lag, lag_description, record):
    """It is not tried again; the last row is that of the begin of its step."""
    text = lag_description.replace("modelIdentifier=", 'canHandleVariableCommunicationStepSize="true" modelIdentifier=')
    system = System(stop_time=1.0, step=0.1, algorithm="adaptive", tolerance=1e-2, record=record)
    system.add("good", str(lag(text, name="good.fmu")))
    system.add(
        "bad", str(lag(text, name="bad.fmu", options=["-include", "stdlib.h"], on_step="if (t > 0.45) exit(0);"))
    )
    system.connect("good.y", "bad.u")
    assert "fmi2DoStep called exit(0), which would have ended the process" in str(both(system).error)


@pytest.mark.parametrize("mode", [0, 3, 6, 8, 12, 23])
def test_of_fmi_3(both, by_hand, mode):
    """y is gain * u, so that inputs are shown again; numbers of 64 bits that no double is pass as they are."""
    third = str(by_hand(3, *TEXTS))
    system = System(stop_time=6.0, step=0.25, algorithm="adaptive", tolerance=1e-3)
    system.add("a", third, mode=mode, i64=2**60 + 1)
    system.add("b", third)
    system.connect("a.x", "b.u", scale=0.5)
    system.connect("b.y", "a.u", scale=-1.0, offset=2.0)
    system.connect("a.o64", "b.i64")
    system.connect("b.o32", "a.ui64", scale=1.0)
    system.connect("b.x", "a.i16", threshold=0.5)
    result = both(system, log=False)
    assert result.status == {0: "completed", 6: "completed", 8: "terminated"}.get(mode, "failed")
    assert result.time[-1] > 4.5
    assert result["b.o64"][-1] == 2.0**60


@pytest.mark.parametrize("record", [0.0, 0.5])
def test_rows_of_a_block_that_does_not_return(species, instantiated, monkeypatch, record):
    """They are told from another thread, but those that are not due; here each block's are, before it returns."""
    master, seen = instantiated(couple(species(["u"]))), []
    master._stop_time = 4.0
    run = compiled.kernel.run

    def while_it_runs(*arguments):
        with monkeypatch.context() as patch:
            patch.setattr(varying, "NOTES", SimpleNamespace(note=lambda number: (0, 0, 0.0, 0)))
            master.rescue()  # of which there is none yet
        found = run(*arguments)
        before = master.steps, master.time, *master.values
        master.rescue()
        master.coupling.steps, master.coupling.time, *master.values[:] = before
        return found

    master.rescue()
    monkeypatch.setattr(compiled, "kernel", SimpleNamespace(run=while_it_runs))
    assert master.run(0.0, 1.0, 4, record, lambda steps, rows: seen.append((steps, np.array(rows))) or True)
    master.rescue()
    steps = [count for count, _ in seen]
    assert len(seen) > 3
    assert steps[-1] == master.steps
    if record:
        assert {row[0] for _, rows in seen for row in rows} == {0.5 * k for k in range(1, 9)}
    else:
        assert steps[-1] == steps[-2]
        assert np.array_equal(seen[-1][1], seen[-2][1])
