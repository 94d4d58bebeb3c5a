"""state.c: reruns, saved states and their bytes."""

import ctypes
import json
import math
import sys
from ctypes import byref, c_size_t, c_void_p
from pathlib import Path

from railcosim.fmus.build import build

SAMPLES = Path(__file__).parents[1] / "native_samples.py"
MIXED = f"{SAMPLES}:Mixed"
BREAKS = f"{Path(__file__).parent / 'samples.py'}:Breaks"
OK = 0
ERROR = 3
STEP = 0.25
NULL = None


# ---------------------------------------------------------------- the calling sequence


def one(cell, value=0):
    return (cell * 1)(value)


# ---------------------------------------------------------------- errors


def test_after_an_error_a_saved_state_or_a_reset_goes_on(load):
    fmu = load(BREAKS).initialize(rate=0.1)
    good = fmu.save()
    assert fmu.step() == OK
    expected = fmu.get("x")
    assert fmu.set("u", 0.0) == OK
    assert fmu.step() == ERROR
    assert fmu.SetFMUstate(good) == OK
    fmu.time = 0.0  # and not "going backwards"
    assert fmu.step() == OK
    assert fmu.get("x") == expected
    assert fmu.set("u", 0.0) == OK
    assert fmu.step() == ERROR
    assert fmu.Reset() == OK
    fmu.initialize(rate=0.1)
    assert fmu.step() == OK
    assert fmu.get("x") == expected
    assert fmu.FreeFMUstate(byref(good)) == OK


# ---------------------------------------------------------------- reruns and saved states


def drive(fmu, first, count):
    """Steps of the mixed component, its inputs a function of the step: rides of three steps, waits of two."""
    rows = []
    for k in range(first, first + count):
        values = {"u[1]": math.sin(k), "u[2]": math.cos(3 * k), "count": k % 7, "door": int(k // 5 % 3 == 1)}
        values |= {"trip": 1 + k // 5, "trip_time": (k % 5 - 2) * STEP, "remark": f"step {k}"}
        for name, value in values.items():
            assert fmu.set(name, value) == OK, fmu.said
        assert fmu.step() == OK, fmu.said
        rows.append(json.dumps(fmu.everything(), default=bytes.decode))
    return rows


def mixed(load, **starts):
    return load(MIXED).initialize(seed=5, tape_duration=2.0, tape_cutoff=0.8, label="start", **starts)


def test_reset_makes_the_rerun_identical(load):
    fmu = mixed(load)
    first = drive(fmu, 0, 20)
    assert len(set(first)) == 20
    assert fmu.Reset() == OK
    fmu.initialize(seed=5, tape_duration=2.0, tape_cutoff=0.8, label="start")
    assert drive(fmu, 0, 20) == first
    assert fmu.Reset() == OK
    fmu.initialize()
    assert drive(fmu, 0, 20) != first  # reset took the parameters back as well


def test_a_restored_state_goes_on_identically_and_may_go_back_in_time(load):
    fmu = mixed(load)
    drive(fmu, 0, 7)
    state = fmu.save()
    expected = drive(fmu, 7, 9)
    for _ in range(2):
        assert fmu.SetFMUstate(state) == OK
        fmu.time = 7 * STEP
        assert drive(fmu, 7, 9) == expected
    before = fmu.to_bytes(state)
    address = state.value
    assert fmu.GetFMUstate(byref(state)) == OK  # overwritten in place
    assert state.value == address
    assert fmu.to_bytes(state) != before
    fmu.FreeFMUstate(byref(state))


def test_a_saved_state_holds_the_outputs_that_are_held(load):
    fmu = mixed(load)
    drive(fmu, 0, 3)
    expected = fmu.everything()
    state = fmu.save()
    drive(fmu, 3, 2)
    other = load(MIXED).initialize()
    for instance in (fmu, other):  # the other has a tape of another length
        assert instance.SetFMUstate(state) == OK
        assert instance.everything() == expected
    fmu.FreeFMUstate(byref(state))


def test_equal_states_are_equal_bytes(load):
    one, two = mixed(load), mixed(load)
    drive(one, 0, 6)
    two.set("label", "x" * 500)
    drive(two, 0, 2)
    two.Reset()
    two.initialize(seed=5, tape_duration=2.0, tape_cutoff=0.8, label="start")
    drive(two, 0, 6)
    states = [fmu.save() for fmu in (one, two)]
    assert one.to_bytes(states[0]) == two.to_bytes(states[1])
    for fmu, state in zip((one, two), states, strict=True):
        fmu.FreeFMUstate(byref(state))


def test_a_state_saved_before_initialization_can_be_restored(load):
    fmu = load(MIXED)
    state = fmu.save()
    mixed_rows = drive(fmu.initialize(tape_duration=2.0), 0, 6)
    assert fmu.SetFMUstate(state) == OK
    assert drive(fmu.initialize(tape_duration=2.0), 0, 6) == mixed_rows
    fmu.FreeFMUstate(byref(state))


def test_a_state_of_another_length_makes_way(load):
    """A tape of other length needs more room than the state that is handed in for reuse has."""
    short, long = (load(MIXED).initialize(seed=5, tape_duration=duration) for duration in (1.0, 4.0))
    drive(long, 0, 3)
    state = short.save()
    before = len(short.to_bytes(state))
    assert long.GetFMUstate(byref(state)) == OK
    assert len(long.to_bytes(state)) > before
    rows = drive(long, 3, 4)
    assert long.SetFMUstate(state) == OK
    long.time = 3 * STEP
    assert drive(long, 3, 4) == rows
    long.FreeFMUstate(byref(state))


def test_bytes_that_are_no_state_are_refused(load):
    fmu, train = mixed(load), load("PointMassTrain").initialize()
    drive(fmu, 0, 3)
    state = fmu.save()
    content = fmu.to_bytes(state)
    assert fmu.SerializeFMUstate(state, (ctypes.c_char * len(content))(), c_size_t(len(content) - 1)) == ERROR
    size = int.from_bytes(content[64:72], sys.byteorder)
    heads = [content[:64] + number.to_bytes(8, sys.byteorder) + content[72:] for number in (size - 1, size + 1, 0)]
    heads.append(content[:76] + b"\xff" * 4 + content[80:])  # a negative number of rows
    heads.append(b"{" + b"0" * 36 + content[37:])
    for bad in (
        *heads,
        b"",
        b"x",
        content[:-1],
        content[:50],
        b"x" * len(content),
        content[:64] + b"\xff" * 16 + content[80:],
    ):
        assert fmu.from_bytes(bad) == ERROR
    assert train.from_bytes(content) == ERROR
    assert train.SetFMUstate(state) == ERROR
    assert "another model" in train.said
    assert fmu.SetFMUstate(NULL) == ERROR
    assert fmu.GetFMUstate(NULL) == ERROR
    assert fmu.SerializedFMUstateSize(NULL, byref(c_size_t())) == ERROR
    assert fmu.SerializedFMUstateSize(state, NULL) == ERROR
    assert fmu.SerializeFMUstate(NULL, content, c_size_t(len(content))) == ERROR
    assert fmu.SerializeFMUstate(state, NULL, c_size_t(len(content))) == ERROR
    assert fmu.DeSerializeFMUstate(NULL, c_size_t(len(content)), byref(c_void_p())) == ERROR
    assert fmu.DeSerializeFMUstate(content, c_size_t(len(content)), NULL) == ERROR
    assert fmu.FreeFMUstate(NULL) == OK
    assert fmu.FreeFMUstate(byref(c_void_p())) == OK
    copy = fmu.from_bytes(content + b"more")  # an importer may round a buffer's length up
    assert fmu.SetFMUstate(copy) == OK
    for one_of in (state, copy):
        fmu.FreeFMUstate(byref(one_of))


CONTINUE = """
fmu = bare.Fmu(Path(sys.argv[3]))
state = fmu.from_bytes(open(sys.argv[4], "rb").read())
assert fmu.SetFMUstate(state) == 0
fmu.time = 10 * tests.STEP
print("\\n".join(tests.drive(fmu, 10, 10)))
"""


def test_a_serialized_state_goes_on_identically_in_a_fresh_process(load, tmp_path, unpack, in_another_process):
    fmu = mixed(load)
    drive(fmu, 0, 10)  # to the end of a ride that is not yet committed
    state = fmu.save()
    (tmp_path / "state").write_bytes(fmu.to_bytes(state))
    fmu.FreeFMUstate(byref(state))
    folder = unpack(build(MIXED, kind="native"))
    other = in_another_process(CONTINUE, __file__, folder, tmp_path / "state")
    assert other.splitlines() == drive(fmu, 10, 10)


def test_two_instances_do_not_know_of_each_other(load):
    alone = [drive(mixed(load, gain=gain), 0, 15) for gain in (0.5, 1.5)]
    pair = [mixed(load, gain=gain) for gain in (0.5, 1.5)]
    interleaved = [[], []]
    for k in range(15):
        for rows, fmu in zip(interleaved, pair, strict=True):
            rows.extend(drive(fmu, k, 1))
    assert interleaved == alone
