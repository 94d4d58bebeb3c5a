"""Signals end a run: in order at the first, at once at the second, whatever goes on."""

import hashlib
import os
import signal
import socket
import sys
import threading
import time

import pytest
from railcosim.orchestrator import System, run, world
from railcosim.orchestrator.fmi.guard import NOTES
from railcosim.orchestrator.run import Results
from railcosim.orchestrator.run.ending import interruption
from railcosim.orchestrator.run.ending.interruption import Interruption

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals")
ALL = [signal.SIGINT, signal.SIGTERM, signal.SIGHUP]


@pytest.fixture
def quick(monkeypatch):
    """Signals that come quickly are two; and there is time to answer them, or the tests themselves would end."""
    monkeypatch.setattr(interruption, "_TOGETHER", 0.02)
    monkeypatch.setattr(interruption, "_PATIENCE", 60.0)


def send(*times, number=signal.SIGINT):
    """Signals after some times, in s."""

    def go():
        for pause in times:
            time.sleep(pause)
            os.kill(os.getpid(), number)

    threading.Thread(target=go).start()


@pytest.fixture
def system(mine):
    made = System(step=0.1, stop_time=1.0)
    made.add("plant", mine("Lag"))
    return made


@pytest.mark.parametrize("number", ALL)
def test_a_signal_ends_a_run_in_order(system, tmp_path, number):
    before = signal.getsignal(number)
    outcome = run(
        system,
        kind="plain",
        output=tmp_path,
        progress=lambda now, _: os.kill(os.getpid(), number) if 0.25 < now < 0.35 else None,
    )
    assert (outcome.status, outcome.signal) == ("interrupted", number)
    assert outcome.time[-1] == pytest.approx(0.3)
    assert Results.load(tmp_path).time[-1] == outcome.time[-1]
    assert signal.getsignal(number) is before


@pytest.mark.parametrize("number", ALL)
def test_one_that_is_ignored_stays_ignored(system, number):
    before = signal.signal(number, signal.SIG_IGN)
    try:
        outcome = run(system, kind="plain", progress=lambda *_: os.kill(os.getpid(), number))
        assert (outcome.status, outcome.signal) == ("completed", 0)
        assert signal.getsignal(number) is signal.SIG_IGN
    finally:
        signal.signal(number, before)


def test_an_application_s_own_handler_is_told_after_the_run(system):
    heard = []
    before = signal.signal(signal.SIGTERM, lambda number, _: heard.append(number))
    try:
        outcome = run(system, kind="plain", progress=lambda *_: (os.kill(os.getpid(), signal.SIGTERM), heard and 1 / 0))
    finally:
        signal.signal(signal.SIGTERM, before)
    assert outcome.status == "interrupted"
    assert heard == [signal.SIGTERM]


def test_an_event_loop_hears_of_signals_that_are_not_for_a_run(system):
    near, far = socket.socketpair()
    near.setblocking(False)
    woken = signal.set_wakeup_fd(near.fileno())
    before = signal.signal(signal.SIGUSR1, lambda *_: None)
    try:
        it = Interruption(lambda _: None)
        with it.listening():
            os.kill(os.getpid(), signal.SIGUSR1)
        assert far.recv(10) == bytes([signal.SIGUSR1])
        assert signal.set_wakeup_fd(woken) == near.fileno()
    finally:
        signal.signal(signal.SIGUSR1, before)
        near.close()
        far.close()
    assert it.number == 0


def test_signals_at_the_same_time_are_one():
    """A terminal, a shell and a parent may each pass on what was pressed once."""
    it = Interruption(lambda _: None)
    with it.listening():
        for _ in range(3):
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(0.02)
    assert it.is_asked_for


def test_a_second_one_is_an_exception(quick):
    it = Interruption(lambda _: None)
    with it.listening():
        send(0.0, 0.05)
        with pytest.raises(KeyboardInterrupt):
            time.sleep(5.0)
        time.sleep(0.1)  # the watch may be about to insist
    assert it.number == signal.SIGINT


def test_one_that_finds_no_way_back_to_python_ends_the_process(quick, monkeypatch, caplog):
    """Here the process goes on after its end, so that the test can see it."""
    ends, saved = [], []
    monkeypatch.setattr(interruption, "_PATIENCE", 0.05)
    monkeypatch.setattr(world, "exit_at_once", ends.append)
    it = Interruption(lambda why: saved.append(why) or 1 / 0)
    with pytest.raises(KeyboardInterrupt):
        hang(it)
    assert ends[0] == 128 + signal.SIGTERM == NOTES.decided
    assert saved[0] == "interrupted: what goes on does not end"
    assert "isolate what hangs" in caplog.text
    assert "ZeroDivisionError" in caplog.text
    NOTES.decide(-1)


def hang(it):
    """Be in C for a second or so, whatever signals come: more of them than two, lest two are taken for one."""
    with it.listening():
        send(0.05, 0.1, 0.1, 0.1, number=signal.SIGTERM)
        hashlib.pbkdf2_hmac("sha256", b"", b"", 2_500_000)


def test_in_another_thread_it_does_nothing():
    it, before = Interruption(lambda _: None), signal.getsignal(signal.SIGINT)

    def listen():
        with it.listening():
            assert signal.getsignal(signal.SIGINT) is before

    thread = threading.Thread(target=listen)
    thread.start()
    thread.join()
    assert signal.getsignal(signal.SIGINT) is before
    it.pass_on()
