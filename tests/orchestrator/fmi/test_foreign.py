"""FMUs that nobody here wrote: what the standard allows and few use, and files that lie, through the command line.

Of each: the message, the exit code, and what was saved.
"""

import json
import shutil
import subprocess
import sys
import time

import pytest
from railcosim.orchestrator.cli import app as cli
from railcosim.orchestrator.run.recording import Results

GCC = shutil.which("gcc")

pytestmark = pytest.mark.skipif(GCC is None or sys.platform != "linux", reason="compiles its FMUs with gcc")
BOTH_LOOPS = pytest.mark.usefixtures("loop")


# -------------------------------------------------------------------- what a step may return


@BOTH_LOOPS
@pytest.mark.parametrize(
    ("mode", "message"),
    [
        (2, "status discard: discarded the step, and takes none from there on, not even one of 4.8e-07 s"),
        (3, "status error: fmi2DoStep failed"),
        (4, "status fatal: fmi2DoStep failed"),
        (5, "status pending: fmi2DoStep is pending: asynchronous FMUs are not supported"),
        (6, "status 6 (unknown): fmi2DoStep failed"),
        (13, "status discard: discarded the step and does not say how far it got, so that nothing else can be tried"),
        (14, "status discard: discarded the step and does not say how far it got, so that nothing else can be tried"),
        (15, "status discard: discarded the step, and takes none from there on, not even one of 4.8e-07 s"),
        (16, "status discard: says that it got to t = 105.5 s in the step to t = 5.5 s"),
        (18, "status discard: discarded the step and does not say how far it got, so that nothing else can be tried"),
    ],
)
def test_a_step_that_fails(fmu, go, mode, message):
    found = go(fmu(), {"it": {"mode": mode, "u": 1.0, "longest": 0.1}})
    assert found.code == 3
    assert found.errors[0] == f"error: an FMU failed: it, t = 5 s, {message}"
    assert "it does as it was told" in found.errors[1]  # its own words, once however often it said them
    assert len(found.errors) == 2
    assert (found.record["status"], found.record["time_reached"]) == ("failed", 5.0)
    assert found.record["error"] == "\n".join(found.errors).removeprefix("error: an FMU failed: ")
    assert list(found.results.time) == [0.5 * k for k in range(11)]
    assert found.results["it.x"][-1] == 5.0


@BOTH_LOOPS
def test_a_warning_is_no_failure(fmu, go):
    found = go(fmu(), {"it": {"mode": 1, "u": 1.0}})
    assert (found.code, found.record["status"], found.results["it.x"][-1]) == (0, "completed", 10.0)


SAVES = 'canHandleVariableCommunicationStepSize="true" canGetAndSetFMUstate="true"'


@BOTH_LOOPS
@pytest.mark.parametrize(("mode", "isolate"), [(19, ()), (14, ()), (19, ("--isolate", "it"))])
def test_one_that_has_to_be_restored_after_a_discarded_step(fmu, go, mode, isolate):
    """Whether it says how far it would get or not; all of the run is there, and how it came about is told."""
    found = go(fmu(simulation=SAVES), {"it": {"mode": mode, "u": 1.0, "longest": 0.2}}, options=isolate)
    assert (found.code, found.record["status"]) == (0, "completed")
    assert list(found.results.time) == [0.5 * k for k in range(21)]
    assert found.results["it.x"] == pytest.approx(found.results.time, abs=1e-12)
    assert found.results["it.now"] == pytest.approx(found.results.time, abs=1e-12)
    told = found.record["coupling"]["rollback"]
    assert told["instances"] == ["it"]
    assert told["summary"] == "it discards steps, and is restored before it goes on: the run was begun anew for that"


@BOTH_LOOPS
@pytest.mark.parametrize(
    ("mode", "message"),
    [
        (2, "status discard: discarded the step, and takes none from there on, not even one of 4.8e-07 s"),
        (3, "status error: fmi2DoStep failed"),
        (4, "status fatal: fmi2DoStep failed"),
    ],
)
def test_to_be_restored_does_not_help_all(fmu, go, mode, message):
    found = go(fmu(simulation=SAVES), {"it": {"mode": mode, "u": 1.0}})
    assert (found.code, found.record["status"], found.record["time_reached"]) == (3, "failed", 5.0)
    assert found.errors[0] == f"error: an FMU failed: it, t = 5 s, {message}"
    assert list(found.results.time) == [0.5 * k for k in range(11)]
    assert ("rollback" in found.record["coupling"]) == (mode == 2)


@BOTH_LOOPS
@pytest.mark.parametrize(
    ("mode", "calls"),
    [
        (10, 21),  # once three fifths and the rest
        (11, 70),  # from t = 5 s on, 0.5 s in parts of at most 0.2 s
    ],
)
def test_a_discarded_step_is_taken_in_parts(fmu, go, mode, calls):
    found = go(fmu(), {"it": {"mode": mode, "u": 1.0, "longest": 0.2}})
    assert (found.code, found.record["status"]) == (0, "completed")
    assert (found.results["it.calls"][-1], len(found.results.time)) == (calls, 21)
    assert found.results["it.x"] == pytest.approx(found.results.time, abs=1e-12)
    assert found.results["it.now"] == pytest.approx(found.results.time, abs=1e-12)


@BOTH_LOOPS
def test_a_discarded_step_of_an_fmu_that_takes_one_length_only(fmu, go):
    found = go(fmu(simulation=""), {"it": {"mode": 11, "longest": 0.2}})
    what = "discarded the step, and takes steps of one length only: choose another step"
    assert (found.code, found.errors[0]) == (3, f"error: an FMU failed: it, t = 5 s, status discard: {what}")


@BOTH_LOOPS
@pytest.mark.parametrize(("start", "stop"), [(0.0, 0.3), (1e6, 1e6 + 0.7), (-0.3, 0.0)])
def test_the_last_step_is_not_past_the_end(fmu, go, start, stop):
    """0.2 + 0.1 is more than 0.3."""
    found = go(fmu(), {"it": {"mode": 50, "at": -1.0}}, start_time=start, stop_time=stop, step=0.1)
    assert (found.code, found.record["status"]) == (0, "completed")


@BOTH_LOOPS
@pytest.mark.parametrize(("mode", "at"), [(12, "5.25"), (17, "5")])
def test_an_fmu_that_asks_for_the_end(fmu, go, mode, at):
    found = go(fmu(), {"it": {"mode": mode, "u": 1.0}})
    assert (found.code, found.errors, found.record["status"]) == (0, [], "terminated")
    assert found.record["error"] == f"it, t = {at} s: asks for the end of the simulation"
    assert f"terminated at t = 5 s of 10 s: {found.record['error']}" in found.out
    assert found.results.time[-1] == 5.0


@BOTH_LOOPS
@pytest.mark.parametrize(
    ("mode", "ending"),
    [
        (0, ["step", "terminate", "free"]),
        (3, ["step", "step", "free"]),
        (4, ["step", "step"]),  # after a fatal status nothing may be called
        (5, ["step", "cancel", "free"]),  # a step under way has to be cancelled before its FMU is freed
    ],
)
def test_what_is_called_in_the_end(fmu, go, traced, mode, ending):
    go(fmu(), {"it": {"mode": mode}})
    calls = traced.read_text().split("\n")[:-1]
    assert calls[:4] == ["instantiate", "setup", "enter", "exit"]
    assert calls[-len(ending) :] == ending


@BOTH_LOOPS
@pytest.mark.parametrize(
    ("mode", "message", "reached"),
    [
        (20, "it, t = 5 s: output 'y' is nan", 4.5),
        (21, "it, t = 5 s: output 'y' is inf", 4.5),
        (22, "it, t = 5 s: output 'y' is -inf", 4.5),
        (103, "it, t = 5 s, status error: fmi2GetReal failed", 4.5),
        (203, "it, t = 5 s, status error: fmi2SetReal failed", 5.0),
        (303, "it, t = 10 s, status error: fmi2Terminate failed", 10.0),
        (503, "it, t = 0 s, status error: fmi2ExitInitializationMode failed", None),
    ],
)
def test_failures_elsewhere(fmu, go, mode, message, reached):
    path = fmu()
    found = go({"it": path, "source": path}, {"it": {"mode": mode}}, {"it.u": "source.x"})
    assert (found.code, found.errors[0]) == (3, f"error: an FMU failed: {message}")
    assert (found.record["status"], found.record["time_reached"]) == ("failed", reached)
    assert found.record["error"].startswith(message)
    if reached is not None:
        assert found.results.time[-1] == reached


CRASH = """
from railcosim.orchestrator.cli import app as cli
from railcosim.orchestrator.run.recording import recorder
recorder._FLUSH_SECONDS = 0.0
cli.main()
"""


@pytest.mark.parametrize(
    ("mode", "what"), [(30, "crashed (SIGSEGV)"), (31, "called exit(7), which would have ended the process")]
)
def test_an_fmu_that_ends_the_process(fmu, go, tmp_path, mode, what):
    """Without isolation the watching parent tells; what was on the disk by then can be used."""
    start = {"it": {"mode": mode, "u": 1.0}, "slow": {"mode": 40, "at": 0.0}}
    path = fmu()
    go({"it": path, "slow": path}, start, command="check", step=0.02)
    command = [sys.executable, "-c", CRASH, "run", str(tmp_path / "s.toml"), "-o", str(tmp_path / "out")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 3
    assert what in done.stderr
    loaded = Results.load(tmp_path / "out")
    assert not loaded.completed
    assert 1.0 < loaded.time[-1] <= 5.0
    assert loaded["it.x"] == pytest.approx(loaded.time)
    assert cli.call(["plot", str(tmp_path / "out"), "it.x"]) == 0
    assert list((tmp_path / "out").glob("*.png"))


# -------------------------------------------------------------------- variables


def test_every_type_goes_from_fmu_to_fmu(fmu, go):
    path = fmu("all")
    start = {"a": {"gear": "high", "m": 41, "on": True, "label": "zürich", "word": 'a,"b"'}, "b": {"gear": 3}}
    wires = {"b.gear": "a.next", "b.m": "a.n", "b.on": "a.off", "b.word": "a.said", "b.u": "a.n"}
    found = go({"a": path, "b": path}, start, wires, stop_time=1.0)
    assert found.code == 0
    last = {name: found.results[f"b.{name}"][-1] for name in ("next", "n", "off", "said", "y")}
    assert last == {"next": 3.0, "n": 43.0, "off": 1.0, "said": ' zürich a,"b"', "y": 84.0}


@pytest.mark.parametrize(("mode", "text"), [(23, 'a\rb\nc\r\n"'), (24, "")])
def test_texts_of_all_kinds_survive_the_file(fmu, go, mode, text):
    """Ends of lines of every kind, and none at all where the FMU gives no text."""
    found = go(fmu("all"), {"it": {"mode": mode, "at": 0.0}}, stop_time=1.0)
    assert (found.code, list(found.results["it.said"])) == (0, [text] * 3)


ODD = [
    "a.b",
    "a[1,2]",
    "a[1, 3]",
    "der(x)",
    "'q u o'",
    "sp ace",
    "zürich",
    'x"y',
    "p<&>",
    "b[1].c[2].d",
    "n" * 300,
    "{x}",
]


def test_odd_names(fmu, go, tmp_path, v):
    """In start values and connections as they are; in expressions between quotes."""
    inputs = [v(name, 100 + 2 * k, "input", start=0.0) for k, name in enumerate(ODD)]
    outputs = [v(f"out.{name}", 101 + 2 * k, "output") for k, name in enumerate(ODD)]
    path = fmu([*inputs, *outputs])
    start = {name: float(k) for k, name in enumerate(ODD)}
    quoted = {f"m{k:.0f}": f"max(signal('b.out.{name}'))" for name, k in start.items() if "'" not in name}
    metrics = "\n".join(f"{key} = {json.dumps(text)}" for key, text in quoted.items())
    wires = {f"b.{name}": f"a.out.{name}" for name in ODD}
    found = go({"a": path, "b": path}, {"a": start}, wires, more=f"[metrics]\n{metrics}\n")
    assert (found.code, found.errors) == (0, [])
    assert {name: found.results[f"b.out.{name}"][-1] for name in ODD} == start
    measured = json.loads((tmp_path / "out" / "metrics.json").read_text())["metrics"]
    assert {key: measured[key]["values"] for key in quoted} == {key: {"": float(key[1:])} for key in quoted}
    assert cli.call(["plot", str(tmp_path / "out"), 'signal("b.out.der(x)")']) == 0


def test_start_values(fmu, go, v, numbers):
    """What may be set is set; what is computed or constant may not, and says so."""
    variables = [
        *numbers,
        v("c", 100, "output", start=7.0, variability="constant"),
        v("guess", 102, "local", start=1.0, initial="approx", variability="fixed"),
        v("k", 104, "calculatedParameter", variability="fixed"),
    ]
    path = fmu(variables)
    found = go(path, {"it": {"x": 3.0, "gain": 5.0, "u": 1.0, "guess": 2.0}}, stop_time=1.0)
    assert (found.code, found.results["it.x"][-1], found.results["it.y"][-1]) == (0, 4.0, 5.0)
    assert found.record["parameters"]["it.gain"] == 5.0
    wrong = {"c": 1.0, "k": 1.0, "y": 1.0, "gear": 2, "m": 3e9, "on": 1, "nonsense": 0}
    found = go(path, {"it": wrong})
    assert (found.code, found.record) == (2, {})
    assert [error.partition(": it.")[2] for error in found.errors] == [
        "c: it is a constant of the model and cannot be set",
        "k: it is computed (causality calculatedParameter) and cannot be set",
        "y: it is computed (causality output) and cannot be set",
        "gear: takes one of low (1), high (3), not 2",
        "m: takes a whole number from -2147483648 to 2147483647, not 3000000000.0",
        "on: takes true or false, not 1",
        "nonsense: Foreign has no such variable",
    ]


def test_several_names_of_one_variable(fmu, go, v, numbers):
    variables = [*numbers, v("twin", 0, "input", start=0.0), v("image", 1, "output")]
    path = fmu(variables)
    found = go({"a": path, "b": path}, {"a": {"u": 3.0}}, {"b.twin": "a.image"}, stop_time=1.0)
    assert (found.code, found.results["b.y"][-1], found.results["b.image"][-1]) == (0, 12.0, 12.0)
    assert not any(note.startswith(("b.u ", "b.twin ")) for note in found.notes)
    found = go({"a": path, "b": path}, {}, {"b.u": "a.x", "b.twin": "a.image"}, command="check")
    what = "b.twin is another name of b.u, and they are fed by 'a.x' and by 'a.image': connect one of them"
    assert (found.code, found.errors[0].partition("toml:")[2][-len(what) :]) == (2, what)


def test_no_variables(fmu, go):
    found = go(fmu([]))
    assert (found.code, found.record["status"], len(found.results.time)) == (0, "completed", 21)
    assert list(found.results.names()) == []
    assert "Element 'ModelVariables'" in found.notes[0]


def test_no_word_on_dependencies(fmu, go):
    """No feed-through is assumed, and said; so the order of the instances has nothing to follow."""
    path = fmu()
    found = go({"a": path, "b": path}, {}, {"b.u": "a.y", "a.u": "b.y"}, command="check")
    assert found.code == 0
    assert "Foreign lists no dependencies of y, x, calls, now; no direct feed-through is assumed" in found.notes
    direct = (
        "<Outputs>" + "".join(f'<Unknown index="{k}" dependencies="{d}"/>' for k, d in ((2, 1), (4, ""))) + "</Outputs>"
    )
    found = go({"a": fmu(structure=direct), "b": path}, {}, {"b.u": "a.y"}, command="check")
    assert "gauss-seidel steps in the order: a, b" in found.out


def test_an_fmu_that_is_made_for_one_step(fmu, go):
    path = fmu(simulation="", more='<DefaultExperiment stepSize="0.2"/>')
    told = "Foreign cannot vary its step and is made for 0.2 s; it is stepped at 0.5 s"
    assert told in go(path, command="check").notes
    assert told not in go(path, command="check", step=0.4, stop_time=4.0).notes


# -------------------------------------------------------------------- many variables


@pytest.mark.long
def test_thousands_of_variables(fmu, go, v):
    """Reading, wiring, checking and recording take a time that grows with their number, not with its square."""
    count = 2500
    variables = [v(f"bus.s{k}.u", 100 + 2 * k, "input", start=0.0) for k in range(count)]
    variables += [v(f"bus.s{k}.y", 101 + 2 * k, "output", typed='unit="-"') for k in range(count)]
    unknowns = "".join(f'<Unknown index="{count + k}" dependencies="{k}"/>' for k in range(1, count + 1))
    path = fmu(variables, structure=f"<Outputs>{unknowns}</Outputs>")
    wires = {f"b.bus.s{k}.u": f"a.bus.s{k}.y" for k in range(count)}
    begin = time.process_time()
    found = go({"a": path, "b": path}, {"a": {"bus.s7.u": 3.0}}, wires, stop_time=1.0)
    taken = time.process_time() - begin
    assert (found.code, found.results["b.bus.s7.y"][-1]) == (0, 3.0)
    assert found.notes == [
        "a: 2499 inputs are not connected (bus.s0.u, bus.s1.u, bus.s2.u, bus.s3.u, ...); they keep their start values",
        f'{path}: The unit "-" of variable "bus.s0.y" (line 1) is not defined. (and 2499 more like it)',
    ]
    assert taken < 4.0
    begin = time.process_time()
    found = go({"a": path, "b": path}, {}, {x.replace(".u", ".w"): y for x, y in wires.items()}, command="check")
    assert (found.code, len(found.errors)) == (2, count)
    assert found.errors[0].endswith("Foreign (b) has no variable 'bus.s0.w'; did you mean 'bus.s0.u'?")
    assert time.process_time() - begin < 8.0
