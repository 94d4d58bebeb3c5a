"""A study is read as it stands, complete or not."""

import pytest
from railcosim.orchestrator import Study
from railcosim.orchestrator.errors import ScenarioError
from railcosim.orchestrator.study.campaign import run_study

from .conftest import plan_of


def test_a_study_is_what_it_was(undisturbed):
    study = Study.load(undisturbed.directory)
    assert study.signal == 0
    assert study
    assert (len(study), study.counts, study.broken) == (6, {"completed": 6}, 0)
    assert (study.failed, study.verdicts) == (False, {"low": {"pass": 6}})
    assert repr(study) == f"<Study of small: 6 of 6 runs; completed; files in {undisturbed.directory}>"
    assert "<td>6 of 6</td>" in study._repr_html_()
    assert study.summary().runs == 6
    assert study.row(3)["lag.rate"] == study.frame()["lag.rate"][3] == study.plan.changes(3)["lag.rate"]
    assert study.table(["seed"]).column_names == ["run", "seed"]


def test_pictures_of_a_study_that_recorded_nothing(undisturbed):
    drawn = undisturbed.draw()
    assert drawn
    assert all(path.parent == undisturbed.directory and path.is_file() for path in drawn)


def test_what_is_not_there_is_said(undisturbed, tmp_path):
    with pytest.raises(ScenarioError, match="run 6 is none of its 6, 0 to 5"):
        undisturbed.row(6)
    with pytest.raises(ScenarioError, match="nothing was recorded"):
        undisturbed.series(1)
    with pytest.raises(ScenarioError, match="holds no study that can be read"):
        Study.load(tmp_path / "none")


def test_a_study_without_a_run(system, how, tmp_path):
    def end(pool):
        raise KeyboardInterrupt

    study = run_study(plan_of(system, runs=2), how, tmp_path, workers=0, begun=end)
    assert repr(study) == f"<Study of small: 0 of 2 runs; interrupted; files in {tmp_path}>"
    assert study.frame().empty
    with pytest.raises(ScenarioError, match="run 1 is still missing; --resume runs it"):
        study.row(1)


def test_what_went_wrong_is_counted(system, how, tmp_path):
    plan = plan_of(system, "simulation.stop_time=1.0,0.05", "lag.gain=1,40")
    study = run_study(plan, how, tmp_path, workers=0)
    assert "; 2 failed; low fails in 1;" in repr(study)
    assert study.failed
