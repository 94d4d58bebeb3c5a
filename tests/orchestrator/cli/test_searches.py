"""The commands that search: what they print, and their exit codes."""

import signal
from pathlib import Path

import pytest
from railcosim.orchestrator.cli.app import call
from railcosim.orchestrator.cli.printing.searches import show_search
from railcosim.orchestrator.study import search


@pytest.fixture
def scenario(tmp_path, mine, monkeypatch):
    """A lag after a schedule, as a file; its requirement is broken by a gain above 1.5."""
    path = tmp_path / "lagging.toml"
    path.write_text(f"""
[simulation]
stop_time = 2.0
step = 0.1
[instances.target]
component = "Schedule"
start.values = 1.0
[instances.lag]
component = "{mine("Lag")}"
start.rate = 5.0
[connections]
"lag.u" = "target.value"
[require]
low = "always lag.x <= 1.5"
[metrics]
end = "final(lag.x)"
""")
    monkeypatch.chdir(tmp_path)
    return path


def falsify(scenario, *more):
    return call(["falsify", str(scenario), "--kind", "plain", "--no-figures", "--workers", "0", *more])


def optimize(scenario, *more):
    return call(["optimize", str(scenario), "--kind", "plain", "--no-figures", "--workers", "0", *more])


def test_a_requirement_is_broken(scenario, capsys):
    assert falsify(scenario, "--vary", "lag.gain=1:3", "--budget", "30") == 1
    out, err = capsys.readouterr()
    assert "low is broken by 0.00" in out
    assert "The smallest change that still breaks it" in out
    assert "    lag.gain: 1.5" in out
    assert f"Files in {'results/falsify-lagging-low'}: counterexample.toml, nominal.toml, runs.parquet" in out
    assert "lagging: low: " in err
    assert call(["run", "results/falsify-lagging-low/counterexample.toml", "--kind", "plain", "-q", "-o", "again"]) == 1


def test_little_is_said_where_little_is_wanted(scenario, capsys):
    assert falsify(scenario, "--vary", "lag.gain=1:3", "--set", "lag.gain=2", "--budget", "3", "-q") == 1
    out, err = capsys.readouterr()
    assert (len(out.splitlines()), err) == (1, "")


def test_a_requirement_that_holds(scenario, capsys):
    how = ("--vary", "lag.gain=0.5:1.5", "--budget", "9", "--method", "random", "-o", "holds")
    assert falsify(scenario, *how, "--quiet") == 0
    out, err = capsys.readouterr()
    assert out.startswith("low was not broken in 9 runs; least margin ")
    assert (len(out.splitlines()), err) == (1, "")
    assert falsify(scenario, *how, "--resume", "--requirement", "low") == 0


def test_runs_that_fail_are_no_proof(scenario, capsys, mine):
    assert falsify(scenario, "--vary", "lag=NoSuch,Other", "--budget", "3", "--requirement", "low") == 2
    assert "nominal.toml:14: instance 'lag': there is no component" in capsys.readouterr().err
    fails = f'[instances.fails]\ncomponent = "{mine("Fails")}"\n'
    scenario.write_text(scenario.read_text().replace("[connections]", f"{fails}[connections]"))
    assert falsify(scenario, "--vary", "fails.until=0:5", "--budget", "12", "--method", "random") == 3
    assert "failed: " in capsys.readouterr().out


def test_one_of_several_requirements_is_to_be_named(scenario, capsys):
    scenario.write_text(scenario.read_text().replace("[metrics]", 'high = "always lag.x >= 0"\n[metrics]'))
    assert falsify(scenario, "--vary", "lag.gain=1:3") == 2
    assert "the scenario has 2 requirements; name one by --requirement: low, high" in capsys.readouterr().err
    scenario.write_text(scenario.read_text().partition("[require]")[0])
    assert falsify(scenario, "--vary", "lag.gain=1:3") == 2
    assert "the scenario has no requirements; write one into its [require]" in capsys.readouterr().err


def test_the_best_value(scenario, capsys):
    how = ("--vary", "lag.gain=1:3", "--budget", "30", "--minimize", "0 - final(lag.x)", "--subject-to", "low")
    assert optimize(scenario, *how) == 0
    out, _ = capsys.readouterr()
    assert "best.toml" in out
    assert "    lag.gain: 1." in out
    assert optimize(scenario, *how, "-o", "quiet", "-q") == 0
    assert capsys.readouterr() == ("", "")


def test_a_front(scenario, capsys):
    both = ("--minimize", "end", "--minimize", "0 - final(lag.x)")
    assert optimize(scenario, "--vary", "lag.gain=1:3", "--budget", "16", *both) == 0
    out, _ = capsys.readouterr()
    assert "Pareto front of 16 runs" in out
    assert "and 4 more" in out


def test_what_nothing_keeps(scenario, capsys):
    how = ("--minimize", "end", "--subject-to", "low", "--budget", "4")
    assert optimize(scenario, "--vary", "lag.gain=2:3", "--set", "lag.gain=2.5", *how) == 1
    assert "no run of 4 keeps low" in capsys.readouterr().out
    assert optimize(scenario, "--vary", "lag.gain=2:3") == 2
    assert "nothing is to be least; name a metric" in capsys.readouterr().err


def test_a_search_that_is_interrupted(scenario, capsys, monkeypatch):
    ended = search.InterruptedSearch(signal.SIGTERM, Path("there"))

    def end(*_, **how):
        told.append((how["workers"], how["scheduler"]))
        raise ended

    told = []
    monkeypatch.setattr(search, "falsify", end)
    monkeypatch.setattr(search, "optimize", end)
    assert falsify(scenario, "--vary", "lag.gain=1:3") == 143
    assert "interrupted; to go on: the same command with --resume -o there" in capsys.readouterr().err
    ended = search.InterruptedSearch(signal.SIGINT)
    assert optimize(scenario, "--vary", "lag.gain=1:3", "--minimize", "end") == 130
    assert capsys.readouterr().err == ""
    assert told == [(0, None)] * 2


def test_a_scheduler_has_its_own_workers(scenario, capsys):
    for run, more in ((falsify, ()), (optimize, ("--minimize", "end"))):
        assert run(scenario, "--vary", "lag.gain=1:3", "--scheduler", "tcp://far:8786", *more) == 2
        assert "the scheduler has the workers that it has" in capsys.readouterr().err


def test_a_bar_on_a_terminal(monkeypatch):
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    with show_search("title", quiet=False) as told:
        told.progress(1, 2, "least margin 3")
        told.progress(2, 2, "")
