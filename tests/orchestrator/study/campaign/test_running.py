"""A study: its runs are those of its plan, each once, whatever happens on the way."""

import errno
import json
import signal

import numpy as np
import pytest
from railcosim.orchestrator import world
from railcosim.orchestrator.errors import RailcosimError, RecordError, ScenarioError
from railcosim.orchestrator.run import execute
from railcosim.orchestrator.scenario import changed
from railcosim.orchestrator.study.campaign import Study, columns, run_study
from railcosim.orchestrator.study.campaign import running as running_module
from railcosim.orchestrator.study.campaign.pool import Here

from .conftest import plan_of, same


class StopError(Exception):
    """What nobody expects."""


def stopping(after, how):
    """A progress that ends a study after some runs."""

    def tell(done, count, failed):
        if done == after:
            how()

    return tell


def test_each_row_is_a_single_run(undisturbed, system):
    frame, plan = undisturbed.frame(), plan_of(system, runs=6)
    assert frame["run"].tolist() == list(range(6))
    for number in (0, 3):
        changes = plan.changes(number)
        run = execute(changed(system, changes), kind="plain")
        assert frame["lag.rate"][number] == changes["lag.rate"]
        assert frame["seed"][number] == changes["simulation.seed"]
        assert [frame[f"metric.end[{k}]"][number] for k in (1, 2)] == list(run.metrics[0].values.values())
        assert frame["verdict.low"][number] == run.requirements[0].verdict


def test_the_directory_tells_what_it_was(undisturbed):
    told = json.loads((undisturbed.directory / "study.json").read_text())
    assert (told["status"], told["runs"], told["error"]) == ("completed", 6, None)
    assert (told["dimensions"], told["evaluated"]) == (["lag.rate"], ["end", "most", "low"])
    assert [path.rpartition("/")[2] for path in told["files"]] == ["small.toml", "toys.py"]
    assert undisturbed.table().schema.metadata[b"railcosim"]


@pytest.mark.parametrize(
    ("how_it_ends", "status"), [(lambda: signal.raise_signal(signal.SIGTERM), "interrupted"), (None, "failed")]
)
def test_a_study_that_ended_before_its_time_goes_on(how, tmp_path, undisturbed, how_it_ends, status):
    def end():
        raise StopError

    plan, told = undisturbed.plan, stopping(3, how_it_ends or end)
    if how_it_ends is None:
        with pytest.raises(StopError):
            run_study(plan, how, tmp_path / "broken", workers=0, progress=told)
    else:
        before = signal.signal(signal.SIGTERM, lambda *_: None)
        study = run_study(plan, how, tmp_path / "broken", workers=0, progress=told)
        signal.signal(signal.SIGTERM, before)
        assert study.signal == signal.SIGTERM
    study = Study.load(tmp_path / "broken")
    assert (study.told["status"], len(study)) == (status, 3)
    again = run_study(plan, how, tmp_path / "broken", workers=0, resume=True)
    assert again.told["status"] == "completed"
    assert same(again, undisturbed)
    assert same(run_study(plan, how, tmp_path / "broken", workers=0, resume=True), undisturbed)


def test_a_second_signal_keeps_what_there_is(system, how, tmp_path):
    def twice():
        raise KeyboardInterrupt

    study = run_study(plan_of(system, runs=6), how, tmp_path, workers=0, progress=stopping(3, twice))
    assert (study.told["status"], len(study)) == ("interrupted", 3)


def test_what_breaks_when_a_signal_has_ended_workers_too_is_no_failure(system, how, tmp_path):
    def end():
        signal.raise_signal(signal.SIGTERM)
        raise StopError

    before = signal.signal(signal.SIGTERM, lambda *_: None)
    study = run_study(plan_of(system, runs=6), how, tmp_path, workers=0, progress=stopping(2, end))
    signal.signal(signal.SIGTERM, before)
    assert (study.told["status"], study.told["error"], len(study)) == ("interrupted", None, 2)


def test_a_study_that_ended_before_its_first_run_is_begun_anew(system, how, tmp_path):
    def end(pool):
        raise StopError

    plan = plan_of(system, runs=2)
    with pytest.raises(StopError):
        run_study(plan, how, tmp_path, workers=0, begun=end)
    assert len(run_study(plan, how, tmp_path, workers=0)) == 2


def test_runs_that_fail_are_rows(system, how, tmp_path):
    plan = plan_of(system, "lag.rate=1,-1", "simulation.stop_time=1.0,0.05,2.0")
    study = run_study(plan, how, tmp_path, workers=0)
    assert study.counts == {"completed": 4, "refused": 2}
    assert (study.broken, study.failed, sorted(study.errors)) == (2, True, [1, 4])
    assert "stop_time" in study.errors[1]


def test_trajectories_are_kept_where_they_are_asked_for(system, how, tmp_path):
    study = run_study(plan_of(system, runs=3), {**how, "record": ["lag[2].x"]}, tmp_path, workers=0)
    run = execute(changed(system, study.plan.changes(1)), kind="plain")
    np.testing.assert_array_equal(study.series(1)["lag[2].x"], run["lag[2].x"])


def test_structures_are_varied(system, how, tmp_path, mine):
    plan = plan_of(system, f"lag={mine('Lag')},{mine('LagWithSlope')}", "lag.count=2,3", "simulation.seed=1,2")
    study = run_study(plan, how, tmp_path, workers=0)
    assert study.counts == {"completed": 8}
    frame = study.frame()
    assert frame.columns[frame.columns.str.startswith("metric.end")].tolist() == [f"metric.end[{k}]" for k in (1, 2, 3)]
    assert frame["metric.end[3]"].isna().tolist() == [True, True, False, False] * 2


def test_no_more_structures_are_built_beforehand_than_some(system, how, tmp_path, monkeypatch):
    monkeypatch.setattr(running_module, "_MOST_BUILT", 1)
    study = run_study(plan_of(system, "lag.count=2,3"), how, tmp_path, workers=0)
    assert study.counts == {"completed": 2}


def test_a_directory_has_one_study(undisturbed, system, how, tmp_path):
    plan, there = plan_of(system, runs=6), undisturbed.directory
    with pytest.raises(ScenarioError, match=r"holds a study already \(completed\): go on with it by --resume"):
        run_study(plan, how, there, workers=0)
    with pytest.raises(ScenarioError, match="holds another study: what is varied differs"):
        run_study(plan_of(system, runs=7), how, there, workers=0, resume=True)
    with pytest.raises(ScenarioError, match="holds another study: the options differs"):
        run_study(plan, {**how, "settings": ["lag.gain=2"]}, there, workers=0, resume=True)
    with pytest.raises(ScenarioError, match="holds no study to go on with"):
        run_study(plan, how, tmp_path / "none", workers=0, resume=True)
    with world.lock(there / ".lock"), pytest.raises(RailcosimError, match=r"in use by another run \(small, process"):
        run_study(plan, how, there, workers=0, resume=True)


def test_another_scenario_is_another_study(undisturbed, system, how, scenario):
    scenario.write_text(scenario.read_text().replace("seed = 5", "seed = 6"))
    with pytest.raises(ScenarioError, match="a file or model differs"):
        run_study(plan_of(system, runs=6), how, undisturbed.directory, workers=0, resume=True)


def test_what_cannot_run_at_all_is_refused_and_leaves_nothing(system, how, tmp_path):
    with pytest.raises(ScenarioError, match="gane"):
        run_study(plan_of(system, "lag.gane=1,2,3"), how, tmp_path / "none", workers=0)
    with pytest.raises(ScenarioError, match=r"0\.05 s is not a whole number of steps"):
        run_study(plan_of(system, "simulation.stop_time=0.05,0.07"), how, tmp_path / "none", workers=0)
    assert not (tmp_path / "none").exists()


def test_a_full_disk_ends_it_and_it_goes_on_when_there_is_room(system, how, tmp_path, undisturbed, monkeypatch):
    plan = plan_of(system, runs=6)

    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patch:
        tell = stopping(3, lambda: patch.setattr(world, "fsync", full))
        with pytest.raises(RecordError, match="No space left on device; make room, and go on by --resume"):
            run_study(plan, how, tmp_path / "full", workers=0, progress=tell)
    again = run_study(plan, how, tmp_path / "full", workers=0, resume=True)
    assert same(again, undisturbed)


def test_the_extra_is_named(monkeypatch):
    with pytest.raises(RailcosimError, match=r"studies need no_such_package: pip install 'railcosim\[study\]'"):
        running_module.need_packages("pyarrow", "no_such_package")


def test_a_run_that_was_cut_short_is_no_row(how, system):
    with Here(how) as here:
        points = enumerate(plan_of(system, runs=6).block(0, 6))
        assert not list(here.rows(points, 6, lambda: True))


def test_the_workers_are_told(system, how, tmp_path):
    pools = []
    run_study(plan_of(system, runs=1), how, tmp_path, workers=0, begun=pools.append)
    assert (pools[0].workers, pools[0].dashboard) == (0, "")
    assert columns.SEED == "simulation.seed"
