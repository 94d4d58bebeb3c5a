"""Lines in a terminal and in a pipe."""

from railcosim.orchestrator.cli.printing import folded, open_console, say


def test_problems_that_differ_in_the_index_only_are_told_once():
    problems = ["x.toml:3: train[1].a: wrong", "x.toml:3: train[2].a: wrong", "x.toml:4: train[1].a: wrong"]
    assert folded(problems) == [f"{problems[0]} (and 1 more like it, for other indices)", problems[2]]


def test_in_a_pipe_lines_are_not_folded_and_columns_sets_the_width(monkeypatch, capsys):
    monkeypatch.delenv("COLUMNS", raising=False)
    assert open_console().width == 160
    say(open_console(), "word " * 60)
    assert len(capsys.readouterr().out.splitlines()) == 1
    monkeypatch.setenv("COLUMNS", "70")
    assert open_console().width == 70
