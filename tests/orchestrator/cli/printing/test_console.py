"""Lines in a terminal and in a pipe."""

import logging

import pytest
from railcosim.orchestrator.cli.lines import Log, folded, tell
from railcosim.orchestrator.cli.printing import open_console, say
from railcosim.orchestrator.cli.printing.tables import table
from railcosim.orchestrator.names import SignalName
from railcosim.orchestrator.problems import Problem


def test_problems_that_differ_in_the_index_only_are_told_once():
    names = [SignalName(f"train[{k}]", "a") for k in (1, 2)]
    first, second = (Problem(f"x.toml:3: {name}", "wrong", names=(name,)) for name in names)
    other = Problem("x.toml:4: train[1].a", "wrong", names=(names[0],))
    assert folded([first, second, other]) == [f"{first} (and 1 more like it, for other indices)", str(other)]


def test_notes_that_differ_in_the_index_only_are_told_once():
    assert folded(["train[1].a: so", "train[2].a: so"]) == ["train[1].a: so (and 1 more like it, for other indices)"]


def test_in_a_pipe_lines_are_not_folded_and_columns_sets_the_width(monkeypatch, capsys):
    monkeypatch.delenv("COLUMNS", raising=False)
    assert open_console().width == 160
    say(open_console(), "word " * 60)
    assert len(capsys.readouterr().out.splitlines()) == 1
    monkeypatch.setenv("COLUMNS", "70")
    assert open_console().width == 70


HOSTILE = {
    "\x1b[31mred": r"\x1b[31mred",
    "\x1b]0;title\x07": r"\x1b]0;title\x07",
    "\x9b2J": r"\x9b2J",
    "a\rb\x08": r"a\rb\x08",
    "\u202egpj.exe": r"\u202egpj.exe",
    "\u2066x": r"\u2066x",
    "\ud800": r"\ud800",
}
"""What would steer a terminal, and how it is shown."""


@pytest.mark.parametrize(("text", "shown"), HOSTILE.items())
def test_what_comes_from_outside_steers_no_terminal(text, shown, capsys):
    made = table(text, [text])
    made.add_row(text)
    say(open_console(), f"say {text}")
    open_console().print(made)
    tell(f"tell {text}")
    Log().emit(logging.LogRecord("", logging.WARNING, "", 0, "%s", (f"log {text}",), None))
    out, err = capsys.readouterr()
    assert out.count(shown) == 4 or "\x07" in text or "\r" in text  # which Rich leaves out
    assert out.replace("\n", "").isprintable()
    assert err == f"tell {shown}\nwarning: log {shown}\n"


def test_letters_of_any_language_and_our_own_colours_are_left_alone(capsys, monkeypatch):
    monkeypatch.setenv("FORCE_COLOR", "1")
    say(open_console(), "Zürich\u00a0\u2192 北京 \N{SNOWMAN}", "red")
    assert capsys.readouterr().out == "\x1b[31mZürich\u00a0\u2192 北京 \N{SNOWMAN}\x1b[0m\n"
