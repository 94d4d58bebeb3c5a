"""What is told of a run that goes on."""

import io
import logging
import sys
import threading
from functools import partial

import pytest
from railcosim.fmus import toolchain
from railcosim.orchestrator.cli.printing import progress as progress_module
from railcosim.orchestrator.cli.printing import show_cases, show_compilations, show_meshes, show_progress


class Terminal(io.StringIO):
    """A stream that says it is one."""

    def isatty(self):
        return True


def test_progress_starts_at_the_start_time(capsys):
    with show_progress("late", False, start=100.0) as progress:
        lines = {}
        for time in (100.0, 104.0, 110.0):
            progress(time, 110.0)
            lines[time] = capsys.readouterr().err.splitlines()
    told = [f"late: {percent} % of 10 s" for percent in range(10, 101, 10)]
    assert lines == {100.0: [], 104.0: told[:4], 110.0: told[4:]}
    with show_progress("micro", False, start=1.7e9) as progress:
        progress(1700000010.1, 1700000010.1)
    assert capsys.readouterr().err.splitlines()[-1] == "micro: 100 % of 10.1 s"
    with show_progress("quiet", True) as progress:
        assert progress is None


def test_on_a_terminal_the_writing_of_results_is_shown(monkeypatch, at_once):
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    with show_progress("run", False) as progress:
        progress(1.0, 10.0)
        progress.writing(300, 1000)
    assert "results.csv" in terminal.getvalue()
    assert "300 of 1000 rows" in terminal.getvalue()


def compile_something():
    logging.getLogger(toolchain.__name__).info("%s: compiling for %s", "Gust\x1b[2J", "win64")


@pytest.mark.parametrize(
    ("show", "quiet", "lines"),
    [
        (show_compilations, False, ["Gust\\x1b[2J: compiling for win64"]),
        (show_compilations, True, []),
        (partial(show_progress, "run"), False, ["Gust\\x1b[2J: compiling for win64"]),
        (partial(show_progress, "run"), True, []),
    ],
)
def test_without_a_terminal_each_compilation_is_a_line(show, quiet, lines, capsys):
    with show(quiet=quiet):
        compile_something()
    compile_something()
    assert capsys.readouterr().err.splitlines() == lines


def test_on_a_terminal_a_compilation_shows_its_time(monkeypatch):
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    with show_compilations(quiet=False):
        compile_something()
    assert "compiling for win64" in terminal.getvalue()
    assert "0:00:0" in terminal.getvalue()


@pytest.mark.parametrize(("long", "shown"), [(0.0, True), (60.0, False)])
def test_on_a_terminal_what_takes_long_is_told(monkeypatch, long, shown):
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    monkeypatch.setattr(progress_module, "_LONG", long)
    before = set(threading.enumerate())
    with show_compilations(quiet=False, doing="reading [bold]a.fmu"):
        for thread in set(threading.enumerate()) - before:
            if isinstance(thread, threading.Timer) and shown:
                thread.join()
    assert ("reading [bold]a.fmu" in terminal.getvalue()) == shown


def test_the_bar_over_many_cases_is_for_a_terminal(capsys):
    with show_cases(2, False) as tell:
        tell("first")
        compile_something()
        tell("second")
    assert capsys.readouterr() == ("", "Gust\\x1b[2J: compiling for win64\n")


def test_on_a_terminal_the_bar_names_what_runs(monkeypatch, at_once):
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    with show_cases(2, False) as tell:
        tell("first")
        tell("second")
    assert "1 of 2" in terminal.getvalue()
    assert "second" in terminal.getvalue()


@pytest.mark.parametrize("quiet", [False, True])
def test_the_meshes_of_an_optimum_are_a_bar_on_a_terminal(monkeypatch, at_once, quiet):
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    with show_meshes("a hop\x1b[2J", quiet, 10) as solved:
        solved(3, 120)
    shown = terminal.getvalue()
    assert ("3 meshes solved, 120 intervals" in shown) == (not quiet)
    assert "\x1b[2J" not in shown


def test_without_a_terminal_meshes_are_not_told(capsys):
    with show_meshes("hop", False, 10) as solved:
        solved(3, 120)
    assert capsys.readouterr() == ("", "")
