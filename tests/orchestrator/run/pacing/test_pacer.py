"""Runs in step with the clock: no drift, no late step without a line about it, the same results."""

import json
import math
import re

import numpy as np
import pytest
from railcosim.orchestrator import Results, System, resume, run, world
from railcosim.orchestrator.cli.app import call
from railcosim.orchestrator.cli.options import with_factor
from railcosim.orchestrator.errors import LateError, ScenarioError
from railcosim.orchestrator.run import RealTime
from railcosim.orchestrator.run.pacing import Pacer


@pytest.fixture
def clock(monkeypatch):
    """A clock that goes on by what is slept, and a little by being asked; ``clock[0]`` is its time."""
    now = [100.0]

    def ask():
        now[0] += 1e-6
        return now[0]

    def sleep(seconds):
        now[0] += seconds

    monkeypatch.setattr(world, "perf_counter", ask)
    monkeypatch.setattr(world, "sleep", sleep)
    return now


def paced(clock, costs, factor=2.0, late="warn", step=0.1):
    """When points are released whose steps take some time each, and the report."""
    pacer, released = Pacer(RealTime(factor, late), 5.0, lambda: False), []
    begin = clock[0]
    for k, cost in enumerate(costs, 1):
        clock[0] += cost
        pacer.meet(k, 5.0 + k * step)
        released.append(clock[0] - begin)
    return np.array(released), pacer.report()


def test_a_point_is_released_at_its_time_whatever_the_steps_take(clock):
    released, report = paced(clock, np.tile([0.0, 0.049, 0.01], 40))
    due = np.arange(1, 121) * 0.05
    assert np.abs(released - due).max() < 2e-5
    assert (report["late"], report["points"]) == (0, 120)
    assert 0.0 < report["last_delay"] <= report["longest_delay"] < 2e-5
    assert report["summary"].startswith("real time x 2: 120 points, none late; after they were due: median ")


def test_after_a_late_step_the_next_ones_catch_up_and_each_is_told_of(clock, caplog):
    costs = np.zeros(100)
    costs[[9, 40, 41, 99]] = 0.12, 0.26, 0.06, 0.07
    released, report = paced(clock, costs)
    due = np.arange(1, 101) * 0.05
    late = np.flatnonzero(released > due + 1e-4) + 1
    assert late.tolist() == [10, 11, 41, 42, 43, 44, 45, 46, 100]
    assert np.abs(released - due)[60:99].max() < 2e-5
    told = set()
    for record in caplog.records:
        text = record.getMessage()
        alone = re.fullmatch(r"late: step (\d+) was done up to [\d.]+ ms after the clock", text)
        several = re.fullmatch(r"late: (\d+) steps from (\d+) to (\d+) were done up to [\d.]+ ms after the clock", text)
        first, last = (int(alone[1]),) * 2 if alone else (int(several[2]), int(several[3]))
        told.update(range(first, last + 1))
    assert told >= set(late.tolist())
    assert len(caplog.records) == 4
    assert report["late"] == 9
    assert report["worst_late"] == pytest.approx(0.22, abs=1e-3)
    assert report["worst_at"] == pytest.approx(9.2)


def test_late_steps_may_be_told_of_in_the_end_or_not_be_allowed(clock, caplog):
    _, report = paced(clock, [0.1, 0.0], late="catch-up")
    assert (report["late"], caplog.records) == (2, [])
    assert "2 late, by up to 50 ms at t = 5.1 s" in report["summary"]
    with pytest.raises(LateError, match=r"step 1, to t = 5\.1 s, was done 50 ms after it was due"):
        paced(clock, [0.1], late="fail")


def test_what_was_late_within_the_last_second_is_told_in_the_end(clock, caplog):
    paced(clock, [0.1, 0.06])
    assert [record.getMessage().partition(" was")[0] for record in caplog.records] == ["late: step 1", "late: step 2"]


def test_delays_are_those_that_were_measured(clock):
    costs = 0.05 + np.random.default_rng(1).exponential(0.01, 500)
    released, report = paced(clock, costs, late="catch-up")
    delays = released - np.arange(1, 501) * 0.05
    for key, found in (("median_delay", np.median(delays)), ("delay_of_99_percent", np.quantile(delays, 0.99))):
        assert report[key] == pytest.approx(found, rel=0.13)
    assert report["mean_delay"] == pytest.approx(delays.mean(), rel=1e-3)
    assert report["deviation"] == pytest.approx(delays.std(), rel=1e-3)
    assert report["longest_delay"] == pytest.approx(delays.max(), rel=1e-3)


def test_all_steps_that_are_late_already_are_taken_at_once(clock):
    pacer = Pacer(RealTime(2.0), 5.0, lambda: False)
    clock[0] += 0.02
    assert pacer.due(5.0, 0.1) == 1
    clock[0] += 1.0
    assert pacer.due(5.0, 0.1) == 20
    assert pacer.due(6.9, 0.1) == 1
    assert Pacer(RealTime(1e9, "fail"), 0.0, lambda: False).due(0.0, 0.1) == 1


def test_who_is_to_end_does_not_wait(clock):
    pacer = Pacer(RealTime(), 0.0, lambda: True)
    pacer.meet(1, 1000.0)
    assert clock[0] < 101.0


@pytest.mark.parametrize("factor", [0.0, -1.0, math.inf, math.nan])
def test_factors_that_make_no_sense(factor):
    with pytest.raises(ScenarioError, match="positive number"):
        RealTime(factor)


def test_a_policy_that_does_not_exist():
    with pytest.raises(ScenarioError, match="'never' is none of warn, catch-up, fail"):
        RealTime(1.0, "never")


@pytest.fixture
def system(mine):
    made = System(step=0.1, stop_time=1.0)
    made.add("plant", mine("Lag"))
    return made


def test_a_run_takes_its_time_and_has_the_same_results(system, tmp_path):
    begin = world.perf_counter()
    slow = run(
        system, kind="plain", output=tmp_path / "a", real_time=RealTime(10.0), checkpoint_every=0.5, figures=False
    )
    assert world.perf_counter() - begin > 0.1
    fast = run(system, kind="plain")
    assert all((slow.results[name] == fast.results[name]).all() for name in fast.results)
    assert json.loads((tmp_path / "a" / "run.json").read_text())["coupling"]["real_time"]["points"] == 10
    again = resume(tmp_path / "a", stop_time=1.5, real_time=RealTime(10.0), figures=False)
    assert again.coupling["real_time"]["points"] == 10  # from the checkpoint at 0.5 s on
    assert Results.load(tmp_path / "a").time[-1] == 1.5


def test_a_run_that_comes_too_late_keeps_what_it_has(system):
    with pytest.raises(LateError) as raised:
        run(system, kind="plain", real_time=RealTime(1e9, "fail"))
    assert raised.value.run.status == "failed"
    assert raised.value.run.time.tolist() == [0.0, 0.1]


def test_the_factor_may_be_left_out():
    assert with_factor(["run", "x", "--real-time"]) == ["run", "x", "--real-time", "1"]
    assert with_factor(["run", "--real-time", "x"]) == ["run", "--real-time", "1", "x"]
    assert with_factor(["run", "--real-time", "60", "x"]) == ["run", "--real-time", "60", "x"]
    assert with_factor(["run", "x"]) == ["run", "x"]


def test_the_command(system, tmp_path, monkeypatch, capsys, mine):
    monkeypatch.chdir(tmp_path)
    head = f'title = "t"\n[simulation]\nstop_time = 0.2\n[instances.plant]\ncomponent = "{mine("Lag")}"\n'
    (tmp_path / "a.toml").write_text(head)
    plain = ["run", "a.toml", "--kind", "plain", "--no-figures"]
    assert call([*plain, "--real-time"]) == 0
    assert "real time x 1: 2 points" in capsys.readouterr().out
    assert call([*plain, "--real-time", "1e9", "--late", "fail", "-q"]) == 3
    assert "step 1, to t = 0.1 s, was done" in capsys.readouterr().err
    assert call([*plain, "--late", "fail"]) == 2
    assert "give --real-time as well" in capsys.readouterr().err
