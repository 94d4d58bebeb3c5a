"""The parts of a signal's name, of our FMUs and of other makers'."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from railcosim.orchestrator.names import SignalName, arrays_of, parted, plainly, shape_of


@pytest.mark.parametrize(
    ("text", "ends", "member", "part", "indices"),
    [
        ("gust.size", ("gust", "size"), ("gust", None), ("size", ()), ()),
        ("train[2].force", ("train[2]", "force"), ("train", 2), ("force", ()), (2,)),
        ("train[2].force[3]", ("train[2]", "force[3]"), ("train", 2), ("force", (3,)), (2, 3)),
        ("train[12].a[1,2]", ("train[12]", "a[1,2]"), ("train", 12), ("a", (1, 2)), (12, 1, 2)),
        ("box.a[1, 2]", ("box", "a[1, 2]"), ("box", None), ("a", (1, 2)), (1, 2)),
        ("box.a.b.c[3].d", ("box", "a.b.c[3].d"), ("box", None), ("a.b.c[3].d", ()), (3,)),
        ("box.a[3].d[4]", ("box", "a[3].d[4]"), ("box", None), ("a[3].d", (4,)), (3, 4)),
        ("box.der(x[1])", ("box", "der(x[1])"), ("box", None), ("der(x[1])", ()), (1,)),
        ("box.n[1][2]", ("box", "n[1][2]"), ("box", None), ("n", (1, 2)), (1, 2)),
        ("box.a[0]", ("box", "a[0]"), ("box", None), ("a", (0,)), (0,)),
        ("box.a[-1, 2 ]", ("box", "a[-1, 2 ]"), ("box", None), ("a", (-1, 2)), (-1, 2)),
        ("box.a[1]b[2]", ("box", "a[1]b[2]"), ("box", None), ("a[1]b", (2,)), (1, 2)),
        ("box.a b[x]", ("box", "a b[x]"), ("box", None), ("a b[x]", ()), ()),
        ("box.a\n[1]", ("box", "a\n[1]"), ("box", None), ("a\n", (1,)), (1,)),
        ("box[x].y", ("box[x]", "y"), ("box[x]", None), ("y", ()), ()),
        ("train[2]", ("train[2]", ""), ("train", 2), ("", ()), (2,)),
        ("", ("", ""), ("", None), ("", ()), ()),
    ],
)
def test_parts(text, ends, member, part, indices):
    name = SignalName.parse(text)
    assert str(name) == text
    assert (name.instance, name.variable) == ends == name
    assert (name.group, name.number) == member
    assert (name.array, name.element) == part
    assert name.indices == indices


@given(st.text("ab[]1,. \n", max_size=20))
def test_any_name_comes_back_as_it_was_written(text):
    name = SignalName.parse(text)
    assert "." not in name.instance
    assert str(name) == (text.removesuffix(".") if not name.variable else text)
    assert SignalName.parse(str(name)) == name


@pytest.mark.parametrize(
    ("names", "shape"),
    [
        (("a",), ()),
        (("a[1]", "a[2]", "a[3]"), (3,)),
        (("m[1,1]", "m[1,2]", "m[1,3]", "m[2,1]", "m[2,2]", "m[2,3]"), (2, 3)),
        (("m[2,1]", "m[2,2]"), (2,)),
        (("n[1][1]", "n[1][2]", "n[2][1]"), (3,)),
        (("cell[1].t[2]", "cell[2].t[2]"), (2,)),
        (("a[1]", "b"), (2,)),
        (("a", "b"), (2,)),
    ],
)
def test_the_shape_of_elements(names, shape):
    assert shape_of(names) == shape


def test_thousands_of_digits_are_no_index():
    name = SignalName.parse(f"a[{'9' * 5000}].b[{'9' * 5000}]")
    assert (name.number, name.element, name.indices) == (None, (), ())


@pytest.mark.parametrize(
    ("text", "family"),
    [
        ("train[2].force[3]", "train[i].force[i]"),
        ("train[2].a[1,2]", "train[i].a[i]"),
        ("train[2]", "train[i]"),
        ("gust.size", "gust.size"),
        ("box.a[3].d", "box.a[3].d"),
    ],
)
def test_family(text, family):
    assert str(SignalName.parse(text).family) == family


@pytest.mark.parametrize(
    ("one", "other", "expected"),
    [
        ("train.force", "train[2].force", True),
        ("train.force", "train[2].force[1]", True),
        ("train[2].force", "train[2].force", True),
        ("train[2].force", "train[2].force[1]", True),
        ("train[2].force[1]", "train[2].force", False),
        ("train[2].force", "train.force", False),
        ("train[2].force", "train[1].force", False),
        ("train.force", "train[2].forces", False),
        ("tra.force", "train[2].force", False),
    ],
)
def test_a_group_covers_its_members_and_an_array_its_elements(one, other, expected):
    assert SignalName.parse(one).covers(SignalName.parse(other)) is expected


@pytest.mark.parametrize(
    ("name", "arrays"),
    [
        ("a", []),
        ("a[3]", [("a", (3,))]),
        ("a[-1]", [("a", (-1,))]),
        ("m[1,2]", [("m", (1, 2))]),
        ("n[1][2]", [("n", (1, 2)), ("n[1]", (2,))]),
        ("cell[0].t", [("cell.t", (0,))]),
        ("cell[3].t[4]", [("cell.t", (3, 4)), ("cell[3].t", (4,))]),
        ("a[x]", []),
        ("'a[1]'", []),
        ("'a[1]'[2]", [("'a[1]'", (2,))]),
        ("o'neil[2]", [("o'neil", (2,))]),
    ],
)
def test_the_arrays_that_a_variable_belongs_to(name, arrays):
    assert list(arrays_of(name)) == arrays


@pytest.mark.parametrize(
    ("name", "plain"),
    [("a[1, 2]", "a[1,2]"), ("n[1][2]", "n[1,2]"), ("a b[ 1 ].c d", "a b[1].c d"), ("x y", "x y")],
)
def test_an_index_without_blanks_in_one_pair_of_brackets(name, plain):
    assert plainly(name) == plain


@pytest.mark.parametrize(
    ("texts", "names"),
    [
        (["a.x, b[:].y", "c"], ["a.x", "b[:].y", "c"]),
        (["a.m[1,2],a.m[1, :]"], ["a.m[1,2]", "a.m[1, :]"]),
        (["a.'x, y',b.z"], ["a.'x, y'", "b.z"]),
        (["a.o'neil,b"], ["a.o'neil", "b"]),
        ([" , ", ""], []),
    ],
)
def test_names_that_commas_part(texts, names):
    assert list(parted(texts)) == names
