"""What is said of studies and searches: how they came out, and commands that give them again."""

import shlex

import pytest
from railcosim.orchestrator.cli import app as cli
from railcosim.orchestrator.errors import ScenarioError
from railcosim.orchestrator.report.studies.told import command_of_study, told_of_search, told_of_study
from railcosim.orchestrator.study.campaign import Study


def test_a_study(study):
    directory = study()
    told = told_of_study(directory)
    assert told.title == "Lags <b>$$x$$</b>"
    assert (told.state, told.is_whole) == ("6 of 6 runs, completed", True)
    assert told.varied == ["lag.u", "lag.x"]
    assert told.replay == f"orchestrate replay {directory} --run "
    assert dict(told.facts)["design"] == "random, 6 runs, seed 3"
    assert len(told.frame) == 6
    assert [one.name for one in told.summary.requirements] == ["<i>low", "never"]


def test_the_command_gives_the_same_study_again(study, monkeypatch, tmp_path):
    directory = study(settings=["lag.rate=2.0"], stop_time=0.5, preset=None)
    told = Study.load(directory).told
    program, *words = shlex.split(command_of_study(told))
    assert (program, words[0]) == ("orchestrate", "study")
    again = tmp_path / "again"
    assert cli.call([*words, "-o", str(again), "--workers", "0", "--no-figures", "-q"]) == 1
    assert Study.load(again).told["plan"] == told["plan"]
    first, second = (Study.load(path).frame().drop(columns="seconds") for path in (directory, again))
    assert first.equals(second)


def test_a_grid_has_no_number_of_runs():
    plan = '{"design": "grid", "count": 2, "seed": 0, "dimensions": [{"name": "cruise", "values": ["A, b", "C"]}]}'
    command = command_of_study({"how": {"scenario": "x y.toml", "swaps": ["a=b"]}, "plan": plan})
    assert shlex.split(command) == [
        *("orchestrate", "study", "x y.toml", "--swap", "a=b", "--vary", 'cruise="A, b","C"', "--seed", "0"),
        *("--design", "grid"),
    ]


def test_a_falsification(search):
    found = {"changes": {"lag.u": 1.0}, "margin": -0.5, "time": 0.75, "runs": 3, "nearest": {"run": 0, "margin": -0.5}}
    directory = search(requirement="low", broken=True, **found)
    told = told_of_search(directory)
    assert told.title == "Search for a run that breaks low"
    assert told.state == "3 runs; it is broken"
    assert told.axes == ("run", "margin.low")
    command = f"orchestrate run {directory / 'counterexample.toml'}"
    assert told.found == ((-1, "counterexample, margin -0.5 at 0.75 s: lag.u = 1.0", command),)
    assert told.varied == ["lag.u", "lag"]
    nominal = f"orchestrate run {directory / 'nominal.toml'}"
    assert told.commands == [f"{nominal} --set lag.u=1.0 --swap lag=Other", f"{nominal} --set lag.u=0.5", nominal]
    (nearest,) = told_of_search(search(requirement="low", broken=False, **found)).found
    assert nearest == (0, "the nearest to it, margin -0.5", "")


def test_a_search_that_has_not_ended(search):
    told = told_of_search(search(requirement="low"))
    assert (told.is_whole, told.state, told.found) == (False, "3 runs", ())


def test_an_optimisation(search):
    best = [{"run": 1, "scenario": "best.toml", "values": [1.0]}]
    directory = search(minimize=["end"], best=best, runs=3)
    told = told_of_search(directory)
    assert told.title == "Search for the least end"
    assert told.axes == ("run", "metric.end")
    assert told.found == ((1, "end = 1", f"orchestrate run {directory / 'best.toml'}"),)


def test_a_pareto_front(search):
    told = told_of_search(search(minimize=["end", "peak(lag.x)"], best=[]))
    assert told.axes == ("metric.end", "metric.objective_2_")
    assert told.labels == {"metric.end": "end", "metric.objective_2_": "peak(lag.x)"}


def test_what_is_no_search(search):
    directory = search()
    for text in ("{", "[]", '{"vary": 3, "seed": 0}', '{"vary": [], "seed": 0, "best": [{}]}'):
        (directory / "search.json").write_text(text)
        with pytest.raises(ScenarioError, match="holds no search that can be read"):
            told_of_search(directory)
    (directory / "runs.parquet").write_text("no table")
    (directory / "search.json").write_text('{"vary": [], "seed": 0}')
    with pytest.raises(ScenarioError, match="holds no search that can be read"):
        told_of_search(directory)
