"""FMI 3.0: sizes by structural parameters, binary variables, early return; an intermediate update is declined."""

import pytest
from fmpy.model_description import read_model_description
from railcosim.orchestrator import Results, System, run
from railcosim.orchestrator.cli.app import call
from railcosim.orchestrator.errors import FmuError, ScenarioError
from railcosim.orchestrator.fmi import load_fmu
from railcosim.orchestrator.names import shape_of
from railcosim.orchestrator.run.checking import check
from railcosim.orchestrator.system import Event


def problems(system):
    with pytest.raises(ScenarioError) as caught:
        run(system)
    return str(caught.value).splitlines()


# -------------------------------------------------------------------- structural parameters (FMI 3.0, 2.2.8 and 2.4.7)


def test_sizes_follow_structural_parameters(shaped, workspace):
    path = shaped()
    as_it_is, larger = (load_fmu(path, workspace, structure=given).interface for given in ({}, {"n": 5}))
    assert [len(it.wholes["u"]) for it in (as_it_is, larger)] == [3, 5]
    assert larger.arrays["m"][-1] == "m[5,2]"
    assert (larger.structure, larger.variables["n"].start) == ({"n": 5}, 5)
    assert [larger.variables[name].start for name in ("m[5,1]", "u[1]", "u[5]")] == [1.5, None, None]
    assert as_it_is.variables["u[3]"].start == 3.0
    assert larger.variables["y[5]"].dependencies == set(larger.wholes["u"])


@pytest.mark.parametrize("isolate", [False, True])
def test_they_are_set_in_configuration_mode(shaped, isolate):
    """One value alone is that of all elements; y = u / 2 by a structural parameter that is no size."""
    path = str(shaped())
    system = System(stop_time=0.3, step=0.1)
    system.add("small", path, {"n": 2})
    system.add("large", path, {"n": 5, "halved": True}, u=[1.0, 2.0, 4.0, 8.0, 16.0], **{"m[5,2]": 3.0})
    system.instances["large"].isolate = isolate
    system.connect("large.y[2:3]", "small.u")
    result = run(system)
    assert [result[f"large.y[{k}]"][-1] for k in range(1, 6)] == [0.5, 1.0, 2.0, 4.0, 8.0]
    assert [result[f"small.y[{k}]"][-1] for k in (1, 2)] == [2.0, 4.0]
    assert (result["large.z"][-1], result["small.z"][-1]) == (9 * 1.5 + 3.0, 6.0)


def test_they_are_set_again_after_a_reset(shaped, alone):
    it = alone(shaped(), structure={"n": 4})
    u, y = (it.channel("Real", [f"{name}[{k}]" for k in range(1, 5)]) for name in "uy")
    for factor in (1.0, 2.0):
        u.set([factor * k for k in range(4)])
        assert y.get() == [2.0 * factor * k for k in range(4)]
        it.reset()


def test_where_start_values_are_not_known_the_rest_of_an_array_stays_as_the_fmu_has_it(shaped, alone):
    it = alone(shaped(), structure={"n": 5})
    it.channel("Real", ["u[2]"]).set([7.0])
    assert it.channel("Real", [f"y[{k}]" for k in range(1, 6)]).get() == [2.0, 14.0, 6.0, 0.5, 0.5]


def test_what_a_structural_parameter_cannot_become(shaped, odd):
    path = str(shaped())
    system = System()
    for k, given in enumerate(({"n": 2.5}, {"n": 9}, {"halved": 1}, {"m": 2}, {"nn": 2})):
        system.add(f"s{k}", path, given)
    system.add("two", odd, {"n": 1})
    own = f"{path}: the structural parameter"
    assert problems(system) == [
        f"instance 's0': {own} 'n' takes a whole number, not 2.5",
        f"instance 's1': {own} 'n' takes any number to 8, not 9",
        f"instance 's2': {own} 'halved' takes true or false, not 1",
        f"instance 's3': {path} has no structural parameter 'm'; there are n, halved",
        f"instance 's4': {path} has no structural parameter 'nn'; did you mean 'n'?",
        f"instance 'two': {odd} is built already; it takes no build arguments ['n']",
    ]


def test_a_size_of_which_nothing_is_left(shaped):
    system = System()
    system.add("s", str(shaped()), {"n": 0}, u=1.0)
    assert problems(system) == [
        "s.u: Shaped has no such variable: in the FMU it is an array of 0 elements, which is not supported"
    ]


def test_in_a_scenario_and_on_the_command_line(shaped, tmp_path, monkeypatch, capsys):
    shaped()
    monkeypatch.chdir(tmp_path)
    (tmp_path / "it.toml").write_text(
        "[simulation]\nstep = 0.1\nstop_time = 0.2\n"
        '[instances.s]\nfmu = "shaped.fmu"\nbuild = { n = 2 }\nstart.u = [1.0, 3.0]\n'
        '[instances.t]\nfmu = "shaped.fmu"\n[connections]\n"t.u[2:3]" = "s.y"\n',
        encoding="utf-8",
    )
    assert call(["run", "it.toml", "-o", "first", "--no-figures", "--quiet"]) == 0
    assert Results.load("first")["t.y[3]"][-1] == 12.0
    assert call(["run", "it.toml", "-o", "second", "--no-figures", "--quiet", "--with", "s.n=9"]) == 2
    assert "takes any number to 8, not 9" in capsys.readouterr().err
    assert call(["describe", "shaped.fmu", "--with", "n=1"]) == 0
    assert "y[1]" in (told := capsys.readouterr().out)
    assert "y[2]" not in told


def test_as_an_independent_reader_has_it(shaped, workspace):
    """FMPy on the same file: the same variables with the same shapes, start values and types."""
    path = shaped(('mimeType="application/x-toy; version=1" maxSize="4"', ""))  # of a type, which FMPy does not read
    it = load_fmu(path, workspace).interface
    for other in read_model_description(str(path)).modelVariables:
        names = it.wholes.get(other.name, (other.name,))
        assert it.variables[names[0]].fmi_type == other.type
        assert shape_of(names) == tuple(size for size in other.shape or () if size > 1)
        if other.type == "Float64" and other.start:
            given = [float(x) for x in other.start.split()] if isinstance(other.start, str) else other.start
            assert [it.variables[name].start for name in names] == (given if len(given) > 1 else given * len(names))


def test_arrays_are_connected_shape_by_shape(shaped, arrays):
    """Rows, columns and parts of them where as many elements stand side by side; nothing is rolled up or unrolled."""
    system = System(stop_time=0.2, step=0.1)
    system.add("a", str(arrays()), u=[[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])
    system.add("s", str(shaped()), {"n": 4})
    system.connect("a.y[1:2,2:3]", "s.u")
    assert problems(system) == [
        "'s.u' = 'a.y[1:2,2:3]': the output is 2 by 2, the input 4; connect it row by row, as y[1,:]"
    ]
    system.connections.clear()
    system.connect("a.y[1,1:2]", "s.u[1:2]")
    system.connect("a.y[:,3]", "s.u[3:]")
    result = run(system)
    assert [result[f"s.y[{k}]"][-1] for k in range(1, 5)] == [4.0, 8.0, 12.0, 24.0]


# -------------------------------------------------------------------- binary variables (FMI 3.0, 2.2.6 and 2.4.7)


@pytest.mark.parametrize("isolate", [False, True])
def test_bytes_pass_as_they_are(shaped, isolate, tmp_path):
    path = str(shaped(('declaredType="Toy" maxSize="16"', 'declaredType="Toy"')))
    system = System(stop_time=0.2, step=0.1)
    system.add("a", path, blob="00 FF7a", **{"blobs[2]": "DEADbeef"})
    system.add("b", path)
    system.instances["b"].isolate = isolate
    system.connect("a.echo", "b.blob")
    system.connect("a.echoes", "b.blobs")
    result = run(system, output=tmp_path / "run", figures=False)
    shown = {name: result[name][-1] for name in ("a.echo", "b.echo", "b.echoes[1]", "b.echoes[2]")}
    assert shown == {"a.echo": "7aff00", "b.echo": "00ff7a", "b.echoes[1]": "01", "b.echoes[2]": "deadbeef"}
    assert "deadbeef" in (tmp_path / "run" / "results.csv").read_text(encoding="utf-8")
    assert list(result["a.echoes[1]"]) == ["01"] * 3


def test_what_is_read_of_binary_variables(shaped, workspace):
    of = load_fmu(shaped(), workspace).interface.variables
    assert [of[name].start for name in ("blob", "blobs[1]", "blobs[2]", "echo")] == ["00ff", "01", "", None]
    assert [of[name].media for name in ("blob", "blobs[1]")] == ["application/x-toy; version=1", ""]
    assert [of[name].longest for name in ("blob", "echo", "echoes[1]")] == [4, 16, None]
    assert of["blob"].is_binary
    assert not of["mode"].is_binary


def test_start_values_and_events_are_bytes(shaped):
    system = System(stop_time=0.2, step=0.1)
    system.add("a", str(shaped()), blob="0", **{"blobs[1]": "zz"})
    system.add("b", str(shaped()), blob="0102030405", blobs=[1, ""])
    digits = 'takes bytes as hexadecimal digits, as in "00ff7a", not'
    assert problems(system) == [
        f"a.blob: {digits} '0'",
        f"a.blobs[1]: {digits} 'zz'",
        "b.blob: takes up to 4 bytes, not 5",
        "b.blobs: takes text, not 1",
    ]


def test_an_event_gives_bytes(shaped):
    system = System(stop_time=0.3, step=0.1)
    system.add("a", str(shaped()))
    system.events.append(Event("a.blob", "set", 0.1, "0A0B"))
    system.events.append(Event("a.blob", "set", 0.2, "xy"))
    assert problems(system)[0].endswith("not 'xy'")
    system.events.pop()
    assert list(run(system)["a.echo"]) == ["ff00", "ff00", "0b0a", "0b0a"]


def test_what_binary_variables_are_connected_to(shaped, by_hand, workspace):
    other = ('mimeType="application/x-toy; version=1" maxSize="4"', 'mimeType="image/png"')
    newer = ("version=1", "version=2")
    system = System(stop_time=0.2, step=0.1)
    system.add("a", str(shaped()))
    system.add("png", str(shaped(other, name="png.fmu")))
    system.add("new", str(shaped(newer, name="new.fmu")))
    system.add("third", str(by_hand(3)))
    system.connect("a.echo", "third.word")
    system.connect("third.said", "a.blob")
    system.connect("a.echo", "png.blob")
    assert problems(system) == [
        "'third.word' = 'a.echo': a Binary output cannot feed a String input",
        "'a.blob' = 'third.said': a String output cannot feed a Binary input",
        "'png.blob' = 'a.echo': the output is 'application/x-toy; version=1', the input takes 'image/png'",
    ]
    system.connections.clear()
    system.connect("a.echo", "new.blob")
    system.connect("a.echoes[1]", "a.blob")
    notes = [note for note in check(system, workspace).notes if "the input takes" in note]
    assert notes == [
        "'new.blob' = 'a.echo': the output is 'application/x-toy; version=1', the input takes 'application/x-toy; "
        "version=2'; the output may have 16 bytes, the input takes 4; more would stop the run",
        "'a.blob' = 'a.echoes[1]': the output is 'application/octet-stream', the input takes 'application/x-toy; "
        "version=1'; the output may have any number of bytes, the input takes 4; more would stop the run",
    ]


def test_more_bytes_than_the_input_takes_stop_the_run(shaped):
    system = System(stop_time=0.2, step=0.1)
    system.add("a", str(shaped()), **{"blobs[1]": "0102030405"})
    system.add("b", str(shaped()))
    system.connect("a.echoes[1]", "b.blob")
    with pytest.raises(FmuError, match=r"^b, t = 0 s: 'blob' cannot become 5 bytes long: it takes up to 4$"):
        run(system)


def test_bytes_without_an_address(shaped, alone):
    it = alone(shaped())
    it.channel("Integer", ["mode"]).set([2])
    with pytest.raises(FmuError, match=r"^it, t = 0 s: fmi3GetBinary says that 'echo' has 2 bytes, and not where$"):
        it.channel("String", ["echo"]).get()


# -------------------------------------------------------------------- early return (FMI 3.0, 4.2)


def test_a_step_that_returns_early_is_gone_on_with(shaped):
    """Half way, and half of the rest, down to 0.05 s: three calls for 0.1 s would be halved once, two of 0.05 s."""
    system = System(stop_time=0.4, step=0.2)
    system.add("a", str(shaped()), mode=1)
    system.add("b", str(shaped()))
    result = run(system)
    assert list(result["a.t"]) == list(result["b.t"]) == [0.0, 0.2, 0.4]
    assert list(result["b.steps"]) == [0, 1, 2]
    # 0.2 s: early at 0.1; 0.1 s left: early at 0.15; 0.05 s left, which is not longer than 0.05 s but for rounding.
    assert list(result["a.steps"])[1] in (3, 4)


def test_one_that_takes_no_rest_of_a_step_may_not_return_early(shaped):
    """It is not offered; this one insists on it and is refused by itself."""
    system = System(stop_time=0.4, step=0.2)
    system.add("a", str(shaped(("canHandleVariableCommunicationStepSize", "canGetAndSetFMUState"))))
    with pytest.raises(FmuError, match="what was not offered is asked for"):
        run(system)
