"""The kernel's C: what it is given is checked, and the compiler and its sanitizers find nothing."""

import os
import shutil
import subprocess
import sys
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from railcosim.orchestrator.master import compiled
from railcosim.orchestrator.master.compiled import CompiledLoop
from railcosim.orchestrator.master.plans import CHANGES, CONTROL, PLACE, SWING
from railcosim.orchestrator.master.plans.layout import COURSE, LOOP, NOTING, POINTS
from railcosim.orchestrator.master.settings import Settings

FOREIGN = Path(__file__).parents[1] / "foreign"
GCC = shutil.which("gcc")
pytestmark = [
    pytest.mark.skipif(compiled.kernel is None, reason="installed without the compiled step loop"),
    pytest.mark.skipif(not sys.platform.startswith("linux"), reason="FMUs by hand are compiled for Linux here"),
    pytest.mark.skipif(GCC is None, reason="FMUs by hand need gcc"),
]


# -------------------------------------------------------------------- what the kernel is given


def test_a_guard_is_an_address():
    with pytest.raises(TypeError):
        compiled.kernel.watch("there")


FIXED = np.zeros(0, CONTROL)
"""Steps do not vary."""


def call(arguments, **changed):
    return compiled.kernel.run(*(arguments | changed).values())


def test_a_sound_plan(arguments):
    assert call(arguments) == (4, 4, 1)
    assert list(arguments["table"][0, :4]) == [0.25, 0.5, 0.75, 1.0]
    assert list(arguments["table"][1:, 3]) == list(arguments["values"])
    assert arguments["places"].tolist() == [(0, -1, 0)]
    assert call(arguments, count=0) == (0, 0, 1)
    assert call(arguments, loops=np.zeros(1, LOOP)) == (4, 4, 1), "a loop of which no operation speaks"


@pytest.mark.parametrize(
    ("kind", "field", "value"), [(1, "period", 2), (1, "phase", 1), (1, "is_late", 1), (2, "kind", 4), (2, "kind", 2)]
)
def test_calls_that_differ_are_made_one_by_one(arguments, kind, field, value):
    """Calls that nobody watches are one group, but not if one is due at another time, late, or may be infinite."""
    operations = changed(arguments["operations"], "is_watched", 0, slice(None))
    one, other = np.flatnonzero(operations["kind"] == kind)[:2]
    if kind == 2:
        operations["index"][other] = operations["index"][one]
    if field == "phase":
        operations["period"][[one, other]] = 2
    operations[field][other] = value
    assert call(arguments, operations=operations) == (4, 4, 1)
    table = arguments["table"][:, :4]
    assert np.isfinite(table).all()
    stands = [bool((np.diff(table[1 + 4 * n]) == 0.0).any()) for n in range(3)]  # x, where a step is left out
    assert stands == {"period": [False, True, False], "phase": [True, True, False]}.get(field, [False] * 3)


def test_a_block_ends_where_there_is_no_room_for_a_row(arguments):
    assert call(arguments, row=6)[:2] == (2, 2)
    assert list(arguments["table"][0, 6:]) == [0.25, 0.5]
    assert call(arguments, row=8)[:2] == (0, 0)
    assert call(arguments, row=7, every=3, last=100)[:2] == (4, 1)
    assert call(arguments, row=7, every=3, last=100, count=9)[:2] == (5, 1)
    assert call(arguments, row=8, every=100, last=100)[:2] == (4, 0)
    assert call(arguments, every=3)[:2] == (4, 2), "the last one, too"
    assert list(arguments["table"][0, :2]) == [0.75, 1.0]


def test_only_what_is_kept_is_written(arguments):
    table = np.full((3, 5), -1.0)
    assert call(arguments, kept=np.array([2, 0]), table=table, row=1)[:2] == (4, 4)
    assert list(table[0]) == [-1.0, 0.25, 0.5, 0.75, 1.0]
    assert list(table[1:, 4]) == [arguments["values"][2], arguments["values"][0]]


def changed(array, field, value, at=0):
    result = array.copy()
    result[field][at] = value
    return result


def going_on(arguments, array, name, value):
    """A first operation that sets an input that goes on, but for one thing."""
    made = {"courses": np.zeros(1, COURSE), "points": np.zeros(1, POINTS)}
    made["courses"][0] = (1, 0, 0, 1, 2, 2, 1)
    made[array][name] = value
    return made | {"operations": changed(arguments["operations"], "kind", 7)}


def going_round(arguments, *, place=0, compared=0.0, **of):
    """A first operation that begins a loop, and none that ends it."""
    loops, work = np.zeros(1, LOOP), np.zeros(1000)
    loops["limit"] = 1
    for name, value in of.items():
        loops[name] = value
    work[1] = compared
    operations = changed(changed(arguments["operations"], "kind", 9), "index", 0)
    return {"loops": loops, "work": work, "passed": np.array([place]), "operations": operations}


def beginning_twice(arguments):
    operations = changed(arguments["operations"], "is_watched", 0, slice(None))
    return changed(changed(operations, "kind", [9, 9], [0, 1]), "index", [0, 1], [0, 1])


def noting(arguments, *, points=(0, 1), **of):
    """A first operation that notes inputs, but for one thing."""
    notes, courses = np.zeros(1, NOTING), np.zeros(2, COURSE)
    courses["begin"][1], courses["count"][1] = points
    courses["count"][0], notes["shown"] = 1, 1
    for name, value in of.items():
        notes[name] = value
    operations = changed(changed(arguments["operations"], "kind", 15), "index", 0)
    return {"notes": notes, "courses": courses, "points": np.zeros(1, POINTS), "operations": operations}


def noting_by(arguments, name, value, at=0):
    """The same, but for one thing of a course; or of its point, which nothing else has a look at."""
    made = noting(arguments)
    array = "points" if name in ("place", "count") else "courses"
    return made | {array: changed(made[array], name, value, at)}


def varying(arguments, *, place=0, parts=13, **of):
    """Steps that vary, but for one thing."""
    control = np.zeros(1, CONTROL)
    control["value_count"] = len(arguments["values"])
    for name, value in of.items():
        control[name] = value
    made = {"control": control, "work": np.zeros(1000), "passed": np.array([place])}
    return made | {"parts": np.full(parts, len(arguments["operations"]))}


def ending(arguments):
    """A loop that nothing begins."""
    operations = changed(changed(arguments["operations"], "kind", [10, 11], [0, 1]), "index", 0, [0, 1])
    return going_round(arguments) | {"operations": operations}


WRONG = {
    "a place beyond the values": lambda a: {"entries": changed(a["entries"], "place", 10**6)},
    "a negative place": lambda a: {"entries": changed(a["entries"], "place", -1)},
    "outputs that are not side by side": lambda a: {"entries": changed(a["entries"], "place", 0, 10)},
    "an age beyond the history": lambda a: {"entries": changed(a["entries"], "age", 2)},
    "a huge age": lambda a: {"entries": changed(a["entries"], "age", 2**62)},
    "a negative age": lambda a: {"entries": changed(a["entries"], "age", -2)},
    "a history that is not there": lambda a: {"history": np.empty((0, len(a["values"]))), "newest": 0},
    "half a row of history": lambda a: {"history": a["history"].ravel()[:-1]},
    "a newest row beyond the history": lambda a: {"newest": 2},
    "a negative newest row": lambda a: {"newest": -1},
    "a channel that begins nowhere": lambda a: {"channels": changed(a["channels"], "begin", -1)},
    "a channel that begins too late": lambda a: {"channels": changed(a["channels"], "begin", 10**6)},
    "a channel that is too long": lambda a: {"channels": changed(a["channels"], "count", 2**62)},
    "a channel of negative length": lambda a: {"channels": changed(a["channels"], "count", -1)},
    "a channel without function": lambda a: {"channels": changed(a["channels"], "function", 0)},
    "a channel without an entry": lambda a: {"channels": changed(a["channels"], "count", 0)},
    "a channel of no type": lambda a: {"channels": changed(a["channels"], "type", -1)},
    "a channel of an unknown type": lambda a: {"channels": changed(a["channels"], "type", 13)},
    "a channel without a reference": lambda a: {"channels": changed(a["channels"], "reference_count", 0)},
    "more references than values": lambda a: {"channels": changed(a["channels"], "reference_count", 10**6)},
    "forms of some values": lambda a: {"forms": np.zeros(1, np.int64)},
    "a step without function": lambda a: {"instances": changed(a["instances"], "function", 0)},
    "an unknown operation": lambda a: {"operations": changed(a["operations"], "kind", 18)},
    "an unknown change": lambda a: {"entries": changed(a["entries"], "change", 1)},
    "a negative change": lambda a: {"entries": changed(a["entries"], "change", -2)},
    "a change beyond the changes": lambda a: {
        "operations": changed(changed(a["operations"], "kind", 3), "index", 1),
    },
    "a change of no value": lambda a: {
        "operations": changed(changed(a["operations"], "kind", 3), "index", 0),
        "changes": changed(a["changes"], "place", 10**6),
    },
    "an operation that is never due": lambda a: {"operations": changed(a["operations"], "period", 0)},
    "a phase beyond the period": lambda a: {"operations": changed(a["operations"], "phase", 1)},
    "a negative phase": lambda a: {"operations": changed(a["operations"], "phase", -1)},
    "no parts": lambda a: {"parts": a["parts"][:0]},
    "parts that do not end with the operations": lambda a: {"parts": a["parts"] - 1},
    "parts that go back": lambda a: {"parts": np.array([3, 2, 3, len(a["operations"])])},
    "an odd number of parts": lambda a: {"parts": np.array([1, 2, 3, 4, len(a["operations"])])},
    "three parts": lambda a: {"parts": np.array([1, 2, len(a["operations"])])},
    "too many parts": lambda a: {"parts": np.full(2050, len(a["operations"]))},
    "a part beyond the operations": lambda a: {"parts": np.array([1, 10**6, 10**6, len(a["operations"])])},
    "a negative part": lambda a: {"parts": np.array([-1, 2, 3, len(a["operations"])])},
    "no place": lambda a: {"places": a["places"][:0]},
    "two places": lambda a: {"places": np.tile(a["places"], 2)},
    "a place before the first operation": lambda a: {"places": changed(a["places"], "begin", -1)},
    "a place after the last operation": lambda a: {"places": changed(a["places"], "begin", 10**6)},
    "too few marks": lambda a: {"disturbed": a["disturbed"][:-1]},
    "a negative operation": lambda a: {"operations": changed(a["operations"], "kind", -1)},
    "an unknown instance": lambda a: {"operations": changed(changed(a["operations"], "kind", 1), "index", 10**6)},
    "an unknown channel": lambda a: {"operations": changed(a["operations"], "index", 10**6)},
    "a negative channel": lambda a: {"operations": changed(a["operations"], "index", -1)},
    "a course that is not there": lambda a: {"operations": changed(changed(a["operations"], "kind", 7), "index", 1)},
    "a course of too high an order": lambda a: going_on(a, "courses", "order", 3),
    **{
        f"a course whose {name} is {value}": partial(going_on, array="courses", name=name, value=value)
        for name, value in [
            *(("function", 0), ("channel", 10**6), ("count", 0), ("begin", -1), ("begin", 10**6)),
            *(("depth", -1), ("depth", 3), ("order", -1), ("at", 0), ("at", -1), ("at", 3)),
        ]
    },
    "a course of whole numbers": lambda a: (
        going_on(a, "courses", "order", 2)
        | {
            "channels": changed(a["channels"], "type", 1),
        }
    ),
    "a channel of texts, of which there are none": lambda a: {"channels": changed(a["channels"], "type", 13)},
    "a channel of no type that there is": lambda a: {"channels": changed(a["channels"], "type", 15)},
    "fewer points than none": lambda a: going_on(a, "points", "count", -1),
    "more points than there is room for": lambda a: going_on(a, "points", "count", 4),
    "a continued input that is not there": lambda a: going_on(a, "points", "place", 10**6),
    "a stamp where there is no room for one": lambda a: {"operations": changed(a["operations"], "kind", 6)},
    "stamps of other values": lambda a: {"stamps": a["values"][:-1]},
    "a state that is not there": lambda a: {"operations": changed(changed(a["operations"], "kind", 12), "index", 0)},
    "a loop that is not there": lambda a: {"operations": changed(changed(a["operations"], "kind", 9), "index", 0)},
    "a loop without rounds": lambda a: going_round(a, limit=0),
    "a loop that compares what is not there": lambda a: going_round(a, kind=1, real_count=1, place=10**6),
    **{
        f"a loop whose {name} is {value}": partial(going_round, **{name: value})
        for name, value in [
            *(("kind", 2), ("limit", 10**6), ("method", -1), ("method", 3), ("real_count", -1), ("other_count", -1)),
            *(("guess_count", -1), ("guess_count", 1), ("begin", -1), ("other_count", 2), ("work", 10**6)),
            *(("compared", -1.0), ("compared", 1.0)),
        ]
    },
    "a loop of several threads": lambda a: (
        going_round(a)
        | {
            "parts": np.array([1, 2, 3, len(a["operations"])]),
            "places": np.tile(a["places"], 2),
        }
    ),
    "an unknown note": lambda a: noting(a) | {"notes": np.zeros(0, NOTING)},
    "a note of points beyond the others": lambda a: noting(a, points=(1, 1)),
    "a note of other points": lambda a: noting(a, points=(0, 0)),
    "a note of fewer points than none": lambda a: (
        noting(a) | {"courses": np.array([(0, 0, 0, -1, 0, 0, 0)] * 2, COURSE)}
    ),
    "a note of points that are not there": lambda a: noting(a) | {"points": np.zeros(0, POINTS)},
    "a note in a longer channel": lambda a: noting(a, to=int(np.argmax(a["channels"]["count"]))),
    **{
        f"a note whose {name} is {value}": partial(noting, **{name: value})
        for name, value in [("from", -1), ("from", 10**6), ("to", -1), ("to", 10**6), ("course", 2), ("shown", -1)]
    },
    "a note of a course of another channel": partial(noting_by, name="channel", value=1),
    "a note to a course of another channel": partial(noting_by, name="channel", value=1, at=1),
    **{
        f"a note of a point whose {name} is {value}": partial(noting_by, name=name, value=value)
        for name, value in [("place", 10**6), ("place", -1), ("count", 4), ("count", -1)]
    },
    "steps that vary in one part": partial(varying, parts=1),
    "a value that is not there is watched": partial(varying, plain_count=1, place=10**6),
    **{
        f"steps that vary with a {name} of {value}": partial(varying, **{name: value})
        for name, value in [
            *(("value_count", -1), ("value_count", 10**6), ("point_count", -1), ("point_count", 1), ("work", 10**6)),
            *(("plain_count", -1), ("plain_count", 2), ("shown_count", -1), ("shown_count", 2)),
        ]
    },
    "two loops that begin at once": lambda a: (
        going_round(a) | {"loops": np.repeat(going_round(a)["loops"], 2), "operations": beginning_twice(a)}
    ),
    "a loop that does not begin": ending,
    "a loop that does not end": going_round,
    "a table with half a column": lambda a: {"table": a["table"].ravel()[:-1]},
    "a row before the table": lambda a: {"row": -1},
    "a row behind the table": lambda a: {"row": 9},
    "a value that is not there is kept": lambda a: {"kept": a["kept"] + 1},
    "fewer references than entries": lambda a: {"references": a["references"][:-1]},
    "half an entry": lambda a: {"entries": np.frombuffer(a["entries"].tobytes()[:-8], np.uint8)},
    "values that are not aligned": lambda a: {"values": np.zeros(801, np.uint8)[1:]},
    "rows of nothing": lambda a: {"every": 0},
    "a negative number of rows": lambda a: {"every": -1},
    "a negative step number": lambda a: {"first": -1},
    "a negative number of steps": lambda a: {"count": -1},
    "steps beyond all numbers": lambda a: {"first": 2**62, "count": 2**63 - 1},
}


@pytest.mark.parametrize("wrong", WRONG)
def test_a_plan_that_is_not_sound_is_refused(arguments, wrong):
    with pytest.raises(ValueError, match=r"^kernel: "):
        call(arguments, **WRONG[wrong](arguments))


def test_points_that_are_noted(arguments):
    """Where nothing of it is wrong; see `WRONG`."""
    made = noting(arguments)
    assert call(arguments, **made) == (4, 4, 1)
    assert call(arguments, **made | {"notes": changed(made["notes"], "course", -1)}) == (4, 4, 1)


def test_what_is_not_an_array_is_refused(arguments):
    frozen = arguments["values"].copy()
    frozen.flags.writeable = False
    for wrong in (None, [1.0], "now", b"12345678", frozen, np.zeros(200)[::2]):
        with pytest.raises(TypeError):
            call(arguments, values=wrong)
    with pytest.raises(TypeError):
        call(arguments, start="now")
    with pytest.raises(OverflowError):
        call(arguments, count=2**64)


@pytest.mark.parametrize(("value", "kind"), [(np.nan, "get"), (np.inf, "set")])
def test_what_is_no_number_becomes_whole(arguments, value, kind):
    """None is 0, which the next input takes; what is infinite is too large for every type."""
    operations, entries, channels = arguments["operations"], arguments["entries"].copy(), arguments["channels"]
    whole = next(k for k, row in enumerate(operations) if row["kind"] == 0 and not channels[row["index"]]["is_real"])
    entry = int(channels[operations[whole]["index"]]["begin"])
    place = int(channels[operations[0]["index"]]["begin"])
    entries["whole"][entry], entries["age"][entry], entries["place"][entry] = 2, -1, entries["place"][place]
    arguments["values"][entries["place"][place]] = value
    assert call(arguments, entries=entries)[0] == 0
    failed = int(arguments["places"]["failed"][0])
    assert (failed == whole) == (kind == "set")


def test_texts_that_are_none_are_refused(arguments):
    with pytest.raises(ValueError, match="PyCapsule"):
        call(arguments, texts="one")


def test_swings_are_those_of_a_signal():
    """By hand: up to 2, down to -1, up to 4, where it stays; what is not finite is none of it."""
    swings = np.zeros(2, SWING)
    for part in ([0.0, 1.0, np.nan, 2.0], [2.0, 0.5, -1.0], [], [np.inf, 3.0, 4.0, 4.0], [3.5]):
        compiled.kernel.look(swings, 1, np.array(part))
    assert swings[1].tolist() == (4.0, 3.5, 4.0, 5.0, -1, 3, 1)
    assert swings[0].tolist() == (0.0, 0.0, 0.0, 0.0, 0, 0, 0)


@pytest.mark.parametrize(
    ("swings", "number", "values"),
    [
        (np.zeros(2, SWING), 2, np.zeros(1)),
        (np.zeros(2, SWING), -1, np.zeros(1)),
        (np.zeros(57, np.uint8)[1:], 0, np.zeros(1)),
        (np.zeros(1, SWING), 0, np.zeros(9, np.uint8)[1:]),
    ],
)
def test_swings_that_are_not_there_are_refused(swings, number, values):
    with pytest.raises(ValueError, match=r"^kernel: there are no such swings"):
        compiled.kernel.look(swings, number, values)
    with pytest.raises(TypeError):
        compiled.kernel.look("swings", number, values)


@pytest.mark.skipif(not getattr(compiled.kernel, "HAS_THREADS", 0), reason="no threads here")
def test_memory_and_threads_that_cannot_be_had(scarce_kernel, odd, ring, instantiated):
    """Each request in turn is refused; then nothing is left behind, and the same call succeeds."""
    kernel, left = scarce_kernel
    said = []
    for threads in (1, 3):
        master = instantiated(ring(odd, 3))
        master.coupling.settings = Settings(threads=threads)
        values = np.array(master.values)
        plan = CompiledLoop(master.coupling, master.algorithm).plan.arrays
        table, places = np.empty((len(values) + 1, 4)), np.array([(0, -1, 0)] * threads, PLACE)
        kept, history = np.arange(len(values)), np.tile(values, (2, 1))
        state = np.zeros(0, CHANGES), kept, values, history, 1, table, 0, places
        for left.value in range(20):
            try:
                found = kernel.run(*plan, *state, np.zeros(len(plan[0]), np.int64), FIXED, None, 1, 0.0, 0.25, 0, 4, 4)
            except (MemoryError, RuntimeError) as error:
                said.append(f"{type(error).__name__} {error}")
            else:
                assert found == (4, 4, 1)
                break
        left.value = -1
        for slave in master.slaves.values():
            slave.free()
    assert said == ["MemoryError "] * 16 + ["RuntimeError kernel: no more threads can be started"] * 3


def test_a_kernel_of_another_version_is_refused():
    """One that was compiled before the sources changed would read the plan wrongly."""
    compiled._check_layout(compiled.kernel.LAYOUT)
    with pytest.raises(RuntimeError, match=r"of another version than its Python files: install the package again"):
        compiled._check_layout(compiled.kernel.LAYOUT + 1)


# -------------------------------------------------------------------- the compiler's and the sanitizers' word


@pytest.mark.parametrize("flags", [["-O2"], ["-O3", "-std=c11"]])
def test_the_compiler_has_nothing_to_say(compile_kernel, tmp_path, flags):
    compile_kernel(tmp_path / "kernel.so", *flags)


PARTS = (
    "test_varying.py",
    *("test_compiled.py", "test_compiled_blocks.py", "test_compiled_coupling.py", "test_compiled_fmi3.py"),
    "test_compiled_texts.py",
    *("test_kernel.py", "test_threads.py", "algebraic/test_solving.py", "algebraic/test_checking.py"),
)
SANITIZERS = {
    ("address", "undefined"): (
        "not sanitized and not compiler and not ctrl_c and not without_the_extension and not short_in_time "
        "and not isolated"  # it calls functions of another library
    ),
    ("thread",): "threads_give or several_threads or discarded or first_is_told or rounded",
}
"""Which of the tests of the compiled loop run under which sanitizers."""


@pytest.mark.long
@pytest.mark.parametrize("sanitizers", SANITIZERS, ids="+".join)
def test_sanitized(compile_kernel, tmp_path, sanitizers):
    """The tests of the compiled loop under the compiler's sanitizers."""
    flags = "-g", "-O1", f"-fsanitize={','.join(sanitizers)}", "-fno-sanitize-recover"
    library = compile_kernel(tmp_path / "kernel.so", *flags)
    preload = [
        subprocess.run(
            [GCC, f"-print-file-name=lib{name}.so"], check=True, capture_output=True, text=True
        ).stdout.strip()
        for name in (f"{sanitizer[0] if sanitizer != 'undefined' else 'ub'}san" for sanitizer in sanitizers)
    ]
    chosen = SANITIZERS[sanitizers]
    command = [sys.executable, "-m", "pytest", "-p", "own_kernel", "-p", "no:cacheprovider", "-n", "0", "-k", chosen]
    environment = os.environ | {
        "KERNEL": str(library),
        "PYTHONPATH": str(Path(__file__).parent),
        "LD_PRELOAD": ":".join(preload),
        "ASAN_OPTIONS": "detect_leaks=0",
        "UBSAN_OPTIONS": "print_stacktrace=1",
        "PYTHONMALLOC": "malloc",
    }
    done = subprocess.run(
        [*command, *(Path(__file__).resolve().parent / name for name in PARTS)],
        env=environment,
        check=False,
        capture_output=True,
        text=True,
        cwd=FOREIGN.parents[2],
    )
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    assert "passed" in done.stdout
    assert "WARNING: ThreadSanitizer" not in done.stderr + done.stdout
    assert "runtime error" not in done.stderr + done.stdout
