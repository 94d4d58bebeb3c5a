"""Command lines of strangers: whatever is typed, and whatever the files hold, there is a message and an exit code."""

import contextlib
import io
import json
import shutil
import zipfile

import fmpy
import pytest
from hypothesis import strategies as st
from railcosim.orchestrator.cli.app import call

TINY = """
[simulation]
stop_time = 1.0
step = 0.5
[instances.t]
component = "PointMassTrain"
start = { speed = 10.0, force = 1.0 }
[presets.fast]
"t.speed" = 20.0
[metrics]
m = "max(t.speed)"
[require]
r = "always t.speed >= 0"
[[figures]]
title = "f"
y = "t.speed"
"""
EXIT_CODES = (0, 1, 2, 3, 130)


def words(text):
    return st.sampled_from(text.split())


FILES = st.one_of(
    st.just("tiny.toml"),
    words(
        "tiny.toml broken.toml bytes.toml folder.toml missing.toml f.toml text.txt f.fmu junk.fmu folder mine.py "
        "mine.py:X bad.py:Y PointMassTrain Nope - . é.toml comfort_cruis * ~ -- -x TINY.toml"
    ),
    st.sampled_from(["", " ", "x" * 300, "\udcff.toml"]),
)
WORDS = st.one_of(
    words(
        "= a= =b t.speed=1 t.speed=nan t.force=[1] t.force=i t=Schedule t=f.fmu t=junk.fmu t=mine.py:X "
        "t=bad.py:Y train.speed=1 "
        "simulation.step=0.25 simulation.record=1 simulation.stop_time=2 simulation.algorithm=iterative "
        "simulation.seed=-1 t[1].speed=1 t.max_step=0 t.max_step=1e-9 t.max_step=-1 t.mass=0 t.mass=1e400 t.count=3 "
        "t.build.self=1 self=1 carriages=3 points=2 points=[ m=larger m=bigger m= fast b jacobi adaptive plain all t "
        "0.5 1 0 -1 nan inf abc t.speed t.speed[i] max(t.speed) nothing.x t[:].speed lambda:1"
    ),
    st.sampled_from(["", "points=" + "[" * 500, "x=0x" + "f" * 6000, "x=" + "9" * 5000, "t.speed +", "\udcff", "é é"]),
    st.text(st.characters(exclude_characters="/\\\0"), max_size=6),
)
TIMES = words("0.5 1 0.25 0.1 0 -1 nan inf x 0.3 1e300")
PLACES = st.sampled_from(["out", "text.txt", "text.txt/x", "out/a/b", "é", "x" * 300])


def option(name, values):
    return values.map(lambda value: [name, value])


CHANGES = [option(name, WORDS) for name in ("--set", "--with", "--swap", "--preset")]
RUNS = [*CHANGES, option("--stop", TIMES), option("--step", TIMES), st.just(["-q"]), st.just(["--no-figures"])]
OPTIONS = {
    "run": [
        *RUNS,
        option("--algorithm", words("jacobi gauss-seidel iterative adaptive x")),
        option("-o", PLACES),
        option("--resume", st.sampled_from(["done", "missing", "text.txt"])),
        option("--threads", words("1 2 0 -1 x")),
        option("--checkpoint-every", TIMES),
        st.just(["--verify-step"]),
    ],
    "check": CHANGES,
    "describe": [option("--with", WORDS)],
    "compare": [*RUNS, option("--better", WORDS), option("-o", PLACES)],
    "plot": [option("-o", PLACES)],
}


@st.composite
def commands(draw):
    """A command with arguments that may well be meant, and some that are not."""
    name = draw(st.sampled_from(sorted(OPTIONS)))
    arguments = [name, *(["--kind", "plain"] if name in ("run", "compare") else [])]
    if name == "plot":
        signals = WORDS.filter(lambda word: not word.startswith("-"))
        arguments += [draw(st.just("done") | FILES), *draw(st.lists(signals, max_size=2))]
    else:
        arguments += draw(st.lists(FILES, min_size=1, max_size=2 if name == "compare" else 1))
    for given in draw(st.lists(st.one_of(OPTIONS[name]), max_size=3)):
        arguments += given
    if not draw(st.integers(0, 15)):
        places = [k for k in range(len(arguments) + 1) if not k or arguments[k - 1] != "-o"]  # where files go is known
        arguments.insert(draw(st.sampled_from(places)), draw(WORDS))
    return arguments


def said_by(arguments):
    """The exit code, and what went to stderr; nothing may be raised."""
    out = io.TextIOWrapper(io.BytesIO(), "utf-8", errors="backslashreplace")
    err = io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = call(arguments)
    assert code in EXIT_CODES
    assert code != 2 or err.getvalue().strip()
    assert "Traceback" not in err.getvalue()
    return code, err.getvalue()


@pytest.fixture
def desk(tmp_path, monkeypatch, xml):
    """A folder with scenarios, FMUs and results, good and bad ones."""
    monkeypatch.chdir(tmp_path)
    for name, text in {
        "tiny.toml": TINY,
        "broken.toml": "x = [",
        "f.toml": TINY.replace('component = "PointMassTrain"', 'fmu = "f.fmu"'),
        "text.txt": "hi",
        "junk.fmu": "PK\3\4junk",
        "mine.py": "import nothing_such\n",
        "bad.py": "x = (",
    }.items():
        (tmp_path / name).write_text(text)
    (tmp_path / "bytes.toml").write_bytes(b"\xff\0")
    for name in ("folder", "folder.toml"):
        (tmp_path / name).mkdir()
    variables = [xml["variable"]("force", "input", start=0.0), xml["variable"]("speed", "output")]
    with zipfile.ZipFile(tmp_path / "f.fmu", "w") as made:
        made.writestr("modelDescription.xml", xml["description"](variables))
        made.writestr(f"binaries/{fmpy.platform}/Foreign{fmpy.sharedLibraryExtension}", "no library")
    assert said_by(["run", "tiny.toml", "--kind", "plain", "-q", "-o", "done"]) == (0, "")
    return tmp_path


def test_any_command_line_ends_with_a_message_and_a_code(explore, desk):
    explore(said_by, commands(), quick=30, deep=500)
    assert {path.name for path in desk.iterdir()} <= {*DESK, "out", "é", "results"}


DESK = {
    *("tiny.toml", "broken.toml", "f.toml", "text.txt", "junk.fmu", "mine.py", "bad.py", "bytes.toml", "folder"),
    *("folder.toml", "f.fmu", "done"),
}
RECORDED = st.recursive(
    st.sampled_from([None, True, 0, 1.5, 10**400, "", "t.speed", "time", "x(", "running"]),
    lambda inner: st.lists(inner, max_size=2) | st.dictionaries(st.sampled_from(["title", "y", "x", "t.speed"]), inner),
    max_leaves=4,
)
FIGURES = RECORDED | st.fixed_dictionaries({}, optional=dict.fromkeys(("title", "y", "x", "panels"), RECORDED))
KEYS = words("texts units parameters step stop_time status figures_wanted")
TABLES = ["", "time\n", "time,t.speed\n1,x\n", "a,b\n1,2\n", "time,time\n1,2\n", "time,t.speed\n", "\0", "1\n2,"]
HEADS = [b"", b"{}", b"\xff\n", b"[1]\n", b'{"columns": 3, "whole": []}\n', b'{"columns": "time", "whole": []}\n']
BLOCKS = [head + bytes(length) for head in HEADS for length in (0, 64)]


def test_results_that_somebody_has_edited_are_drawn_or_refused(explore, desk):
    record = json.loads((desk / "done" / "run.json").read_text())
    edited = desk / "edited"

    def rule(changes, missing, rows, block):
        shutil.rmtree(edited, ignore_errors=True)
        shutil.copytree(desk / "done", edited)
        content = {key: value for key, value in (record | changes).items() if key not in missing}
        (edited / "run.json").write_text(json.dumps(content))
        if rows is not None:
            (edited / "results.csv").write_text(rows)
        if block is not None:
            (edited / "results.bin").write_bytes(block)
        for signals in ([], ["t.speed"]):
            said_by(["plot", "edited", *signals])

    missing = st.lists(KEYS, max_size=1)
    tables, blocks = st.sampled_from([None, *TABLES]), st.sampled_from([None, *BLOCKS])
    wanted = st.fixed_dictionaries({"figures_wanted": st.lists(FIGURES, min_size=1, max_size=2)})
    changes = st.dictionaries(KEYS, RECORDED, max_size=2) | wanted
    explore(rule, changes, missing, tables, blocks, quick=20, deep=250)
