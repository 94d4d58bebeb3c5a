"""FMI 3.0 arrays: elements here, whole arrays for the FMU."""

import numpy as np
import pytest
from railcosim.orchestrator import System, run
from railcosim.orchestrator.errors import FmuFileError, ScenarioError
from railcosim.orchestrator.fmi import load_fmu

U = [f"u[{i},{j}]" for i in (1, 2) for j in (1, 2, 3)]
Y = [name.replace("u", "y") for name in U]


def test_what_is_read(arrays, workspace):
    it = load_fmu(arrays(), workspace).interface
    of = it.variables
    assert it.arrays["u"] == it.wholes["u"] == tuple(U)
    assert [of[name].start for name in U] == [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    assert [of[f"k[{i}]"].start for i in (1, 2, 3)] == [1.0, 1.0, 1.0], "one value is that of all elements"
    assert [of[name].start for name in ("n[1]", "n[2]", "on[1]", "on[2]")] == [7, -8, True, False]
    assert [of[name].start for name in ("words[1]", "words[2]")] == ["one word", "two, words"]
    assert of["y[2,1]"].dependencies == set(U)
    assert of["z"].dependencies == {*U, "k[1]", "k[2]", "k[3]"}
    assert (of["k[2]"].minimum, of["m[1]"].fmi_type, of["m[1]"].type) == (0.0, "Int32", "Integer")
    assert (of["twice[1,2]"].causality, of["twice[1,2]"].reference) == ("local", of["y[1,2]"].reference)
    assert it.left_out == {}


@pytest.mark.parametrize("count", [2, 7])
def test_start_values_that_do_not_fit(arrays, workspace, count):
    path = arrays(('start="1 2 3 4 5 6"', f'start="{"1 " * count}"'))
    with pytest.raises(FmuFileError, match=f'the array "u" has {count} start values for 6 elements'):
        load_fmu(path, workspace)


def test_parts_of_arrays_are_set_and_the_rest_stays(arrays, alone):
    it = alone(arrays())
    it.channel("Real", U).set([1.0, 2.0, 3.0, 4.0, 5.0, 6.0])
    part = it.channel("Real", ["u[2,3]", "k[2]", "u[1,2]"])
    part.set([60.0, 0.5, 20.0])
    assert it.channel("Real", Y).get() == [2.0, 40.0, 6.0, 8.0, 10.0, 120.0]
    assert part.get() == [60.0, 0.5, 20.0]
    it.channel("Real", ["u[1,1]"]).set([10.0])
    assert it.channel("Real", ["y[1,1]", "y[1,2]", "z"]).get() == [20.0, 40.0, 10.0 + 0.5 * 20.0 + 3.0]


def test_what_was_never_set_has_its_start_value(arrays, alone):
    it = alone(arrays())
    it.channel("Real", ["u[1,1]"]).set([0.0])
    assert it.channel("Real", Y).get() == [0.0, 4.0, 6.0, 8.0, 10.0, 12.0]


@pytest.mark.parametrize(
    ("ends", "value", "expected"),
    [
        (("Integer", "n", "m"), 3, [-3, 8]),
        (("Boolean", "on", "off"), 0, [1, 1]),
        (("String", "words", "copies"), "three", ["three", "two, words"]),
    ],
)
def test_all_types(arrays, alone, ends, value, expected):
    kind, given, shown = ends
    it = alone(arrays())
    it.channel(kind, [f"{given}[1]"]).set([value])
    assert it.channel(kind, [f"{shown}[{k}]" for k in (1, 2)]).get() == expected
    assert it.channel(kind, [f"{shown}[2]"]).get() == expected[1:]


def test_directional_derivatives(arrays, alone):
    it = alone(arrays())
    it.channel("Real", ["k[1]", "k[2]", "k[3]"]).set([1.0, 10.0, 100.0])
    assert it.directional_derivatives(["y[1,3]", "y[2,1]"], ["u[2,1]", "u[1,3]"], [1.0, 5.0]) == [10.0, 2.0]
    assert it.directional_derivatives(["z"], ["u[1,2]"], [1.0]) == [10.0]


@pytest.mark.parametrize("isolate", [False, True])
def test_in_a_system(arrays, isolate):
    path = str(arrays())
    system = System(stop_time=0.3, step=0.1, metrics={"largest": "max(b.y[:,2])"})
    system.add("a", path, u=[[1, 2, 3], [4, 5, 6]], k=2.0, **{"n[2]": 5, "words[1]": "hello"})
    system.add("b", path)
    system.instances["b"].isolate = isolate
    system.connect("a.y", "b.u")
    system.connect("a.m", "b.n")
    system.connect("a.off[1]", "b.on[2]")
    system.connect("a.copies", "b.words")
    result = run(system)
    assert [result[f"b.{name}"][-1] for name in Y] == [4.0, 8.0, 12.0, 16.0, 20.0, 24.0]
    assert result["a.z"][-1] == 2.0 * (1.0 + 2.0 + 3.0)
    assert (result["b.m[1]"][-1], result["b.m[2]"][-1], result["b.off[1]"][-1]) == (7, 5, 0)
    assert result["b.copies[1]"][-1] == "hello"
    assert result.metrics[0].values == {None: 20.0}
    assert isinstance(result["b.z"], np.ndarray)


def test_another_size(arrays):
    system = System(stop_time=0.3, step=0.1)
    system.add("a", str(arrays()), **{"u[3,1]": 1.0})
    with pytest.raises(ScenarioError, match=r"Arrays has no such variable; there are 'u\[1,1\]' to 'u\[2,3\]'"):
        run(system)
