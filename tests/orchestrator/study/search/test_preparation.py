"""Where a search runs: in one process or on workers it is the same, and a signal leaves what can be gone on with."""

import errno
import json
import signal
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import pytest
from railcosim.orchestrator import world
from railcosim.orchestrator.errors import RailcosimError, RecordError, ScenarioError
from railcosim.orchestrator.scenario import load
from railcosim.orchestrator.study.campaign import parts_of, worker
from railcosim.orchestrator.study.search import InterruptedSearch, falsify, optimize, preparation

VARIED = ["lag.gain=1:3"]


def runs(directory):
    """The runs of a search, without how long they took."""
    import pyarrow.dataset

    table = pyarrow.dataset.dataset([str(part) for part in parts_of(directory)]).to_table().sort_by("run")
    return [{name: value for name, value in row.items() if name != "seconds"} for row in table.to_pylist()]


def broken(system, directory, **how):
    how = {"budget": 9, "kind": "plain", "figures": False, "workers": 0} | how
    return falsify(system, VARIED, "low", directory, **how)


def same(one, other):
    """Whether two searches have the same end and the same runs, to the bit."""
    texts = [repr((each.found, runs(each.directory))).replace(str(each.directory), "") for each in (one, other)]
    return texts[0] == texts[1]


@pytest.fixture
def once(lagging, tmp_path):
    """A search in this process that nothing disturbs."""
    return broken(lagging(), tmp_path / "once")


def test_a_search_is_the_same_on_workers(lagging, tmp_path, scheduler, once):
    pools = []
    found = broken(lagging(), tmp_path / "out", workers=None, scheduler=scheduler, begun=pools.append)
    assert same(found, once)
    assert (found.verdict, found.changes) == (once.verdict, once.changes)
    assert len(pools) == 1
    assert not worker._OPEN


def test_a_signal_is_nominally_what_it_is_however_little_is_recorded(lagging, tmp_path):
    """The runs of the search record what the scenario says."""
    found = []
    for number, patterns in enumerate(([], ["lag.x"], {"lag.x": 0.1, "target.value": 1.0})):
        system = lagging()
        system.instances["target"].build["points"] = 2
        system.instances["target"].start.update(times=[0.0, 0.5], values=[1.0, 2.0])
        system.stepping.record_only = patterns
        how = {"kind": "plain", "workers": 0}
        with preparation.prepared(system, ["lag.u=signal(0, 9, 4)"], tmp_path / str(number), {}, **how) as made:
            found.append(list(made.space.nominal.values()))
        assert load(str(made.nominal)).stepping.record_only == patterns
    assert found == [[1.0, 2.0, 2.0, 2.0]] * 3


def test_models_that_take_the_place_of_others_reach_workers(lagging, tmp_path, scheduler, mine):
    vary = [f"lag={mine('Lag')},{mine('LagWithSlope')},NoSuch"]
    how = {"budget": 9, "kind": "plain", "figures": False}
    here = optimize(lagging(), vary, ["0 - final(target.value)"], tmp_path / "here", workers=0, **how)
    there = optimize(lagging(), vary, ["0 - final(target.value)"], tmp_path / "there", scheduler=scheduler, **how)
    assert same(there, here)
    assert here.found.failed


@pytest.mark.parametrize("is_far", [False, True])
def test_a_signal_leaves_a_search_that_goes_on_to_the_same_end(lagging, tmp_path, once, is_far, request):
    where = {"workers": None, "scheduler": request.getfixturevalue("scheduler")} if is_far else {}

    def ask(done, of, best):
        if done == 3:
            signal.raise_signal(signal.SIGTERM)

    heard = []
    before = signal.signal(signal.SIGTERM, lambda number, _: heard.append(number))
    try:
        with pytest.raises(InterruptedSearch) as ended:
            broken(lagging(), tmp_path / "out", progress=ask, **where)
    finally:
        signal.signal(signal.SIGTERM, before)
    assert (ended.value.signal, ended.value.directory, heard) == (signal.SIGTERM, tmp_path / "out", [signal.SIGTERM])
    assert 3 <= len(runs(tmp_path / "out")) < len(runs(once.directory))
    again = broken(lagging(), tmp_path / "out", resume=True)
    assert repr(again.found) == repr(once.found)


def test_what_breaks_when_a_signal_has_ended_workers_too_is_no_failure(lagging, tmp_path):
    def end(done, of, best):
        if is_asked:
            signal.raise_signal(signal.SIGTERM)
        raise RailcosimError("a worker is gone")

    before = signal.signal(signal.SIGTERM, lambda *_: None)
    try:
        for is_asked, expected in ((True, InterruptedSearch), (False, RailcosimError)):
            with pytest.raises(expected):
                broken(lagging(), tmp_path / str(is_asked), progress=end)
    finally:
        signal.signal(signal.SIGTERM, before)


def test_a_signal_during_the_nominal_run_leaves_nothing(lagging, tmp_path, monkeypatch):
    execute = preparation.execute

    def interrupted(system, **how):
        run = execute(system, **how)
        run.signal = signal.SIGINT
        return run

    monkeypatch.setattr(preparation, "execute", interrupted)
    with pytest.raises(InterruptedSearch) as ended:
        broken(lagging(), tmp_path / "out")
    assert (ended.value.signal, ended.value.directory) == (signal.SIGINT, None)
    assert not (tmp_path / "out").exists()


def test_a_signal_while_a_counterexample_is_written_is_none(lagging, tmp_path, monkeypatch, once):
    from railcosim.orchestrator.study.search import counterexample

    execute = counterexample.execute

    def interrupted(system, **how):
        run = execute(system, **how)
        run.signal = signal.SIGINT
        return run

    with monkeypatch.context() as patch:
        patch.setattr(counterexample, "execute", interrupted)
        with pytest.raises(InterruptedSearch) as ended:
            broken(lagging(), tmp_path / "out")
    assert ended.value.signal == signal.SIGINT
    assert same(broken(lagging(), tmp_path / "out", resume=True), once)


def test_a_search_goes_on_with_the_models_it_was_begun_with(lagging, mine, tmp_path):
    own, system = tmp_path / "own.py", lagging()
    own.write_text(Path(mine("Lag").rpartition(":")[0]).read_text())
    system.instances["lag"] = replace(system.instances["lag"], model=f"{own}:Lag")
    broken(system, tmp_path / "out", budget=1)
    assert 'component = "models/own.py:Lag"' in (tmp_path / "out" / "nominal.toml").read_text()
    assert broken(system, tmp_path / "out", budget=2, resume=True).found.runs == 2
    own.write_text(own.read_text().replace("self.gain * self.u", "self.gain * self.u * 2"))
    with pytest.raises(ScenarioError, match="holds another search"):
        broken(system, tmp_path / "out", budget=3, resume=True)


def test_a_search_goes_on_with_the_models_it_varies(lagging, mine, tmp_path):
    own, toys = tmp_path / "own.py", mine("Lag").rpartition(":")[0]
    own.write_text(Path(toys).read_text())
    how = {"kind": "plain", "workers": 0, "figures": False, "method": "random"}
    for budget, is_other in ((1, False), (2, False), (3, True)):
        if is_other:
            own.write_text(own.read_text().replace("self.gain * self.u", "self.gain * self.u * 2"))
        with pytest.raises(ScenarioError, match="holds another search") if is_other else nullcontext():
            vary = [f"lag={own}:Lag,{toys}:Lag"]
            falsify(lagging(), vary, "low", tmp_path / "out", budget=budget, resume=budget > 1, **how)


@pytest.mark.long
def test_a_run_that_ends_its_worker_is_a_failed_one_of_the_search(hostile, tmp_path):
    scenario = tmp_path / "hostile.toml"
    scenario.write_text(
        f'[simulation]\nstop_time = 1.0\nstep = 0.1\n[instances.bad]\nfmu = "{hostile()}"\n'
        '[metrics]\nend = "final(bad.x)"'
    )
    vary = ["bad.u=1:4", 'bad.deed="","step kill 0.3"']
    found = optimize(load(scenario), vary, ["end"], tmp_path / "out", budget=8, workers=2, figures=False).found
    lost = [one for one in found.evaluations if one.changes.get("bad.deed")]
    assert 0 < len(lost) == found.failed
    assert all("it ended the process of its worker" in one.error for one in lost)
    assert [one.run for one in found.evaluations] == list(range(8))
    assert found.best


@pytest.mark.parametrize(
    ("writes", "what"), [(0, "search.json"), (1, "nominal.toml"), (2, "000001.parquet"), (3, "search.json")]
)
def test_a_full_disk_ends_a_search_and_it_goes_on_when_there_is_room(lagging, tmp_path, monkeypatch, writes, what):
    """Whatever cannot be written: the search before its first run, its runs, or what came out of them."""
    fsync, kept = world.fsync, 2 * (writes == 3)

    def full(file):
        nonlocal writes
        writes -= 1
        if writes < 0:
            raise OSError(errno.ENOSPC, "No space left on device")
        fsync(file)

    def search(**how):
        return falsify(lagging(), ["lag.gain=1:1.2"], "low", tmp_path, budget=2, kind="plain", workers=0, **how)

    with monkeypatch.context() as patch:
        patch.setattr(world, "fsync", full)
        with pytest.raises(RecordError, match=f"{what} cannot be written: No space left on device; make room, and go"):
            search()
    before = runs(tmp_path) if kept else []
    assert not list(tmp_path.glob("*.part"))
    again = search(resume=(tmp_path / "nominal.toml").exists())
    assert (len(before), again.found.runs, again.found.failed, len(runs(tmp_path))) == (kept, 2, 0, 2)
    assert runs(tmp_path)[:kept] == before
    assert json.loads((tmp_path / "search.json").read_text())["runs"] == 2
