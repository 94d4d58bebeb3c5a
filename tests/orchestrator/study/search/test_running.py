"""From a scenario to files: counterexamples and optima, and what is refused before the first run."""

import json

import pandas as pd
import pytest
from railcosim.orchestrator.errors import FmuError, ScenarioError
from railcosim.orchestrator.run import execute
from railcosim.orchestrator.scenario import load
from railcosim.orchestrator.study.search import falsify, optimize

VARIED = ["target.value=signal(0, 3, 2)", "lag.rate=1:6"]


def test_what_breaks_a_requirement_is_a_scenario_of_the_same_margin_to_the_bit(lagging, tmp_path):
    found = falsify(lagging(), VARIED, "low", tmp_path / "a", budget=30, kind="plain", workers=0, seed=2)
    assert found.found.found
    assert found.changes == ("target.value: 1 of its 2 values (1)",)
    runs = pd.read_parquet(tmp_path / "a" / "runs.parquet")
    assert len(runs) == found.found.runs + found.found.shrinking
    keys = ["target.values[1]", "target.values[2]", "lag.rate"]
    (last,) = [
        row
        for _, row in runs.iterrows()
        if {key: row[key] for key in keys if pd.notna(row[key])} == found.found.changes
    ]
    assert last["margin.low"] == found.verdict.margin < 0.0
    assert execute(load(found.scenario), kind="plain").requirements[0].margin == found.verdict.margin
    told = json.loads((tmp_path / "a" / "search.json").read_text())
    assert told["margin"] == found.verdict.margin
    assert told["changes"] == found.found.changes
    assert [path.name for path in found.figures] == told["figures"] == ["counterexample-to-low.png"]


def test_a_search_is_gone_on_with_and_no_other(lagging, tmp_path):
    how = {"budget": 4, "kind": "plain", "workers": 0, "method": "random", "figures": False}
    with pytest.raises(ScenarioError, match="holds no search to go on with"):
        falsify(lagging(), ["lag.rate=1:6"], "low", tmp_path, resume=True, **how)
    first = falsify(lagging(), ["lag.rate=1:6"], "low", tmp_path, **how)
    assert (first.found.found, first.scenario) == (False, None)
    with pytest.raises(ScenarioError, match="holds a search already: go on with it by --resume"):
        falsify(lagging(), ["lag.rate=1:6"], "low", tmp_path, **how)
    again = falsify(lagging(), ["lag.rate=1:6"], "low", tmp_path, resume=True, **how | {"budget": 6})
    assert again.found.runs == 6
    assert len(pd.read_parquet(tmp_path / "runs.parquet")) == 6
    for other in ({"seed": 1}, {"method": "tpe"}):
        with pytest.raises(ScenarioError, match="holds another search"):
            falsify(lagging(), ["lag.rate=1:6"], "low", tmp_path, resume=True, **how | other)
    with pytest.raises(ScenarioError, match="holds another search"):
        falsify(lagging(seed=5), ["lag.rate=1:6"], "low", tmp_path, resume=True, **how)
    (tmp_path / "search.json").write_text("{}")
    with pytest.raises(ScenarioError, match="holds another search"):
        falsify(lagging(), ["lag.rate=1:6"], "low", tmp_path, resume=True, **how)


@pytest.mark.parametrize(
    ("vary", "requirement", "said"),
    [
        ("lag.rate=1:6", "lo", "there is no requirement 'lo'; did you mean 'low'?"),
        ("lag.rate=1:6", "zzz", "there is no requirement 'zzz'; there are low"),
        ("preset=a,b", "low", "a preset is where a search begins; run one search for each, with --preset"),
        ("lag.rat=1:6", "low", "did you mean 'rate'?"),
    ],
)
def test_what_cannot_be_searched_is_told(lagging, tmp_path, vary, requirement, said):
    with pytest.raises(ScenarioError) as caught:
        falsify(lagging(), [vary], requirement, tmp_path, kind="plain", workers=0)
    assert said in str(caught.value)


def test_a_scenario_without_requirements_has_none_to_break(lagging, tmp_path):
    system = lagging()
    system.judged.requirements = {}
    with pytest.raises(ScenarioError, match="the scenario has none"):
        falsify(system, ["lag.rate=1:6"], "low", tmp_path, kind="plain", workers=0)


def test_a_scenario_that_does_not_run_is_not_searched(lagging, tmp_path, mine):
    system = lagging()
    system.add("fails", mine("Fails"), until=1.0)
    with pytest.raises(FmuError):
        falsify(system, ["lag.rate=1:6"], "low", tmp_path, kind="plain", workers=0)


def test_the_best_is_a_scenario(lagging, tmp_path):
    system = lagging(metrics={"end": "final(lag.x)"})
    found = optimize(
        system,
        ["lag.gain=1:2"],
        ["0 - final(lag.x)"],
        tmp_path,
        requirements=["low"],
        budget=25,
        kind="plain",
        workers=0,
    )
    (path,) = found.scenarios
    assert path.name == "best.toml"
    outcome = execute(load(path), kind="plain")
    assert outcome.requirements[0].verdict == "pass"
    (value,) = found.found.values(found.found.best[0])
    assert [one.values[None] for one in outcome.metrics if one.name == "objective_1"] == [value]
    assert -1.5 <= value < -1.4
    assert "#     0 - final(lag.x) = " in path.read_text()
    assert [path.name for path in found.figures] == ["progress.png"]
    assert json.loads((tmp_path / "search.json").read_text())["best"][0]["values"] == [value]


def test_of_several_objectives_there_is_a_front(lagging, tmp_path):
    system = lagging(metrics={"end": "final(lag.x)"})
    objectives = ["end", "0 - final(lag.x)", "0 - lag.rate"]
    found = optimize(system, ["lag.gain=1:2", "lag.rate=1:2"], objectives, tmp_path, budget=9, kind="plain", workers=0)
    assert [path.name for path in found.scenarios] == [f"pareto-{k + 1}.toml" for k in range(len(found.found.best))]
    assert len(found.scenarios) > 1
    assert [path.name for path in found.figures] == ["pareto.png"]


def test_an_objective_is_a_single_number(lagging, tmp_path, mine):
    system = lagging(metrics={"end": "final(lags[i].x)"})
    system.add("lags[1]", mine("Lag"), u=0.0)
    system.add("lags[2]", mine("Lag"), u=0.0)
    with pytest.raises(
        ScenarioError, match=r"--minimize end: it is not a single number; name one of end\[1\], end\[2\]"
    ):
        optimize(system, ["lag.gain=1:2"], ["end"], tmp_path, kind="plain", workers=0)
    found = optimize(system, ["lag.gain=1:2"], ["end[2]"], tmp_path, budget=2, kind="plain", workers=0, figures=False)
    assert found.found.best


def test_a_descent_breaks_a_requirement_in_few_runs(lagging, tmp_path):
    """The nominal run, and one step along the slope."""
    found = falsify(
        lagging(), ["target.value=signal(0, 3, 2)"], "low", tmp_path, kind="plain", method="gradient", figures=False
    )
    assert (found.found.found, found.found.runs) == (True, 2)


def test_a_system_without_gradients_is_told_before_there_is_a_search(lagging, mine, tmp_path):
    system = lagging()
    system.add("noise", mine("Noisy"))
    with pytest.raises(ScenarioError, match="instance 'noise': Noisy draws random numbers; choose another --method"):
        falsify(system, ["lag.rate=1:6"], "low", tmp_path, kind="plain", method="gradient")
    assert not falsify(system, ["lag.rate=1:6"], "low", tmp_path, kind="plain", budget=2, figures=False).found.found
