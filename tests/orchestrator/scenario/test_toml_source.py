"""Lines of keys in TOML text, and what is said about text that is not TOML."""

import tomllib
import tracemalloc

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from railcosim.orchestrator.errors import ScenarioError
from railcosim.orchestrator.scenario.toml_source import Source, parse_value

TEXT = '''# a comment with [brackets] and a = b
title = "x = [1, 2] # no comment"

[instances.train]
count = 4
start.position = [51e3,   # m
    34e3, "]", 1]
start."force[2]" = 3
build = { carriages = 8, "a.b" = { c = [1, { d = 2 }], e = 3 }, last = 4 }
text = """
[not.a.table]
key = 1
"""
literal = \'\'\'
x = ''1
\'\'\'
date = 1979-05-27T07:32:00Z

[presets."gust-0.2"]
"gust.size" = 0.2

[[published]]
metric = "a"
[[published]]
metric = "b"
[published.inner]
deep = 1
[[figures]]
title = "t"
[[figures.panels]]
y = ["a"]
[[figures.panels]]
y = ["b"]
[[figures]]
[[figures.panels]]
y = ["c"]
'''


@pytest.mark.parametrize(
    ("path", "line"),
    [
        (("title",), 2),
        (("instances",), 4),
        (("instances", "train"), 4),
        (("instances", "train", "count"), 5),
        (("instances", "train", "start"), 6),
        (("instances", "train", "start", "position"), 6),
        (("instances", "train", "start", "force[2]"), 8),
        (("instances", "train", "build", "carriages"), 9),
        (("instances", "train", "build", "a.b", "e"), 9),
        (("instances", "train", "build", "last"), 9),
        (("instances", "train", "text"), 10),
        (("instances", "train", "literal"), 14),
        (("instances", "train", "date"), 17),
        (("presets", "gust-0.2"), 19),
        (("presets", "gust-0.2", "gust.size"), 20),
        (("published", 0, "metric"), 23),
        (("published", 1), 24),
        (("published", 1, "metric"), 25),
        (("published", 1, "inner", "deep"), 27),
        (("figures", 0, "panels", 1, "y"), 33),
        (("figures", 1), 34),
        (("figures", 1, "panels", 0, "y"), 36),
        (("instances", "train", "nothing", "here"), 4),  # the nearest thing around it
        (("not", "there"), None),
        (("not",), None),
    ],
)
def test_the_line_of_a_key(path, line):
    assert Source(TEXT, "x.toml").line(*path) == line
    assert Source(TEXT.replace("\n", "\r\n"), "x.toml").line(*path) == line


def test_an_origin_is_file_and_line_or_the_file_alone():
    source = Source(TEXT, "x.toml")
    assert source.origin("title") == "x.toml:2"
    assert source.origin("missing") == "x.toml"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a = 1\nb = = 2\n", "x.toml:2: column 5: Invalid value"),
        ("a = 1\na = 2\n", "x.toml:2: column 6: Cannot overwrite a value; a key stands once in its section"),
        ("a = [1,\n2", "x.toml:2: Unclosed array at the end of the file"),
        ("", None),
        (
            "[connections]\ntrain[i].force = 'x.y'\n",
            "x.toml:2: column 6: Expected '=' after a key in a key/value pair; "
            'a key with [ ] stands in quotes: "train[1].speed" = ...',
        ),
        (
            "a = 1\nb = [2, { c = 99999999999999999999 }]",
            "x.toml:2: an integer beyond 64 bits; write it with a decimal point",
        ),
        ("a = " + "9" * 5000, "x.toml: Exceeds the limit (4300 digits) for integer string conversion"),
        ("a = " + "[" * 5000, "x.toml: nested too deeply; no scenario needs that"),
        ("a = 1\nb" + ".a" * 100_000 + " = 1", "x.toml:2: a key of more than 100 parts; no scenario needs that"),
        ("[a" + ".a" * 2000 + "]", "x.toml:1: a key of more than 100 parts; no scenario needs that"),
        ("a = [{ b" + ".a" * 2000 + " = 1 }]", "x.toml:1: a key of more than 100 parts; no scenario needs that"),
        ("a = " + "[" * 101 + "]" * 101, "x.toml: nested more than 100 levels deep; no scenario needs that"),
        (
            f'a = "{"x" * (1 << 24)}"',
            "x.toml: it has more than 16 million characters; give long profiles as JSON files, by name",
        ),
    ],
)
def test_what_is_said_about_text_that_is_not_toml(text, message):
    if message is None:
        assert Source(text, "x.toml").data == {}
        return
    with pytest.raises(ScenarioError) as caught:
        Source(text, "x.toml")
    assert str(caught.value).startswith(message)


def test_a_byte_order_mark_is_no_mistake():
    assert Source("\ufeffa = 1", "x.toml").data == {"a": 1}


def test_files_that_cannot_be_read(tmp_path):
    path = tmp_path / "latin.toml"
    path.write_bytes('title = "Zürich"'.encode("latin-1"))
    with pytest.raises(ScenarioError, match=r"latin: not a text in UTF-8 \(invalid .* at byte 10\); save it as UTF-8"):
        Source.read(path, "latin")
    with pytest.raises(ScenarioError, match="gone: cannot be read: No such file or directory"):
        Source.read(tmp_path / "gone.toml", "gone")


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("10", 10),
        ("1e3", 1000.0),
        ("true", True),
        ("[1, 2]", [1, 2]),
        ('"a b"', "a b"),
        ("i > 1", "i > 1"),
        ("1\nother = 2", "1\nother = 2"),
        ("", ""),
        ("[" * 5000, "[" * 5000),
    ],
)
def test_a_value_is_toml_or_the_text_itself(text, value):
    assert parse_value(text) == value


@pytest.mark.parametrize("text", ["9" * 400, f"[0x{'f' * 5000}]", "[" * 200 + "]" * 200])
def test_a_value_that_no_file_could_hold_is_a_text(text):
    assert parse_value(text) == text


KEYS = st.one_of(
    st.from_regex(r"[a-z][a-z0-9_-]{0,4}", fullmatch=True), st.sampled_from(['"a.b"', "'[i]'", '"]"', '"="', '"\\n"'])
)
VALUES = st.sampled_from(
    [
        "1",
        "-2.5e3",
        "true",
        '"]}"',
        "'#'",
        "[1, [2], '[']",
        "{ a = 1, b.c = [2] }",
        '"""\n[x]\ny = """',
        "[\n1, # ]\n2 ]",
        "{}",
    ]
)


@settings(max_examples=300, deadline=None)
@given(st.lists(st.one_of(
    st.tuples(st.just("key"), st.lists(KEYS, min_size=1, max_size=3), VALUES),
    st.tuples(st.sampled_from(["table", "array"]), st.lists(KEYS, min_size=1, max_size=3), st.just("")),
    st.tuples(st.just("comment"), st.just([]), st.just("# [x] = {")),
), max_size=12))  # fmt: skip
def test_every_key_of_every_valid_text_has_the_line_it_stands_on(lines):
    text, expected = "", {}
    for kind, keys, value in lines:
        number, name = text.count("\n") + 1, " . ".join(keys)
        addition = {
            "key": f"{name} = {value}\n",
            "table": f"[{name}]\n",
            "array": f"[[ {name} ]]\n",
            "comment": f"{value}\n",
        }
        try:
            tomllib.loads(text + addition[kind])
        except tomllib.TOMLDecodeError:
            continue
        text += addition[kind]
        if kind == "key":
            expected[number] = keys
    source = Source(text, "x.toml")
    found = set(source._lines.values())
    assert set(expected) <= found
    for path, line in source._lines.items():  # every path that was noted exists, on a line of the text
        value = source.data
        for part in path:
            value = value[part]
        assert 1 <= line <= text.count("\n") + 1


def test_long_strings_and_lists_cost_memory_of_their_own_size():
    text = 'a = "' + "x" * 300_000 + '"\nb = [' + "1.5, " * 2_000 + "]\nc = '''" + "y'" * 50_000 + "'''\nlast = 1"
    tracemalloc.start()
    try:
        assert Source(text, "x.toml").line("last") == 4
        assert tracemalloc.get_traced_memory()[1] < 20 * len(text)
    finally:
        tracemalloc.stop()
