"""Lines in a terminal and in a pipe."""

from railcosim.orchestrator.cli.printing import folded, open_console, say
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
