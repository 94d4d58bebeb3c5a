"""What is noted of calls that are under way, and what another process reads of it."""

import os

import pytest
from railcosim.orchestrator.fmi.guard.notes import Notes, Seen, described


@pytest.fixture
def notes():
    made = Notes()
    made.tell(4096, "train[1]", "Lag")
    made.tell(8192, "fmi2DoStep")
    return made


def note(notes, number, instance, function, time):
    begin, _ = notes.place
    notes.memory[begin + 64 * number : begin + 64 * number + 24] = (
        instance.to_bytes(8, "little") + function.to_bytes(8, "little") + memoryview(bytearray(8))
    )
    memoryview(notes.memory).cast("d")[(begin + 64 * number) // 8 + 2] = time


def test_calls_in_words(notes):
    assert notes.under_way() == []
    note(notes, 0, 4096, 8192, 2.0)
    note(notes, 7, 16, 0, float("-inf"))
    seen = notes.under_way()
    assert seen == [Seen("train[1]", "Lag", "fmi2DoStep", 2.0), Seen("", "", "", None)]
    assert described(seen) == "train[1] (Lag) in fmi2DoStep at t = 2 s or an FMU"


def test_a_number_stands_for_what_was_said_last(notes):
    notes.tell(4096, "train[2]", "Lead")
    assert notes.seen(4096, 0, 0.0)[:2] == ("train[2]", "Lead")
    notes.forget()
    assert notes.seen(4096, 8192, 0.0) == Seen("", "", "", 0.0)


def test_what_an_fmu_has_written_there_is_passed_over(notes):
    begin, count = notes.place
    notes.memory[begin + 64 * count] = 0
    assert notes.seen(4096, 8192, 0.0) == Seen("", "", "fmi2DoStep", 0.0)


def test_a_table_that_is_full_takes_no_more(notes):
    notes.tell(1, "x" * (16 << 20))
    assert notes.seen(1, 1, 0.0).call == ""
    assert notes.seen(1, 8192, 0.0).call == "fmi2DoStep"


def test_the_directory_and_the_verdict(notes):
    assert (notes.directory, notes.decided) == ("", None)
    notes.directory = "out"
    notes.decide(130)
    assert (notes.directory, notes.decided) == ("out", 130)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
def test_it_is_shared_with_the_next_process_and_no_other(notes):
    assert notes.begin_anew() is None
    notes.share()
    notes.begin_anew()
    notes.decide(3)
    shared = notes.memory
    notes.begin_anew()
    assert notes.memory is not shared
    assert notes.decided is None
