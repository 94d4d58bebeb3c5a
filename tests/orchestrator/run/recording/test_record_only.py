"""Signals that are recorded by pattern: results have them alone, and everything else is as it is with all."""

import pytest
from railcosim.orchestrator import Results, load, resume, run
from railcosim.orchestrator.errors import ScenarioError
from railcosim.orchestrator.names import matching
from railcosim.orchestrator.scenario import dump

TEXT = """
title = "Lags"
[simulation]
stop_time = 2.0
step = 0.1
{record}
[instances.lag]
component = "{lag}"
count = 3
start.rate = 2.0
start.u = 1.0
[metrics]
end = "final(lag[2].x)"
most = "max(lag[:].x)"
[require]
low = "always lag[3].x < 5"
[[figures]]
title = "x"
y = ["lag[1].x"]
"""


@pytest.fixture
def scenario(tmp_path, mine):
    def write(record=""):
        (tmp_path / "lags.toml").write_text(TEXT.format(lag=mine("Lag"), record=record))
        return load(str(tmp_path / "lags.toml"))

    return write


def test_brackets_are_brackets_and_stars_are_letters():
    names = ["a[1].x", "a[2].x", "b.x", "b.y"]
    assert matching(names, ["a[2].*"]) == ["a[2].x"]
    assert matching(names, ["?.y", "a*"]) == ["a[1].x", "a[2].x", "b.y"]


@pytest.mark.parametrize("record", ["", "record = 0.5"])
@pytest.mark.parametrize("kind", ["plain", "native"])
def test_results_have_them_alone_and_all_is_judged(scenario, tmp_path, record, kind):
    full = run(scenario(record), kind=kind)
    few = run(scenario(f'{record}\nrecord_only = ["lag[1].*", "*[3].x"]'), kind=kind, output=tmp_path / "out")
    assert set(few.results) == {name for name in full.results if name.startswith("lag[1].")} | {"lag[3].x"}
    assert all((few.results[name] == full.results[name]).all() for name in few.results)
    assert [metric.values for metric in few.metrics] == [metric.values for metric in full.metrics]
    assert [verdict.margin for verdict in few.requirements] == [verdict.margin for verdict in full.requirements]
    assert set(Results.load(tmp_path / "out")) == set(few.results)
    assert few.figures


def test_figures_that_need_more_are_left_out_and_told(scenario, tmp_path):
    few = run(scenario('record_only = ["lag[2].x"]'), kind="plain", output=tmp_path / "out")
    assert few.figures == []
    assert "not drawn, because what they show is not recorded (record_only): 'x'" in few.checked.notes


def test_a_resumed_run_goes_on_with_them(scenario, tmp_path):
    system = scenario('record_only = ["lag[1].x"]')
    whole = run(system, kind="plain", output=tmp_path / "whole", figures=False)
    run(system, kind="plain", output=tmp_path / "parts", stop_time=1.0, checkpoint_every=0.5, figures=False)
    resume(tmp_path / "parts", stop_time=2.0, figures=False)
    assert (tmp_path / "parts" / "results.csv").read_bytes() == (tmp_path / "whole" / "results.csv").read_bytes()
    assert list(whole.results) == ["lag[1].x"]


def test_a_scenario_that_is_written_has_them(scenario, tmp_path):
    system = scenario('record_only = ["lag[1].x"]')
    assert 'record_only = ["lag[1].x"]' in dump(system)


@pytest.mark.parametrize(
    ("record", "why"),
    [
        ('record_only = ["lag[1].x", "lag[1].z"]', r"record_only: no signal is called 'lag\[1\].z'"),
        ("record_only = []", "is not a list of names"),
        ('record_only = "lag*"', "is not a list of names"),
        ("record_only = [1]", "is not a list of names"),
    ],
)
def test_what_cannot_be_recorded(scenario, record, why):
    with pytest.raises(ScenarioError, match=why):
        run(scenario(record), kind="plain")
