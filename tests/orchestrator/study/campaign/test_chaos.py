"""Studies that are disturbed: workers and schedulers are killed, FMUs crash, and every run is there exactly once."""

import contextlib
import os
import random
import signal
import socket
import subprocess
import sys
import threading
import time

import dask
import psutil
import pytest
from distributed.core import Status
from railcosim.orchestrator import Study, load
from railcosim.orchestrator.errors import RunError
from railcosim.orchestrator.study.campaign import cluster, flight, run_study
from railcosim.orchestrator.study.campaign.cluster import Cluster

from .conftest import plan_of, same

pytestmark = pytest.mark.long
RUNS = 300


def workers_of(process):
    """The worker processes that a process has started."""
    found = []
    for one in process.children(recursive=True):
        with contextlib.suppress(psutil.NoSuchProcess):
            found += [one] if "spawn_main" in " ".join(one.cmdline()) else []
    return found


@pytest.fixture
def native(how, system, tmp_path):
    """How native runs are made, and what they are when nothing disturbs them."""
    how["kind"] = "native"
    return how, run_study(plan_of(system, runs=RUNS), how, tmp_path / "undisturbed", workers=0)


@pytest.mark.parametrize("seed", [1, 2])
def test_workers_are_killed_at_random(native, system, tmp_path, seed):
    how, undisturbed = native
    draw, me = random.Random(seed), psutil.Process()
    moments = set(draw.sample(range(RUNS // 2), 4))

    def kill(done, count, failed):
        if done in moments and (found := workers_of(me)):
            draw.choice(found).kill()

    study = run_study(plan_of(system, runs=RUNS), how, tmp_path / "out", workers=2, progress=kill)
    assert same(study, undisturbed)
    assert not workers_of(me)


def test_a_killed_study_goes_on_as_often_as_it_is_killed(native, system, scenario, tmp_path):
    _, undisturbed = native
    command = [sys.executable, "-m", "railcosim.orchestrator.cli", "study", str(scenario), "--vary"]
    command += ["lag.rate=uniform(0.1, 3)", "--runs", str(RUNS), "--seed", "3", "--kind", "native", "--workers", "2"]
    command += ["-o", str(tmp_path / "out"), "--quiet"]
    for after in (7.0, 8.0):
        study = subprocess.Popen([*command, "--resume"] if (tmp_path / "out/study.json").exists() else command)
        time.sleep(after)
        for one in psutil.Process(study.pid).children():
            one.kill()
        study.kill()
        study.wait()
    assert subprocess.run([*command, "--resume"], check=False, timeout=300).returncode in (0, 1)
    assert same(Study.load(tmp_path / "out"), undisturbed)


@pytest.mark.parametrize("told", [True, False])
def test_a_worker_that_does_not_come_up_is_given_up_and_another_one_is_started(
    native, system, tmp_path, monkeypatch, told
):
    """The only one there is, twice: stopped, it never says that it runs, like one killed while it is being started.

    What it is told at its start fits into a pipe, or does not: then it is not even known to be there.
    """
    monkeypatch.setattr(cluster, "_START", 10.0)
    how, undisturbed = native
    me, over, stopped = psutil.Process(), threading.Event(), []

    def disturb(first):
        first.kill()
        while len(stopped) < 2 and not over.is_set():
            for one in [one for one in workers_of(me) if one not in {first, *stopped}]:
                one.suspend()
                stopped.append(one)
            time.sleep(0.005)

    def begin(done, count, failed):
        if done == 3:
            threading.Thread(target=disturb, args=workers_of(me)).start()

    try:
        with dask.config.set({"distributed.unknown": "" if told else "x" * (1 << 20)}):
            study = run_study(plan_of(system, runs=RUNS), how, tmp_path / "out", workers=1, progress=begin)
    finally:
        over.set()
    assert len(stopped) == 2
    assert not workers_of(me)
    assert same(study, undisturbed)


def test_workers_that_die_before_they_are_seen_to_run_are_started_again(native, system, tmp_path, monkeypatch):
    """Their nannies, who start them, then do not: they are made to believe here that they are still at it."""
    monkeypatch.setattr(flight, "_FETCH", 10.0)
    how, undisturbed = native
    enter, entered, killed = Cluster.__enter__, [], []
    monkeypatch.setattr(Cluster, "__enter__", lambda self: entered.append(self) or enter(self))

    def kill(done, count, failed):
        if not killed:
            for nanny in entered[0]._own.workers.values():
                nanny.status = Status.starting
            killed.extend(workers_of(psutil.Process()))
            for one in killed:
                one.kill()

    with dask.config.set({"distributed.deploy.lost-worker-timeout": "1s"}):
        study = run_study(plan_of(system, runs=RUNS), how, tmp_path / "out", workers=2, progress=kill)
    assert len(killed) == 2
    assert same(study, undisturbed)


def test_runs_that_end_their_worker_are_rows(hostile, tmp_path):
    fmu = hostile()
    scenario = tmp_path / "hostile.toml"
    scenario.write_text(
        '[simulation]\nstop_time = 1.0\nstep = 0.1\n[instances.bad]\nfmu = "' + str(fmu) + '"\n'
        '[metrics]\nend = "final(bad.x)"'
    )
    how = {"scenario": str(scenario), "kind": "native"}
    deeds = ["", "step kill 0.3"]
    plan = plan_of(load(scenario), "bad.u=1:4:4", "bad.deed=" + ",".join(f'"{deed}"' for deed in deeds))
    study = run_study(plan, how, tmp_path / "out", workers=2)
    frame = study.frame()
    assert frame["run"].tolist() == list(range(8))
    lost = frame["status"] == "failed"
    assert (lost == (frame["bad.deed"] != "")).all()
    assert frame["error"][lost].str.startswith("it ended the process of its worker 3 times").all()


def test_fmus_that_crash_at_random_steps_while_workers_are_killed(hostile, tmp_path):
    """What each says of its end is the same, too, whichever ran before in its process."""
    draw, me, scenario = random.Random(1), psutil.Process(), tmp_path / "hostile.toml"
    scenario.write_text(
        '[simulation]\nstop_time = 1.0\nstep = 0.1\n[instances.bad]\nfmu = "' + str(hostile()) + '"\n'
        '[metrics]\nend = "final(bad.x)"'
    )
    ways = [("step", "abort"), ("step", "exit"), ("get", "abort"), ("step", "error"), ("step", "nan"), ("set", "exit")]
    deeds = {" ".join((*draw.choice(ways), f"{draw.uniform(0.1, 0.9):.2f}")) for _ in range(12)} | {""}
    how = {"scenario": str(scenario), "kind": "native"}
    plan = plan_of(load(scenario), "bad.u=1:4:16", "bad.deed=" + ",".join(f'"{deed}"' for deed in sorted(deeds)))
    undisturbed = run_study(plan, how, tmp_path / "undisturbed", workers=0)
    moments = set(draw.sample(range(plan.count // 2), 4))

    def kill(done, count, failed):
        if done in moments and (found := workers_of(me)):
            draw.choice(found).kill()

    assert same(run_study(plan, how, tmp_path / "out", workers=2, progress=kill), undisturbed)
    assert set(undisturbed.frame()["status"]) == {"completed", "failed"}


@pytest.fixture
def by_hand(tmp_path):
    """A scheduler and workers, each a process in a folder of its own, without the files of the scenario."""
    started = []

    def start(*arguments):
        folder = tmp_path / f"hand{len(started)}"
        folder.mkdir()
        environment = os.environ | {"TMPDIR": str(folder)}
        command = [sys.executable, "-m", "dask", *arguments]
        log = open(folder / "log", "w")  # noqa: SIM115 (the process has it)
        started.append(subprocess.Popen(command, cwd=folder, env=environment, stdout=log, stderr=log))
        log.close()
        return started[-1]

    yield start
    for one in started:
        one.terminate()
    for one in started:
        one.wait(30)


def test_a_scheduler_by_hand_is_restarted(native, system, tmp_path, by_hand):
    how, undisturbed = native
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = str(free.getsockname()[1])
    address, here = f"tcp://127.0.0.1:{port}", ("--host", "127.0.0.1", "--port", port)

    def up():
        found = [by_hand("scheduler", *here, "--dashboard-address", "127.0.0.1:0", "--no-dashboard")]
        return found + [by_hand("worker", address, "--nthreads", "1", "--no-dashboard") for _ in range(2)]

    running, restarts = up(), iter([100])
    due = next(restarts)

    def restart(done, count, failed):
        nonlocal due, running
        if done == due:
            due = -1
            for one in running:
                one.send_signal(signal.SIGKILL)
                one.wait()
            running = up()

    study = run_study(plan_of(system, runs=RUNS), how, tmp_path / "out", scheduler=address, progress=restart)
    assert same(study, undisturbed)

    def stop(done, count, failed):
        if done == 50:
            for one in running:
                one.kill()

    with pytest.raises(RunError, match=f"the scheduler {address} is gone: start it and go on by --resume"):
        run_study(plan_of(system, runs=RUNS), how, tmp_path / "gone", scheduler=address, progress=stop)
    again = run_study(plan_of(system, runs=RUNS), how, tmp_path / "gone", workers=2, resume=True)
    assert same(again, undisturbed)
