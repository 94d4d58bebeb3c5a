"""FMUs of FMI 3.0: what is read of a description, and an instance."""

import math
import struct
from pathlib import Path

import fmpy
import pytest
from railcosim.orchestrator import System, run
from railcosim.orchestrator.cli.app import call
from railcosim.orchestrator.errors import FmuError, FmuFileError, ScenarioError, StoppedError
from railcosim.orchestrator.fmi.binding.fmi3 import Fmi3Slave
from railcosim.orchestrator.fmi.interface import Unit
from railcosim.orchestrator.fmi.models import load_fmu

FOREIGN = Path(__file__).parents[2] / "foreign"
PART = 1.0 - math.exp(-0.25)
WHOLE = {
    "8": (-(2**7), 2**7 - 1),
    "16": (-(2**15), 2**15 - 1),
    "32": (-(2**31), 2**31 - 1),
    "64": (-(2**63), 2**63 - 1),
}
LEFT_OUT = {"tick": "a clock", "sampled": "clocked by tick"}


def begin(slave, stop=10.0):
    slave.setup(0.0, stop)
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
    it = load_fmu(by_hand(3), workspace).interface
    of = it.variables
    assert (it.version, it.model, it.identifier, it.guid, it.default_step) == ("3.0", "Third", "Third", "{3}", 0.25)
    assert {v.fmi_type: v.type for v in of.values()} == {
        "Float64": "Real",
        "Float32": "Real",
        **{f"{sign}Int{bits}": "Integer" for sign in ("", "U") for bits in WHOLE},
        "Enumeration": "Enumeration",
        "Boolean": "Boolean",
        "String": "String",
        "Binary": "String",
    }
    assert [v.name for v in it.of("parameter")] == ["gain", "mode"]
    assert [v.name for v in it.of("structuralParameter")] == ["size"]
    assert [v.name for v in it.of("independent")] == ["time"]
    assert [of[n].start for n in ("u", "i8", "ui8", "on", "word", "gear", "y")] == [0.0, -128, 7, False, "", 1, None]
    assert (of["u"].unit, of["u"].minimum, of["u"].maximum, of["u"].description) == ("m", -1000.0, 1000.0, "drives it")
    assert (of["ui8"].minimum, of["ui8"].maximum) == (5.0, 200.0)
    assert of["gear"].choices == (("low", 1), ("mid", 2), ("high", 5_000_000_000))
    assert [of[n].dependencies for n in ("x", "y", "g")] == [frozenset(), {"u", "x"}, None]
    assert (of["der(x)"].derivative, of["x"].derivative) == ("x", None)
    assert it.units["km"] == Unit("km", (0, 1, 0, 0, 0, 0, 0, 0), 1000.0, 0.0)
    assert (of["rise"].unit, of["rise"].relative, of["x"].relative) == ("K", True, False)
    assert (it.can_save_state, it.can_serialize_state, it.directional_derivatives) == (True, True, True)
    assert (it.variable_step, it.interpolates_inputs) == (True, False)
    assert [of["size"].settable, of["mode"].settable, of["x"].settable, of["y"].settable] == [False, True, True, False]


def test_another_name_of_a_variable(by_hand, workspace):
    of = load_fmu(by_hand(3), workspace).interface.variables
    assert (of["position"].reference, of["position"].causality) == (of["x"].reference, "local"), "no second output"
    assert of["position"].description == "where it is (another name of x)"
    assert (of["factor"].settable, of["factor"].reference) == (True, of["gain"].reference)


def test_what_is_not_supported_is_left_out_and_named(by_hand, workspace):
    it = load_fmu(by_hand(3), workspace).interface
    assert it.left_out == LEFT_OUT
    assert not set(LEFT_OUT) & set(it.variables)
    (warning,) = it.warnings
    assert warning.endswith(
        "third.fmu: variables of kinds that are not supported are left out: tick (a clock), sampled (clocked by tick)"
    )


def test_of_many_some_are_named(by_hand, workspace):
    clocks = "".join(f'<Clock name="c{k}" valueReference="{200 + k}" causality="input"/>' for k in range(20))
    path = by_hand(3, ("</ModelVariables>", f"{clocks}</ModelVariables>"))
    told = load_fmu(path, workspace).interface.warnings[-1]
    assert told.endswith("c7 (a clock), and 12 more")


def test_using_what_is_left_out_says_why_it_is_not_there(by_hand):
    system = System(stop_time=1.0, step=0.25)
    system.add("a", str(by_hand(3)), sampled=1.0)
    system.add("b", str(by_hand(3)))
    system.connect("a.x", "b.sampled")
    system.connect("a.tick", "b.u")
    with pytest.raises(ScenarioError) as caught:
        run(system)
    why = "which is not supported"
    assert [line for line in str(caught.value).splitlines() if why in line] == [
        f"a.sampled: Third has no such variable: in the FMU it is clocked by tick, {why}",
        f"'b.sampled' = 'a.x': Third (b) has no variable 'sampled': in the FMU it is clocked by tick, {why}",
        f"'b.u' = 'a.tick': Third (a) has no variable 'tick': in the FMU it is a clock, {why}",
    ]


@pytest.mark.parametrize(
    ("part", "kind"), [("ModelExchange", "a model-exchange FMU"), ("ScheduledExecution", "an FMU ")]
)
def test_what_is_not_for_co_simulation_is_refused(by_hand, workspace, part, kind):
    path = by_hand(3, ("<CoSimulation", f"<{part}"))
    with pytest.raises(FmuFileError, match=rf"third\.fmu has no co-simulation part \(it is {kind}"):
        load_fmu(path, workspace)


@pytest.mark.parametrize("version", ["3.0.2", "3.1"])
def test_later_versions_are_read_alike(by_hand, workspace, version):
    path = by_hand(3, ('fmiVersion="3.0"', f'fmiVersion="{version}"'))
    assert load_fmu(path, workspace).interface.version == "3.0"


def test_describe(by_hand, capsys):
    assert call(["describe", str(by_hand(3))]) == 0
    told = capsys.readouterr().out
    assert "FMI: 3.0" in told
    assert "saves its state: yes" in told
    assert "left out: tick (a clock)" in told
    assert "Structural parameters" in told
    assert "UInt64" in told, "whole numbers are not all alike"


# -------------------------------------------------------------------- an instance


def test_start_values_and_steps(by_hand, alone):
    it = alone(by_hand(3))
    assert isinstance(it, Fmi3Slave)
    it.channel("Real", ["gain", "x"]).set([2.0, 5.0])
    it.setup(1.0, 10.0)
    it.enter_initialization()
    outputs = it.channel("Real", ["x", "y", "position", "time"])
    it.channel("Real", ["u"]).set([1.0])
    assert outputs.get() == [5.0, 7.0, 5.0, 1.0]
    it.exit_initialization()
    it.step(1.0, 0.25)
    assert it.time == 1.25
    assert outputs.get()[0] == pytest.approx(5.0 - 4.0 * PART, rel=1e-15)
    it.terminate()


@pytest.mark.parametrize("bits", WHOLE)
def test_whole_numbers_up_to_their_limits(by_hand, alone, bits):
    it = begin(alone(by_hand(3)))
    for sign, (low, high) in {"": WHOLE[bits], "u": (0, 2 ** int(bits) - 1)}.items():
        given, found = it.channel("Integer", [f"{sign}i{bits}"]), it.channel("Integer", [f"{sign}o{bits}"])
        for value in (low, high):
            given.set([value])
            it.step(it.time, 0.25)
            assert found.get() == [value]
        for value in (low - 1, high + 1):
            with pytest.raises(FmuError, match=rf"'{sign}i{bits}' cannot become {value}: its type U?Int{bits} holds"):
                given.set([value])


def test_variables_of_several_types_together(by_hand, alone):
    it = begin(alone(by_hand(3)))
    it.channel("Real", ["f", "u"]).set([0.1, 3.0])
    it.channel("Integer", ["ui8", "i64", "i8"]).set([200, 2**62, -3])
    it.channel("Enumeration", ["gear"]).set([5_000_000_000])
    it.channel("Boolean", ["on"]).set([1])
    it.channel("String", ["word"]).set(["zürich"])
    it.step(0.0, 0.25)
    x, g, again = it.channel("Real", ["x", "g", "x"]).get()
    assert g == struct.unpack("f", struct.pack("f", 0.1))[0], "Float32 keeps 24 bits"
    assert x == again == pytest.approx(3.0 - 2.0 * (1.0 - PART), rel=1e-15)
    assert it.channel("Integer", ["o8", "o64", "uo8"]).get() == [-3, 2**62, 200]
    assert it.channel("Enumeration", ["shown"]).get() == [5_000_000_000]
    assert it.channel("Boolean", ["off", "on"]).get() == [0, 1]
    assert type(it.channel("Boolean", ["on"]).get()[0]) is int
    assert it.channel("String", ["said", "word"]).get() == ["zürich", "zürich"]


def test_resources_are_named_where_there_are_any(by_hand, alone, xml, tmp_path):
    assert begin(alone(by_hand(3))).channel("String", ["said"]).get() == [""], "a null pointer where there are none"


def test_states_are_saved_restored_and_serialized(by_hand, alone):
    path = by_hand(3)
    it, other = begin(alone(path, "a")), begin(alone(path, "b"))
    x = it.channel("Real", ["x"])
    it.channel("Real", ["u"]).set([3.0])
    it.step(0.0, 0.25, final=False)
    saved, then = it.save(), x.get()
    it.step(0.25, 0.25, final=False)
    later = x.get()
    it.restore(saved)
    assert (x.get(), it.time) == (then, 0.25)
    it.step(0.25, 0.25)
    assert x.get() == later
    content = it.serialize(saved)
    it.forget(saved)
    state = other.deserialize(content)
    other.restore(state)
    other.forget(state)
    assert (other.channel("Real", ["x"]).get(), other.time) == (then, 0.25)
    with pytest.raises(FmuError, match=r"^b, t = 0.25 s: these bytes are no saved state$"):
        other.deserialize(b"1234567")
    with pytest.raises(FmuError, match=r"^b, t = 0.25 s, status error: fmi3DeserializeFMUState failed\n.*another size"):
        other.deserialize(content[:-1])


def test_an_fmu_that_does_not_save_its_state(by_hand, alone):
    it = begin(alone(by_hand(3, ("canGetAndSetFMUState", "canNot"), ("canSerializeFMUState", "canNotEither"))))
    with pytest.raises(FmuError, match=r"^it, t = 0 s: it cannot save its state \(FMI 3\.0\)$"):
        it.save()


def test_directional_derivatives(by_hand, alone):
    it = begin(alone(by_hand(3)))
    assert it.directional_derivatives(["y", "der(x)"], ["u", "x"], [2.0, 3.0]) == [5.0, -1.0]


def test_derivatives_of_inputs_are_not_taken(by_hand, alone):
    it = begin(alone(by_hand(3)))
    with pytest.raises(FmuError, match=r"^it, t = 0 s: FMI 3\.0 takes no derivatives of inputs$"):
        it.interpolate(["u"], [1], [0.5])


@pytest.mark.parametrize("status", ["error", "fatal", "-1 (unknown)"])
def test_a_step_that_fails_names_instance_time_call_and_status(by_hand, alone, capfd, status):
    number = {"error": 3, "fatal": 4}.get(status, 9)
    it = reached(alone(by_hand(3), "lag"), number)
    with pytest.raises(FmuError) as caught:
        it.step(5.0, 0.25)
    error, label = caught.value, status.partition(" ")[0]
    assert (error.instance, error.time, error.status) == ("lag", 5.0, status)
    assert str(error) == (f"lag, t = 5 s, status {status}: fmi3DoStep failed\n    [{label}] as it was told, 100 %")
    assert capfd.readouterr().out == "", "what it says is not printed"


@pytest.mark.parametrize("mode", [6, 7, 11])
def test_a_step_that_ends_early_is_taken_in_parts(by_hand, alone, mode):
    """Discarded at some time, refused as too long, or returned from early though that was not offered."""
    it = reached(alone(by_hand(3)), mode)
    (x,) = it.channel("Real", ["x"]).get()
    it.step(5.0, 0.25)
    assert it.time == 5.25
    assert it.channel("Real", ["x"]).get()[0] == pytest.approx(3.0 + (x - 3.0) * math.exp(-0.25), rel=1e-5)


def test_an_fmu_of_fixed_steps_is_not_asked_for_parts(by_hand, alone):
    path = by_hand(3, ("canHandleVariableCommunicationStepSize", "cannot"))
    it = reached(alone(path), 7)
    with pytest.raises(FmuError, match=r"^it, t = 5 s, status discard: discarded the step"):
        it.step(5.0, 0.25)


def test_it_may_ask_for_the_end(by_hand, alone):
    it = reached(alone(by_hand(3)), 8)
    with pytest.raises(StoppedError, match=r"^it, t = 5\.125 s: asks for the end of the simulation$"):
        it.step(5.0, 0.25)


def test_an_initialization_that_fails(by_hand, alone):
    it = alone(by_hand(3))
    it.channel("Integer", ["mode"]).set([40])
    with pytest.raises(
        FmuError, match=r"^it, t = 0 s, status error: fmi3EnterInitializationMode failed\n.*no initialization$"
    ):
        begin(it)


def test_an_fmu_that_gives_no_instance(by_hand, alone):
    with pytest.raises(FmuError, match=r"^it: cannot be instantiated: it gives no instance\n.*another token") as caught:
        alone(by_hand(3, ('instantiationToken="{3}"', 'instantiationToken="{4}"')))
    assert set(caught.value.log) == {"[error] another token, or what was not offered, 100 %"}


def test_a_library_of_another_name_or_in_the_folder_of_fmi_2(by_hand, alone, compile_c, xml, tmp_path):
    assert begin(alone(by_hand(3, library="other"))).channel("Real", ["x"]).get() == [1.0]
    text = FOREIGN.joinpath("fmi3.xml").read_text(encoding="utf-8")
    for platform in (fmpy.platform, "amiga"):
        files = {
            "modelDescription.xml": text,
            f"binaries/{platform}/Third{fmpy.sharedLibraryExtension}": compile_c("fmi3.c"),
        }
        path = xml["write_archive"](tmp_path / f"{platform}.fmu", files)
        if platform == "amiga":
            with pytest.raises(FmuError, match=f"Third has no binary for {fmpy.platform_tuple}; it brings amiga$"):
                alone(path)
        else:
            assert begin(alone(path)).channel("Real", ["x"]).get() == [1.0]
