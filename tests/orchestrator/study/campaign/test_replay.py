"""A row again, as a single run, to the same bits; or it is said why not."""

import json

import pytest
from railcosim.orchestrator import load
from railcosim.orchestrator.errors import ScenarioError
from railcosim.orchestrator.study.campaign import replay, run_study

from .conftest import plan_of


def test_a_row_is_run_again_with_all_its_results(undisturbed):
    again = replay(undisturbed.directory, 4)
    assert (again.number, again.changes) == (4, undisturbed.plan.changes(4))
    assert (again.differences, again.notes) == ([], [])
    assert (undisturbed.directory / "run-4/results.csv").is_file()
    assert again.run.metrics[0].values[1] == undisturbed.frame()["metric.end[1]"][4]


def test_what_differs_is_said(undisturbed, tmp_path):
    part = undisturbed.directory / "study.json"
    told = json.loads(part.read_text())
    told["how"]["settings"] = ["lag[1].gain=0.5"]
    told["contents"] = [digest for digest in told["contents"] if digest in told["files"].values()]
    part.write_text(json.dumps(told))
    again = replay(undisturbed.directory, 4, output=tmp_path / "out")
    assert again.differences[0].startswith("metric.end[1] was ")
    assert (tmp_path / "out/run.json").is_file()


def test_an_fmu_that_was_made_otherwise_is_told(tmp_path, mine):
    scenario = tmp_path / "one.toml"
    lag = f'[instances.lag]\ncomponent = "{mine("Lag")}"\n'
    scenario.write_text(f'[simulation]\nstop_time = 1.0\nstep = 0.5\n{lag}[metrics]\nend = "final(lag.x)"')
    how = {"scenario": str(scenario), "kind": "native"}
    run_study(plan_of(load(scenario), runs=1), how, tmp_path / "study", workers=0)
    path = tmp_path / "study/study.json"
    told = json.loads(path.read_text())
    told["contents"] = list(told["files"].values())
    path.write_text(json.dumps(told))
    again = replay(tmp_path / "study", 0)
    assert again.notes == (
        [f"{mine('Lag')} is another FMU than it was: railcosim, or what it is compiled with, has changed"]
    )
    assert not again.differences


def test_files_that_changed_are_named(undisturbed, scenario):
    scenario.write_text(scenario.read_text() + "\n")
    with pytest.raises(ScenarioError, match=r"small\.toml: not what the study in .* was run with"):
        replay(undisturbed.directory, 4, scenario=str(scenario))


def test_code_that_the_study_alone_names_is_not_imported(undisturbed, tmp_path, how, system, mine):
    scenario = how["scenario"]
    with pytest.raises(ScenarioError, match=r"the study alone names Python code .*toys\.py:Lag.*--trust it"):
        replay(undisturbed.directory, 4, trust=False)
    assert not replay(undisturbed.directory, 4, scenario=scenario, trust=False).differences
    plan = plan_of(system, f"lag={mine('LagWithSlope')}")
    run_study(plan, how, tmp_path / "swapped", workers=0)
    with pytest.raises(ScenarioError, match="LagWithSlope"):
        replay(tmp_path / "swapped", 0, scenario=scenario, trust=False)
    assert not replay(tmp_path / "swapped", 0).differences


def test_there_is_no_such_run(undisturbed):
    with pytest.raises(ScenarioError, match="run 99 is none"):
        replay(undisturbed.directory, 99)
