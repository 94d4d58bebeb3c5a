"""Index patterns of connections; every message read."""

from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st
from railcosim.orchestrator.errors import ScenarioError
from railcosim.orchestrator.names import SignalName
from railcosim.orchestrator.scenario.patterns import Index, Rule, connect, expand, members, read_endpoint, read_signal
from railcosim.orchestrator.system import Connection

COUNTS = {"train": 4, "cruise": 4, "consist": 2, "gust": None, "observer": None, "target": None}


def rule(target, source, line=1, **options):
    made = Connection(source, target, origin=f"x.toml:{line}", **options)
    return Rule(read_endpoint(target, COUNTS), read_endpoint(source, COUNTS), made)


def pairs(target, source):
    return [(c.target, c.source) for c in expand(rule(target, source), COUNTS)]


@pytest.mark.parametrize(
    ("text", "index"),
    [
        ("3", Index(3, False)),
        ("i", Index(0, True)),
        ("i-1", Index(-1, True)),
        (" i + 2 ", Index(2, True)),
        ("j", None),
        (":", None),
        ("i*2", None),
        ("", None),
    ],
)
def test_indices(text, index):
    assert Index.read(text) == index


@pytest.mark.parametrize(
    ("target", "source", "made"),
    [
        ("train[1].disturbance", "gust.acceleration", [("train[1].disturbance", "gust.acceleration")]),
        ("cruise[i].speed", "train[i].speed", [(f"cruise[{i}].speed", f"train[{i}].speed") for i in (1, 2, 3, 4)]),
        ("cruise[i].a", "train[i-1].b", [(f"cruise[{i}].a", f"train[{i - 1}].b") for i in (2, 3, 4)]),
        ("cruise[i].a", "train[ i + 1 ].b", [(f"cruise[{i}].a", f"train[{i + 1}].b") for i in (1, 2, 3)]),
        ("cruise[i-1].a", "train[i+1].b", [("cruise[1].a", "train[3].b"), ("cruise[2].a", "train[4].b")]),
        ("consist[i].a", "train[i].b", [("consist[1].a", "train[1].b"), ("consist[2].a", "train[2].b")]),
        ("train[i].v", "target.value", [(f"train[{i}].v", "target.value") for i in (1, 2, 3, 4)]),
        ("consist[1].force", "observer.force", [("consist[1].force", "observer.force")]),
        ("consist[i].force[2]", "gust.a", [("consist[1].force[2]", "gust.a"), ("consist[2].force[2]", "gust.a")]),
        ("observer.x[i]", "consist[i].x", [("observer.x[1]", "consist[1].x"), ("observer.x[2]", "consist[2].x")]),
        ("observer.x[i,3]", "consist[i].x", [("observer.x[1,3]", "consist[1].x"), ("observer.x[2,3]", "consist[2].x")]),
        (
            "observer.gap[i-1]",
            "consist[i].x",
            [("observer.gap[0]", "consist[1].x"), ("observer.gap[1]", "consist[2].x")],
        ),
        ("observer.x[-1]", "gust.a[ 0 , 2 ]", [("observer.x[-1]", "gust.a[0,2]")]),
        ("consist[i].'a[i]'", "gust.a", [("consist[1].'a[i]'", "gust.a"), ("consist[2].'a[i]'", "gust.a")]),
        ("observer.x[:]", "gust.m[:, 1]", [("observer.x[:]", "gust.m[:,1]")]),
        ("observer.der(x[1]).y", "gust.a b", [("observer.der(x[1]).y", "gust.a b")]),
    ],
)
def test_expansion(target, source, made):
    assert pairs(target, source) == made


def test_an_element_below_1_that_a_pattern_makes_may_be_missing():
    """Our arrays begin at 1, other makers' anywhere: which it is shows when the model is known."""
    assert [c.optional for c in expand(rule("observer.gap[i-1]", "consist[i].x"), COUNTS)] == [True, False]
    assert [c.optional for c in expand(rule("consist[i].x", "observer.gap[i-2]"), COUNTS)] == [True, True]
    assert [c.optional for c in expand(rule("observer.gap[0]", "gust.x"), COUNTS)] == [False]


@given(st.integers(-6, 6), st.integers(-6, 6))
def test_a_pattern_stands_for_every_i_for_which_both_ends_exist(a, b):
    expected = [(i + a, i + b) for i in range(-20, 20) if i >= 1 and 1 <= i + a <= 4 and 1 <= i + b <= 4]
    target, source = f"cruise[i{a:+d}].x", f"train[i{b:+d}].y"
    if expected:
        assert pairs(target, source) == [(f"cruise[{k}].x", f"train[{n}].y") for k, n in expected]
    else:
        with pytest.raises(ScenarioError, match="no i for which both ends exist"):
            pairs(target, source)


@pytest.mark.parametrize(
    ("target", "source", "message"),
    [
        ("tran[i].x", "gust.a", "there is no instance 'tran'; did you mean 'train'?"),
        ("zzz.x", "gust.a", "there is no instance 'zzz'; instances are train, cruise, consist, gust, observer, target"),
        ("train.x", "gust.a", "'train' has a count of 4: write train[i] for all or train[1] for one"),
        ("gust[1].x", "target.a", "'gust' has no count: write gust without [1]"),
        ("train[:].x", "gust.a", "'train[:]': an index is a number, i, i-1 or i+1; for all of them write train[i]"),
        ("train[5].x", "gust.a", "there is no 'train[5]'; there are train[1] to train[4]"),
        ("train[0].x", "gust.a", "there is no 'train[0]'; there are train[1] to train[4]"),
        (
            "gust",
            "target.a",
            "'gust' is not of the form instance.variable, as in train[i].position; "
            "instances are train, cruise, consist, gust, observer, target",
        ),
        (
            "observer.x",
            "train[i].y",
            "every i would drive the one input 'observer.x'; write i there too, or a number here",
        ),
        (
            "train[1].x[i]",
            "gust.a[i]",
            "i has no range, because no instance carries it; arrays connect by their bare names, or with [:] for i",
        ),
        ("cruise[i].x", "train[i+7].y", "there is no i for which both ends exist; counts are: cruise 4, train 4"),
    ],
)
def test_messages(target, source, message):
    with pytest.raises(ScenarioError) as caught:
        pairs(target, source)
    assert str(caught.value) == message


@pytest.mark.parametrize("text", ["gust.a{}x", "gust{}x", "train[i{}x].a"])
def test_a_key_of_blanks_is_read_or_refused_at_once(text):
    """Tried in every possible division, the blanks would take minutes."""
    with suppress(ScenarioError):
        read_endpoint(text.format(" " * 200_000), COUNTS)


def test_what_is_written_without_i_beats_a_pattern_wherever_it_stands():
    for rules in (
        [rule("cruise[i].x", "train[i].x"), rule("cruise[2].x", "gust.a", delay=3)],
        [rule("cruise[2].x", "gust.a", delay=3), rule("cruise[i].x", "train[i].x")],
    ):
        problems = []
        made = {c.target: c for c in connect(rules, COUNTS, problems)}
        assert not problems
        assert (made["cruise[2].x"].source, made["cruise[2].x"].delay) == ("gust.a", 3)
        assert made["cruise[3].x"].source == "train[3].x"
        assert len(made) == 4


def test_options_reach_every_connection():
    (made, *_), problems = (
        connect([rule("cruise[i].x", "train[i].x", 7, delay=1, scale=2.0, offset=3.0)], COUNTS, []),
        [],
    )
    assert (made.delay, made.scale, made.offset, made.origin) == (1, 2.0, 3.0, "x.toml:7")
    assert not problems


@pytest.mark.parametrize(
    ("rules", "message"),
    [
        (
            [("cruise[i].x", "train[i].x"), ("cruise[i+3].x", "train[i].y")],
            "x.toml:2: connections.\"cruise[i+3].x\": 'cruise[4].x' is already driven by 'train[4].x' (x.toml:1); "
            "an input has one source, remove one of the two",
        ),
        (
            [("cruise[1].x", "train[1].x"), ("cruise[ 1 ].x", "train[2].y")],
            "x.toml:2: connections.\"cruise[ 1 ].x\": 'cruise[1].x' is already driven by 'train[1].x' (x.toml:1); "
            "an input has one source, remove one of the two",
        ),
        (
            [("consist[i].force", "observer.force"), ("consist[1].force[2]", "gust.a")],
            "x.toml:2: connections.\"consist[1].force[2]\": the whole of 'consist[1].force' is driven already "
            "(x.toml:1); connect either the array or its elements",
        ),
        (
            [("cruise[i].x", "train[i+9].x")],
            'x.toml:1: connections."cruise[i].x": there is no i for which both ends exist; '
            "counts are: cruise 4, train 4",
        ),
    ],
)
def test_conflicts(rules, message):
    problems = []
    connect([rule(*ends, line) for line, ends in enumerate(rules, 1)], COUNTS, problems)
    assert [str(problem) for problem in problems] == [message]


# -------------------------------------------------------------------- signals


@pytest.mark.parametrize(
    ("text", "signal", "names"),
    [
        ("gust.size", SignalName("gust", "size"), ["gust.size"]),
        ("consist.force", SignalName("consist", "force"), ["consist[1].force", "consist[2].force"]),
        (" consist [ 2 ] .force[ 1 , 2 ] ", SignalName("consist[2]", "force[1,2]"), ["consist[2].force[1,2]"]),
        ("gust.der(x[1]).y", SignalName("gust", "der(x[1]).y"), ["gust.der(x[1]).y"]),
    ],
)
def test_signals_of_one_and_of_all(text, signal, names):
    assert read_signal(text, COUNTS) == signal
    assert [str(name) for name in members(signal, COUNTS)] == names


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("tran.x", "there is no instance 'tran'; did you mean 'train'?"),
        ("tran[2].x", "there is no instance 'tran'; did you mean 'train'?"),
        ("train[9].x", "there is no 'train[9]'; there are train[1] to train[4]"),
        ("gust[1].x", "'gust' has no count: write gust without [1]"),
        ("gust[i].x", "'gust' has no count: write gust without [i]"),
        ("train[i].x", "'train[i].x': i has no meaning here; write train.x for all or train[1].x for one"),
        ("train[i-1].x", "'train[i-1].x': i has no meaning here; write train.x for all or train[1].x for one"),
        ("train[:].x", "'train[:].x': an index is a number here; write train.x for all or train[1].x for one"),
        (
            "train[2].x[i]",
            "'train[2].x[i]': i has no meaning here; write train[2].x for the whole array or train[2].x[1] for one",
        ),
        (
            "train",
            "'train' is not of the form instance.variable, as in train[4].speed or train.speed; "
            "instances are train, cruise, consist, gust, observer, target",
        ),
        ("trian", "'trian' is not of the form instance.variable, as in train[4].speed or train.speed; did you mean"),
    ],
)
def test_what_is_said_about_texts_that_are_no_signal(text, message):
    with pytest.raises(ScenarioError) as caught:
        read_signal(text, COUNTS)
    assert str(caught.value).startswith(message)


@pytest.mark.parametrize(
    ("text", "other", "covers"),
    [
        ("train.x", "train[2].x", True),
        ("train[2].x", "train.x", False),
        ("train[2].x", "train[2].x[1]", True),
        ("train[2].x[1]", "train[2].x", False),
        ("train.x", "train[2].xy", False),
        ("train.x", "cruise.x", False),
        ("gust.x", "gust.x", True),
    ],
)
def test_what_a_signal_stands_for(text, other, covers):
    assert read_signal(text, COUNTS).covers(read_signal(other, COUNTS)) is covers
