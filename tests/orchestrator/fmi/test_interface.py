"""What stands behind the names of an interface."""

import pytest
from railcosim.orchestrator.fmi import Interface, Sort, Variable
from railcosim.orchestrator.fmi.reader import find_arrays

NAMES = (
    *("x[0]", "x[1]", "g[5]", "g[2]", "m[1,1]", "m[1,2]", "m[2,1]", "m[2,2]", "n[1][1]", "n[1][2]", "n[2][1]"),
    *(
        "s[1, 1]",
        "s[1, 2]",
        "cell[0].t",
        "cell[1].t",
        "both",
        "both[1]",
        "neg[-1]",
        "neg[0]",
        "'a[1]'",
        " blank ",
        "one[4]",
    ),
)


@pytest.fixture(scope="module")
def interface():
    variables = {
        name: Variable(name, k, Sort("Real", "input", "continuous", None), 0.0) for k, name in enumerate(NAMES)
    }
    return Interface("M", "M", "", variables, {}, find_arrays(variables))


@pytest.mark.parametrize(
    ("name", "scalars"),
    [
        ("x[0]", ("x[0]",)),
        ("x", ("x[0]", "x[1]")),
        ("x[:]", ("x[0]", "x[1]")),
        ("g", ("g[2]", "g[5]")),
        ("m", ("m[1,1]", "m[1,2]", "m[2,1]", "m[2,2]")),
        ("m[1,:]", ("m[1,1]", "m[1,2]")),
        ("m[:,2]", ("m[1,2]", "m[2,2]")),
        ("m[2][1]", ("m[2,1]",)),
        ("n", ("n[1][1]", "n[1][2]", "n[2][1]")),
        ("n[1]", ("n[1][1]", "n[1][2]")),
        ("n[2,1]", ("n[2][1]",)),
        ("n[:][1]", ("n[1][1]", "n[2][1]")),
        ("s", ("s[1, 1]", "s[1, 2]")),
        ("s[1,2]", ("s[1, 2]",)),
        ("s[ 1 ,2]", ("s[1, 2]",)),
        ("cell.t", ("cell[0].t", "cell[1].t")),
        ("cell[:].t", ("cell[0].t", "cell[1].t")),
        ("both", ("both",)),
        ("both[:]", ("both[1]",)),
        ("m[1:2,2]", ("m[1,2]", "m[2,2]")),
        ("m[2:,:]", ("m[2,1]", "m[2,2]")),
        ("m[ :1, 2:2 ]", ("m[1,2]",)),
        ("n[1][1:2]", ("n[1][1]", "n[1][2]")),
        ("cell[1:].t", ("cell[1].t",)),
        ("neg[-1:0]", ("neg[-1]", "neg[0]")),
        ("g[2:5]", ("g[2]", "g[5]")),
        ("x[0:2]", None),
        ("x[1:0]", None),
        ("x:y", None),
        ("neg", ("neg[-1]", "neg[0]")),
        ("'a'", None),
        ("blank", (" blank ",)),
        ("x[2]", None),
        ("x[:,1]", None),
        ("y", None),
    ],
)
def test_the_scalars_behind_a_name(interface, name, scalars):
    assert interface.scalars(name) == scalars


@pytest.mark.parametrize(
    ("name", "remedy"),
    [
        ("x[2]", "there are 'x[0]' to 'x[1]'"),
        ("m[3,1]", "there are 'm[1,1]' to 'm[2,2]'"),
        ("n[3][1]", "there are 'n[1][1]' to 'n[2][1]'"),
        ("one[5]", "there is 'one[4]'"),
        ("m[:,3]", "there are 'm[1,1]' to 'm[2,2]'"),
        ("x[0:2]", "there are 'x[0]' to 'x[1]'"),
        ("y[1]", ""),
        ("y", ""),
    ],
)
def test_which_elements_there_are_beside_one_that_is_missing(interface, name, remedy):
    assert interface.elements_beside(name) == remedy
