"""Scenarios of strangers: whatever they say, they are fit or refused with a reason, and what loads can be written."""

import contextlib
import copy
import dataclasses
import datetime
import json
import math
import time
import tomllib
import tracemalloc

import pytest
from hypothesis import strategies as st
from railcosim.orchestrator.errors import RailcosimError, ScenarioError
from railcosim.orchestrator.fmi.archive import Workspace
from railcosim.orchestrator.run.checking import check
from railcosim.orchestrator.scenario.loading import dump, load, loads
from railcosim.orchestrator.scenario.shipped import MODELS
from railcosim.orchestrator.scenario.toml_source import Source

SMALL = """
title = "Small"
default_preset = "a"

[simulation]
stop_time = 1.0
step = 0.5
seed = 3
record = 0.5
order = ["train", "cruise", "target"]
algebraic_loops = "solve"
tolerances = { "train.position" = [1e-6, 1e-3], "target.value" = [0, 1] }

[instances.train]
component = "PointMassTrain"
count = 2
step = 0.5
start.position = [100.0, 0.0]

[instances.cruise]
component = "ComfortCruise"
count = 2
start = { alpha = 0.03, has_ahead = "i > 1" }

[instances.target]
component = "Schedule"
isolate = false
build = { points = 2, unit = "m/s" }
start = { times = [0.0, 10.0], values = [85.0, 80.0] }

[connections]
"cruise[i].position" = "train[i].position"
"cruise[i].speed" = "train[i].speed"
"cruise[i].ahead_speed" = "train[i-1].speed"
"cruise[i].ahead_position" = "train[i-1].position"
"cruise[i].target_speed" = { from = "target.value", scale = 2.0, offset = 0.5 }
"train[i].force" = { from = "cruise[i].force", delay = 1 }

[[events]]
signal = ["train.speed", "target.value"]
action = "override"
at = 0.5
value = 3.0
duration = 0.5
every = 1.0

[presets.b]
"cruise.alpha" = 0.01
"train.speed" = [1, 2]
"simulation.step" = 0.25

[require]
r = "always train[i].speed >= -1 from 0.5"

[metrics]
m = "final(train[i].speed)"
n = "max(train[:].speed)"

[[published]]
metric = "n"
preset = "b"
value = 1.0
tolerance = 0.5
origin = "stated"

[[references]]
metric = "n"
value = 1
tolerance = { rounding = 0.5, sampling = 0.1 }

[[figures]]
title = "f"
y = ["train[:].speed", "target.value"]
bands = [[0, 1], "max(target.value)"]
x_range = [0, 1]

[[figures]]
title = "g"
panels = [{ y = "train[1].speed", y_label = "km/h", scale = 3.6 }, { y = "d*d", x = {name="d", from=0, to=1} }]
"""
SHIPPED = {path.stem: path.read_text(encoding="utf-8") for path in sorted(MODELS.glob("*.toml"))}
SCENARIOS = [*[SMALL] * len(SHIPPED), *SHIPPED.values()]


def words(text):
    return st.sampled_from(text.split())


WHOLE = [0, 1, -1, 2, 3, 10**6, 2**31, 2**63 - 1, -(2**63), 2**64, 10**30, 10**400]
NUMBERS = st.sampled_from([*WHOLE, -0.0, 0.1, 1.5, 1e-320, 1e308, math.nan, math.inf, -math.inf])
TEXTS = st.one_of(
    words(
        "a i count nan x.y train[1].speed target.value train[i-1].speed train cruise PointMassTrain Schedule x.fmu "
        "x.py:C / ../x.json . ../../etc/passwd jacobi adaptive b freeze é 😀 \x7f \0 '\"\\"
    ),
    st.sampled_from(["", " ", "i > 1", "\u2028", "\u202e", "9" * 5000, "a" * 5000, " " * 3000]),
)
LISTS = [[], [[]], [{}], [1, 2], [1, "a"], [True], [[1, 2], [3]]]
DATES = st.sampled_from([datetime.date(1979, 5, 27), datetime.datetime(1979, 5, 27, 7, 32), datetime.time(7, 32)])
OTHERS = st.sampled_from([True, False, *LISTS, {}, {"a": 1}, {"from": "train[1].speed"}])
PLAIN = st.floats() | st.integers() | st.text(max_size=8)
VALUES = st.one_of(NUMBERS, TEXTS, DATES, OTHERS, PLAIN).map(copy.deepcopy)
KEYS = st.one_of(
    words(
        "a train cruise target train[1] train[2] train[0] train[3] train[99999] train[i] x instances simulation from "
        "count start build component fmu lambda None i time pi a.b simulation.step train.count train.speed self cls "
        "train[1].speed train.build.x cruise.component name seed order delay title value points é # [ ] = speed alpha "
        "step sample_time stop_time record default_preset presets preset metric panels y x events tolerances isolate"
    ),
    st.sampled_from(["", " ", "\0", "\n", "a" * 3000]),
    st.text(max_size=5),
)
DEEDS = words("replace replace replace delete rename double copy list table add nest")


def places(value, path=()):
    yield path
    if isinstance(value, dict | list):
        for key, inner in value.items() if isinstance(value, dict) else enumerate(value):
            yield from places(inner, (*path, key))


def at(value, path):
    for key in path:
        value = value[key]
    return value


def change(draw, data):
    """One change of a parsed scenario: something is taken out, put in, called otherwise, or of another kind."""
    known = list(places(data))
    other = known[draw(st.integers(0, len(known) - 1))]
    section = draw(st.sampled_from(list(data))) if data else ""  # so that a long one does not have all the changes
    inside = [path for path in known if path[:1] == (section,)]
    if not inside:
        return
    path = inside[draw(st.integers(0, len(inside) - 1))]
    holder, key = at(data, path[:-1]), path[-1]
    value = holder[key]
    deed = draw(
        st.sampled_from([*["replace"] * 3, "delete", "rename", "double", "copy", "list", "table", "add", "nest"])
    )
    if deed == "replace":
        holder[key] = draw(VALUES)
    elif deed == "delete":
        del holder[key]
    elif deed in ("rename", "double") and isinstance(holder, dict):
        holder[draw(KEYS)] = copy.deepcopy(holder.pop(key) if deed == "rename" else value)
    elif deed == "double":
        holder.append(copy.deepcopy(value))
    elif deed == "copy":
        holder[key] = copy.deepcopy(at(data, other))
    elif deed == "list":
        holder[key] = [copy.deepcopy(value) for _ in range(draw(st.integers(1, 3)))]
    elif deed == "table":
        holder[key] = {draw(KEYS): value}
    elif deed == "add" and isinstance(value, dict):
        value[draw(KEYS)] = draw(VALUES)
    elif deed == "nest":
        for level in range(draw(st.sampled_from([20, 90, 150]))):
            holder[key] = {"a": holder[key]} if level % 40 == 39 else [holder[key]]


def written(value):  # noqa: PLR0911 (one a kind)
    """A value as TOML."""
    match value:
        case bool():
            return "true" if value else "false"
        case int():
            return hex(value) if value > 10**300 else str(value)
        case float():
            return repr(value)
        case str():
            return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
        case datetime.date() | datetime.time():
            return value.isoformat()
        case list():
            return f"[{', '.join(map(written, value))}]"
    return f"{{{', '.join(f'{written(key)} = {written(inner)}' for key, inner in value.items())}}}"


@st.composite
def changed(draw):
    """A scenario that somebody has changed, without breaking the syntax."""
    data = tomllib.loads(draw(st.sampled_from(SCENARIOS)))
    for _ in range(draw(st.sampled_from([1, 1, 2, 3]))):
        change(draw, data)
    return "\n".join(f"{written(key)} = {written(value)}" for key, value in data.items())


NAMES = words(
    """a b x-1 1 1979-05-27 train instances simulation step é "a.b" 'a#b' "=" "" '' "\\u0041" "[x]" "\\"" '"' "{" """
)
DOTTED = st.lists(NAMES, min_size=1, max_size=3).map(" . ".join)
SCALARS = st.one_of(
    words("""1 1.5 true -nan 1979-05-27 07:32:00 0x1F "s" 's' "#" "[[" "\\\\" "\\"" '\\' ''''a''' """),
    st.sampled_from(["1979-05-27 07:32:00Z", '"""m\nl"""', "'''m\n'l'''", '"""a""""', '"""a"""""', '"""\\\n  x"""']),
)
TOML_VALUES = st.recursive(
    SCALARS,
    lambda inner: st.one_of(
        st.lists(inner, max_size=3).map(lambda parts: f"[{', '.join(parts)}]"),
        st.lists(inner, max_size=3).map(lambda parts: "[ # c ]\n" + " ,\n".join(parts) + " # e\n]"),
        st.dictionaries(DOTTED, inner, max_size=3).map(
            lambda table: f"{{ {', '.join(f'{key} = {value}' for key, value in table.items())} }}"
        ),
    ),
    max_leaves=5,
)
LINES = st.one_of(
    st.builds("{} = {}{}".format, DOTTED, TOML_VALUES, st.sampled_from(["", " # c", " # = [ \" '", "\t"])),
    DOTTED.map("[{}]".format),
    DOTTED.map("[[ {} ]] # x".format),
    st.sampled_from(["", "# '\"[["]),
)
SIGNS = st.characters(exclude_categories=["Cs"]) | st.sampled_from([*"[]{}=.,#\"'\\\n\r\t 0i", ""])


@st.composite
def torn(draw):
    """The text of a scenario with lines and letters gone, doubled, exchanged, or put in."""
    lines = draw(st.sampled_from(SCENARIOS)).split("\n")
    for _ in range(draw(st.integers(1, 3))):
        here, there = (draw(st.integers(0, len(lines) - 1)) for _ in range(2))
        deed = draw(st.sampled_from(["delete", "double", "exchange", "insert", "letter", "letter", "letter"]))
        if deed == "delete":
            lines[here] = ""
        elif deed == "double":
            lines.insert(there, lines[here])
        elif deed == "exchange":
            lines[here], lines[there] = lines[there], lines[here]
        elif deed == "insert":
            lines.insert(here, draw(LINES))
        else:
            column = draw(st.integers(0, len(lines[here])))
            lines[here] = lines[here][:column] + draw(SIGNS) + lines[here][column + draw(st.integers(0, 2)) :]
    return "\n".join(lines)


BROKEN = st.binary(max_size=3) | st.sampled_from(
    [b"\0", b"\xff", b"\xfe\xff", b"\xef\xbb\xbf", b"\xc3", b"\xed\xa0\x80", b"\x1a", b"\r", b"\xf4\x90\x80\x80"]
)


@st.composite
def damaged(draw):
    """The bytes of a scenario with some of them changed, or in another encoding."""
    content = bytearray(draw(st.sampled_from(SCENARIOS)).encode(draw(st.sampled_from([*["utf-8"] * 9, "utf-16"]))))
    for _ in range(draw(st.integers(1, 3))):
        place = draw(st.integers(0, len(content)))
        content[place : place + draw(st.sampled_from([0, 1, 3, 500]))] = draw(BROKEN)
    return bytes(content)


def comparable(value):
    """A system as plain data in which NaN equals NaN, without what does not count for equality."""
    if dataclasses.is_dataclass(value):
        return {f.name: comparable(getattr(value, f.name)) for f in dataclasses.fields(value) if f.compare}
    if isinstance(value, dict):
        return {key: comparable(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [comparable(inner) for inner in value]
    return "nan" if isinstance(value, float) and math.isnan(value) else value


@pytest.fixture
def try_text(watched, tmp_path):
    """Load a text, write the system and load it again; and check it as well where that is asked for."""
    path = str(tmp_path / "scenario.toml")

    def loaded(text):
        try:
            return loads(text, path)
        except ScenarioError as error:
            said = error.problems
        assert said
        assert all(problem.place and problem.message for problem in said)
        return None

    def rule(text, checked=False):
        with watched(tmp_path):
            system = loaded(text)
        if system is None:
            return
        again = loads(dump(system), path)
        # those of other presets are left out
        again.judged.published, again.judged.references = system.judged.published, system.judged.references
        assert comparable(again) == comparable(system)
        if checked:
            with Workspace() as place, contextlib.suppress(RailcosimError), watched(place.folder):
                check(system, place, "plain")

    return rule


def test_a_changed_scenario_is_fit_or_refused(explore, try_text):
    with Workspace() as place:
        check(loads(SMALL), place, "plain")
    explore(lambda text: try_text(text, True), changed(), quick=40, deep=1200)


def test_a_torn_text_is_a_scenario_or_refused(explore, try_text):
    explore(try_text, torn(), quick=60, deep=600)


def test_any_text_is_a_scenario_or_refused(explore, try_text):
    explore(try_text, st.lists(LINES, max_size=8).map("\n".join) | st.text(max_size=60), quick=100, deep=1500)


def test_any_file_is_a_scenario_or_refused(explore, watched, tmp_path):
    path = tmp_path / "scenario.toml"

    def rule(content):
        path.write_bytes(content)
        with watched(tmp_path), contextlib.suppress(ScenarioError):
            Source.read(path, "scenario.toml")

    explore(rule, damaged() | st.binary(max_size=60), quick=60, deep=600)
    path.write_bytes(b"\xef\xbb\xbf" + SMALL.replace("\n", "\r\n").encode())
    assert load(path).provenance.title == "Small"


DEEP = 20_000
MONSTERS = {
    "a dotted key": "a" + ".a" * 3000 + " = 1",
    "a dotted header": "[a" + ".a" * 3000 + "]",
    "brackets": f"a = {'[' * DEEP}{']' * DEEP}",
    "braces": f"a = {'{a=' * DEEP}1{'}' * DEEP}",
    "digits": f"a = {'9' * DEEP}",
    "hexadecimal digits": f"a = 0x{'f' * DEEP}",
    "keys": "\n".join(f"k{k} = 1" for k in range(DEEP // 4)),
    "a long key": f"{'k' * DEEP} = 1",
    "two long instances": f"[instances.{'k' * DEEP}]\n[instances.{'k' * DEEP}k]",
    "a long signal": f'[connections]\n"{"train" * DEEP}[i].x" = "a.b"',
    "a signal of blanks": f'[connections]\n"train{" " * DEEP}" = "a.b{" " * DEEP}c"',
    "quotes": f"a = '{chr(34) * DEEP}'",
    "an open text": f'a = """{"x" * DEEP}',
    "many instances": SMALL.replace("count = 2", "count = 1000").replace("[100.0, 0.0]", "3.0"),
    "a long array": SMALL.replace("points = 2", "points = 1_000_000_000"),
    "build arguments with names of Python's": SMALL.replace("points = 2", "self = 2, time = [2], cls = 3"),
    "too many steps": SMALL.replace("stop_time = 1.0", "stop_time = 1e300"),
}


@pytest.mark.sample(4)
@pytest.mark.usefixtures("in_time")
@pytest.mark.parametrize("name", MONSTERS)
def test_a_monster_takes_neither_time_nor_memory(try_text, name):
    begin = time.process_time()
    tracemalloc.start()
    try:
        try_text(MONSTERS[name], True)
        assert time.process_time() - begin < 20.0
        assert tracemalloc.get_traced_memory()[1] < 100 << 20
    finally:
        tracemalloc.stop()
