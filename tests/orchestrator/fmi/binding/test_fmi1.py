"""FMUs of FMI 1.0: read, set, stepped and read as those of 2.0 are."""

import math
from pathlib import Path

import fmpy
import pytest
from railcosim.orchestrator import System, run
from railcosim.orchestrator.cli.app import call
from railcosim.orchestrator.errors import FmuError, FmuFileError, ScenarioError
from railcosim.orchestrator.fmi.binding.fmi1 import Fmi1Slave
from railcosim.orchestrator.fmi.interface import Unit
from railcosim.orchestrator.fmi.models import load_fmu
from railcosim.orchestrator.run.checking import check

FOREIGN = Path(__file__).parents[2] / "foreign"
PART = 1.0 - math.exp(-0.25)


def begin(slave, stop=10.0, **reals):
    slave.setup(0.0, stop)
    if reals:
        slave.channel("Real", list(reals)).set(list(reals.values()))
    slave.enter_initialization()
    slave.exit_initialization()
    return slave


def reached(slave, mode):
    """An instance at t = 5 s, which then does what the mode says."""
    slave.channel("Integer", ["mode"]).set([mode])
    begin(slave)
    slave.channel("Real", ["u"]).set([3.0])
    slave.step(0.0, 5.0)
    return slave


# -------------------------------------------------------------------- the description


def test_what_is_read(by_hand, workspace):
    it = load_fmu(by_hand(1), workspace).interface
    of = it.variables
    assert (it.version, it.model, it.identifier, it.guid) == ("1.0", "First order", "First", "{1}")
    assert (it.description, it.generator, it.default_stop) == ("a lag", "by hand", 8.0)
    assert [v.name for v in it.of("input")] == ["u", "n", "gear", "on", "word"]
    assert [v.name for v in it.of("parameter")] == ["gain", "mode"]
    assert [v.name for v in it.of("calculatedParameter")] == ["twice"], "without a start value it depends on others"
    assert [v.name for v in it.of("local")] == ["same_x", "guess", "pi", "switch"]
    assert [of[n].start for n in ("u", "x", "n", "gear", "on", "word", "y")] == [0.0, 1.0, 0, 1, False, "", None]
    assert [of[n].type for n in ("u", "n", "gear", "on", "word")] == [
        "Real",
        "Integer",
        "Enumeration",
        "Boolean",
        "String",
    ]
    assert (of["u"].unit, of["u"].minimum, of["u"].maximum, of["u"].description) == ("m", -1000.0, 1000.0, "drives it")
    assert of["gear"].choices == (("low", 1), ("mid", 2), ("high", 3))
    assert [of[n].dependencies for n in ("x", "y", "m")] == [frozenset(), {"u"}, None]
    assert [n for n in of if of[n].negated] == ["minus_x", "neither"]
    assert [n for n in of if of[n].settable] == ["u", "x", "guess", "gain", "n", "gear", "mode", "on", "word"]
    assert (of["guess"].initial, of["m"].variability, of["gain"].variability) == ("approx", "discrete", "fixed")
    assert it.units == {"m": Unit("m", None)}, "1.0 does not say what a unit is in SI units"
    assert (it.variable_step, it.interpolates_inputs, it.single_instance, it.needs_tool) == (True, True, False, False)
    assert (it.can_save_state, it.can_serialize_state, it.directional_derivatives) == (False, False, False)
    assert it.warnings == ()


def test_model_exchange_is_refused(by_hand, workspace):
    path = by_hand(1, ("Implementation>", "Unknown>"))
    with pytest.raises(FmuFileError, match=r"first\.fmu has no co-simulation part \(it is a model-exchange FMU\)$"):
        load_fmu(path, workspace)


def test_an_fmu_that_needs_its_tool_is_run_with_a_note(by_hand, alone, workspace):
    """The library of an FMU for tool coupling is told which tool; ours by hand knows none."""
    coupled = [
        ("CoSimulation_StandAlone", "CoSimulation_Tool"),
        ('"/>\n    </Co', '"/><Model entryPoint="fmu://model.x" type="application/x-tool"/>\n    </Co'),
    ]
    path = by_hand(1, *coupled)
    system = System(stop_time=1.0, step=0.25)
    system.add("it", str(path))
    assert "First order says that it needs the tool it was made with (by hand)" in check(system, workspace).notes
    with pytest.raises(
        FmuError, match=r"^it: cannot be instantiated: it gives no instance\n    \[error\] not with"
    ) as no:
        alone(path)
    assert no.value.log == ["[error] not with {1} and application/x-tool"]


def test_describe(by_hand, capsys):
    assert call(["describe", str(by_hand(1))]) == 0
    told = capsys.readouterr().out
    assert "FMI: 1.0" in told
    assert "saves its state: no" in told
    assert "drives it" in told


# -------------------------------------------------------------------- an instance


def test_start_values_types_and_steps(by_hand, alone):
    it = begin(alone(by_hand(1)), gain=2.0, x=5.0)
    assert isinstance(it, Fmi1Slave)
    real, outputs = it.channel("Real", ["u"]), it.channel("Real", ["x", "y", "minus_x", "same_x"])
    assert outputs.get() == [5.0, 5.0, -5.0, 5.0], "outputs can be read before the first step"
    assert it.channel("Real", ["twice", "guess", "pi"]).get() == [4.0, 2.0, 3.0]
    real.set([1.0])
    assert outputs.get() == [5.0, 7.0, -5.0, 5.0], "and follow inputs, so that initial values can settle"
    it.channel("Integer", ["n"]).set([-7])
    it.channel("Enumeration", ["gear"]).set([3])
    it.channel("Boolean", ["on"]).set([0])
    it.channel("String", ["word"]).set(["zürich"])
    it.step(0.0, 0.25)
    assert it.time == 0.25
    assert outputs.get()[0] == pytest.approx(5.0 - 4.0 * PART, rel=1e-15)
    assert it.channel("Integer", ["m"]).get() == [-6]
    assert it.channel("Enumeration", ["shown"]).get() == [3]
    assert it.channel("Boolean", ["off", "neither", "off"]).get() == [1, 0, 1], "what is not zero is true, and that 1"
    assert it.channel("String", ["said"]).get() == ["zürich"]
    it.terminate()


def test_setting_a_negated_alias(by_hand, alone):
    it = begin(alone(by_hand(1)))
    it.channel("Real", ["minus_x", "u"]).set([4.0, 1.0])
    assert it.channel("Real", ["x"]).get() == [-4.0]


def test_derivatives_of_inputs(by_hand, alone):
    it = begin(alone(by_hand(1)))
    it.interpolate(["u"], [2], [0.5])
    assert it.channel("Real", ["u"]).get() == [200.5]


def test_what_the_standard_has_no_call_for(by_hand, alone):
    it = begin(alone(by_hand(1)))
    for attempt in (it.save, lambda: it.restore((0.0, None)), lambda: it.deserialize(bytes(8))):
        with pytest.raises(FmuError, match=r"^it, t = 0 s: it cannot (save|write) its state.* \(FMI 1\.0\)$"):
            attempt()
    with pytest.raises(FmuError, match=r"^it, t = 0 s: FMI 1\.0 knows no directional derivatives$"):
        it.directional_derivatives(["x"], ["u"], [1.0])


@pytest.mark.parametrize("status", ["discard", "error", "fatal", "pending", "-1 (unknown)"])
def test_a_step_that_fails_names_instance_time_call_and_status(by_hand, alone, status):
    number = {"discard": 2, "error": 3, "fatal": 4, "pending": 5}.get(status, 9)
    it = reached(alone(by_hand(1), "lag"), number)
    with pytest.raises(FmuError) as caught:
        it.step(5.0, 0.25)
    error = caught.value
    assert (error.instance, error.time, error.status) == ("lag", 5.0, status)
    what = {2: "discarded the step", 5: "fmiDoStep is pending: asynchronous FMUs are not supported"}
    assert str(error).startswith(f"lag, t = 5 s, status {status}: {what.get(number, 'fmiDoStep failed')}")
    label = status.partition(" ")[0]
    assert error.log == [f"[{label}] lag says: as it was told, {-1 if number == 9 else number}"]


def test_a_warning_is_none(by_hand, alone):
    it = reached(alone(by_hand(1)), 1)
    it.step(5.0, 0.25)
    assert it.time == 5.25
    assert list(it.log) == ["[warning] it says: as it was told, 1"]


@pytest.mark.parametrize("mode", [6, 7])
def test_a_discarded_step_is_taken_in_parts(by_hand, alone, mode):
    """One says how far it came, the other wants less, and to be told that this is a repetition."""
    it = reached(alone(by_hand(1)), mode)
    (x,) = it.channel("Real", ["x"]).get()
    it.step(5.0, 0.25)
    assert it.time == 5.25
    assert it.channel("Real", ["x"]).get()[0] == pytest.approx(3.0 + (x - 3.0) * math.exp(-0.25), rel=1e-12)


def test_a_reading_that_fails(by_hand, alone):
    it = reached(alone(by_hand(1)), 23)
    with pytest.raises(FmuError, match=r"^it, t = 5 s, status error: fmiGetReal failed\n.*it says: reading, 3$"):
        it.channel("Real", ["x"]).get()


def test_an_initialization_that_fails_ends_no_process(by_hand, alone, capfd):
    """FMPy would take the status for the address of a text."""
    it = alone(by_hand(1))
    it.channel("Integer", ["mode"]).set([40])
    with pytest.raises(FmuError, match=r"^it, t = 0 s, status error: fmiInitializeSlave failed\n"):
        begin(it)
    assert capfd.readouterr().out == "", "what it says is not printed"


def test_a_number_that_does_not_fit(by_hand, alone):
    it = begin(alone(by_hand(1)))
    with pytest.raises(FmuError, match=r"^it, t = 0 s: 'n' cannot become 2147483648: its type Integer holds -2"):
        it.channel("Integer", ["n"]).set([2**31])


def test_instances_have_their_own_logs(by_hand, alone):
    path = by_hand(1)
    first, second = reached(alone(path, "a"), 1), reached(alone(path, "b"), 0)
    first.step(5.0, 0.25)
    second.step(5.0, 0.25)
    assert (len(first.log), len(second.log)) == (1, 0)


def test_a_library_of_another_name(by_hand, alone):
    assert begin(alone(by_hand(1, library="other"))).channel("Real", ["x"]).get() == [1.0]


def test_functions_that_are_not_there_are_missed_when_they_are_called(by_hand, alone):
    it = begin(alone(by_hand(1)))
    it.functions.pop("fmiGetString")
    with pytest.raises(FmuError, match=r"^it, t = 0 s: its library has no function fmiGetString$"):
        it.channel("String", ["said"]).get()


def test_a_library_of_another_standard(by_hand, alone, compile_c, xml, tmp_path):
    files = {
        "modelDescription.xml": FOREIGN.joinpath("fmi1.xml").read_text(encoding="utf-8"),
        f"binaries/{fmpy.platform}/First{fmpy.sharedLibraryExtension}": compile_c("fmi3.c"),
    }
    path = xml["write_archive"](tmp_path / "mixed.fmu", files)
    with pytest.raises(
        FmuError, match=r"^it: cannot be instantiated: its library has no function fmiInstantiateSlave$"
    ):
        alone(path)


# -------------------------------------------------------------------- in a system


def test_a_wrong_start_value_is_told_before_the_run(by_hand):
    system = System(stop_time=1.0, step=0.25)
    system.add("it", str(by_hand(1)), u=2000.0, twice=1.0, gear=7)
    with pytest.raises(ScenarioError) as caught:
        run(system)
    told = str(caught.value)
    assert "it.u: 2000.0 is above the limit 1000 m" in told
    assert "it.twice: it is computed (causality calculatedParameter) and cannot be set" in told
    assert "it.gear: takes one of low (1), mid (2), high (3), not 7" in told


def test_a_run(by_hand, tmp_path):
    system = System(stop_time=2.0, step=0.25)
    system.add("it", str(by_hand(1)), u=3.0, x=1.0)
    result = run(system, output=tmp_path / "results", figures=False)
    assert result["it.x"][-1] == pytest.approx(3.0 - 2.0 * math.exp(-2.0), rel=1e-14)
    assert list(result["it.minus_x"]) == list(-result["it.x"])


@pytest.mark.parametrize("command", [["pack", "-o", "it.fmu"], ["linearize", "--at", "0.5"]])
def test_what_cannot_be_done_with_it_is_refused_in_a_sentence(by_hand, tmp_path, monkeypatch, capsys, command):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "one.toml").write_text(
        f'[simulation]\nstep = 0.25\nstop_time = 1.0\n[instances.it]\nfmu = "{by_hand(1)}"\n', encoding="utf-8"
    )
    assert call([command[0], "one.toml", *command[1:]]) == 2
    told = capsys.readouterr().err
    assert "it: First order" in told
    assert "Traceback" not in told
