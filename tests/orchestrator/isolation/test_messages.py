"""What master and host say to each other: frames over a socket, values in shared memory, errors as plain values."""

import mmap
import socket
import struct
import threading

import pytest
from railcosim.orchestrator.errors import FmuError, StoppedError
from railcosim.orchestrator.isolation import messages
from railcosim.orchestrator.isolation.messages import (
    CALL,
    DONE,
    Cells,
    Door,
    Report,
    as_error,
    content,
    describe,
    frame,
)


@pytest.fixture(params=["pair", "tcp"])
def doors(request):
    """Both ends, of the two kinds of sockets that are used."""
    if request.param == "pair":
        ends = socket.socketpair()
    else:
        with socket.create_server(("127.0.0.1", 0)) as server:
            near = socket.create_connection(server.getsockname())
            ends = near, server.accept()[0]
    made = [Door(end) for end in ends]
    yield made
    for door in made:
        door.close()


def test_a_frame_is_its_kind_its_length_and_what_follows():
    made = frame(CALL, ["step", 0.5])
    assert struct.unpack("<BI", made[:5]) == (CALL, len(made) - 5)
    assert content(made[5:]) == ["step", 0.5]
    assert bytes([DONE, 0, 0, 0, 0]) == messages.ANSWER


@pytest.mark.parametrize("size", [0, 1, 1 << 15, (1 << 16) - 6, 1 << 16, (1 << 16) + 1, 3_000_000])
def test_frames_arrive_whole_and_in_order_however_long_they_are(doors, size):
    """Also what comes close behind: the next frame begins where the last one ends."""
    one, other = doors
    bodies = [b"a" * size, b"b", b"c" * (size // 2)]
    sent = b"".join(struct.pack("<BI", k, len(body)) + body for k, body in enumerate(bodies))
    sender = threading.Thread(target=one.send, args=(sent,))
    sender.start()
    assert [other.receive() for _ in bodies] == [(k, body) for k, body in enumerate(bodies)]
    sender.join()


def test_frames_arrive_in_pieces(doors):
    one, other = doors
    for byte in struct.pack("<BI", 6, 3):
        one.send(bytes([byte]))
    for byte in b"xyz":
        one.send(bytes([byte]))
    assert other.receive() == (6, b"xyz")


@pytest.mark.parametrize(
    "begun", [b"", b"\x01", struct.pack("<BI", 1, 5) + b"12", struct.pack("<BI", 1, 1 << 20) + b"12"]
)
def test_an_end_in_the_middle_is_told(doors, begun):
    one, other = doors
    one.send(begun)
    one.close()
    with pytest.raises(EOFError):
        other.receive()


def test_whoever_waits_is_told_of_each_moment_of_silence_and_may_give_up(doors):
    """Nothing is lost by that: what had come stays, and what is not yet sent is sent after."""
    one, other = doors
    moments = []

    def wait():
        moments.append(1)
        if len(moments) == 2:
            one.send(b"23")
        elif len(moments) == 4:
            raise InterruptedError("enough")

    patient = Door(other._end, wait, 0.02)
    one.send(struct.pack("<BI", 1, 3) + b"1")
    assert patient.receive() == (1, b"123")
    assert len(moments) == 2
    with pytest.raises(InterruptedError):
        patient.receive()
    moments[:] = [1, 1, 1]
    with pytest.raises(InterruptedError):
        patient.send(bytes(1 << 26))  # whom nobody reads


@pytest.mark.parametrize("begun", [b"hello", b"\x09\x00\x00\x00\x00", struct.pack("<BI", 200, 1 << 31)])
def test_what_begins_no_frame_is_not_waited_for(doors, begun):
    one, other = doors
    one.send(begun)
    with pytest.raises(ValueError, match="no frame begins with b'"):
        other.receive()


def test_notes_tell_call_channel_and_part_apart():
    assert messages.noted(messages.note("set", 300, 7)) == ("set", 300, 7)
    assert messages.noted(messages.note("terminate")) == ("terminate", 0, 0)
    assert messages.noted(-1)[0] == messages.noted(0)[0] == ""
    assert len({messages.note(call) for call in messages.CALLS}) == len(messages.CALLS)


@pytest.mark.parametrize(
    ("kind", "values", "layout"),
    [("Real", [1.5, -0.0, 1e308], "=3d"), ("Integer", [-(2**63), 2**63 - 1], "=2q"), ("Boolean", [0, 1], "=2q")],
)
def test_values_stand_in_the_memory_as_c_has_them(kind, values, layout):
    with mmap.mmap(-1, 4096) as memory:
        cells = Cells(memory, 64, kind, len(values))
        assert cells.write(values)
        assert memory[64 : 64 + 8 * len(values)] == struct.pack(layout, *values)
        assert cells.read() == values
        assert not any(memory[:64])


@pytest.mark.parametrize(
    ("kind", "values"), [("Integer", [2**63]), ("Integer", [1.5]), ("Real", [1.0, 2.0]), ("Real", ["1"])]
)
def test_values_that_do_not_fit_go_another_way(kind, values):
    with mmap.mmap(-1, 4096) as memory:
        assert not Cells(memory, 64, kind, 1).write(values)


@pytest.mark.parametrize(
    ("used", "limit", "hint"),
    [
        (100.0, None, ""),
        (512.0, 1024.0, ""),
        (1536.0, 2048.0, "; it had 2 of the 2 MiB that memory_limit allows: a likely reason"),
        (61440.0, 102400.0, "; it had 60 of the 100 MiB that memory_limit allows: a likely reason"),
    ],
)
def test_memory_is_named_where_much_of_it_is_used(used, limit, hint):
    assert messages.memory_hint(used, limit) == hint


@pytest.mark.parametrize("kind", [FmuError, StoppedError])
def test_an_error_comes_back_as_it_was(kind):
    error = kind("no more", instance="a", time=2.5, status="error", log=["[error] no"])
    again = as_error(content(frame(0, describe(error))[5:]), "b", 1.0)
    assert type(again) is kind
    assert (str(again), again.instance, again.time, again.status) == (str(error), "a", 2.5, "error")
    assert again.log == ["[error] no"]


def test_any_other_error_is_one_of_the_fmu_s():
    again = as_error(describe(ZeroDivisionError("by zero")), "a", 2.5)
    assert type(again) is FmuError
    assert str(again) == "a, t = 2.5 s: ZeroDivisionError: by zero"


def test_what_goes_to_the_other_comes_there_to_the_bit():
    told = [0.1, -0.0, 1e-320, float("inf"), 2**64, "a\udcff\0", b"\0\xff", None, True, {"x": [b""]}]
    assert repr(content(frame(CALL, told)[5:])) == repr(told)
    with pytest.raises(TypeError, match="a set goes into no message"):
        frame(CALL, {1})


@pytest.mark.parametrize(
    "body",
    [
        *(b"", b"\x80\x04.", b"[]", b"{}", b"[" * 100_000, b'{"time": "late"}', b'{"time": 0, "texts": [[1, 2]]}'),
        *(b'{"time": 0, "error": {}}', b'{"time": 0, "failed": [1, {"message": 2}]}'),
    ],
)
def test_what_is_no_report_is_refused(body):
    with pytest.raises(ValueError, match="Error: "):
        Report.read(body, "a")
