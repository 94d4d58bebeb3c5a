"""Runs on Dask: with a scheduler and a worker in this process, as on any that is there."""

import asyncio
import os
import signal
import threading
from contextlib import suppress
from types import SimpleNamespace
from typing import ClassVar

import distributed
import psutil
import pytest
from distributed import LocalCluster, Nanny
from distributed.core import Status
from railcosim.orchestrator import Study, world
from railcosim.orchestrator.errors import RailcosimError, RunError
from railcosim.orchestrator.study.campaign import cluster as cluster_module
from railcosim.orchestrator.study.campaign import packed, pool_for, run_study, worker
from railcosim.orchestrator.study.campaign.cluster import Cluster

from .conftest import plan_of, same


def test_a_study_is_the_same_on_workers(system, how, tmp_path, scheduler, undisturbed):
    study = run_study(plan_of(system, runs=6), how, tmp_path / "out", scheduler=scheduler)
    assert same(study, undisturbed)
    assert not worker._OPEN


def test_what_a_worker_cannot_do_at_all_ends_the_study(system, how, tmp_path, scheduler, monkeypatch):
    monkeypatch.setattr(worker, "this_version", lambda: "0.0.1")
    with pytest.raises(RailcosimError, match=r"a worker has railcosim 0\.0\.1"):
        run_study(plan_of(system, runs=6), how, tmp_path / "out", scheduler=scheduler)
    assert Study.load(tmp_path / "out").told["status"] == "failed"


def test_no_scheduler(system, how, tmp_path, monkeypatch):
    monkeypatch.setattr(cluster_module, "_PATIENCE", 0.05)
    for address in ("tcp://127.0.0.1:9", "nonsense://x"):
        with pytest.raises(RailcosimError, match=f"no scheduler answers at {address} .* start one by 'dask scheduler'"):
            run_study(plan_of(system, runs=6), how, tmp_path / "out", scheduler=address)


@pytest.mark.parametrize(("states", "is_back"), [(["connecting", "running"], True), (["closed"], False)])
def test_a_scheduler_that_went_is_waited_for(system, how, monkeypatch, states, is_back):
    class Client:
        @property
        def status(self):
            return states.pop(0) if len(states) > 1 else states[0]

    monkeypatch.setattr(world, "sleep", lambda _: None)
    made = Cluster(packed(how, [system], "plain"), "tcp://far:8786")
    made._client = Client()
    if is_back:
        made.wait_for_scheduler()
    else:
        with pytest.raises(RunError, match="the scheduler tcp://far:8786 is gone: start it and go on by --resume"):
            made.wait_for_scheduler()


@pytest.mark.parametrize("there", [0, 1, 2])
def test_a_worker_that_was_given_up_is_started_again(system, how, there):
    class Client:
        def nthreads(self):
            return dict.fromkeys(range(there), 1)

    class Own:
        worker_spec = (0, 1)
        workers: ClassVar = {name: SimpleNamespace(status=status) for name, status in enumerate(Status)}
        asked: ClassVar = []

        def scale(self, count):
            self.asked.append(count)

    made = Cluster(packed(how, [system], "plain"), workers=2)
    made._client, made._own = Client(), Own()
    assert made.workers == there
    assert Own.asked == ([2] if there < 2 else [])
    ended = {nanny.status for nanny in Own.workers.values()} & {Status.closed, Status.failed}
    assert bool(ended) == (there == 2)


def test_a_cluster_is_closed_whole_whatever_a_user_presses(system, how, scheduler, monkeypatch):
    made = pool_for(packed(how, [system], "plain"), scheduler)
    close, closing = made._close, threading.Event()

    def slowly():
        closing.wait(5.0)
        close()

    def join(thread, timeout=None, join=threading.Thread.join):
        if thread.name == "closing" and not closing.is_set():
            closing.set()
            raise KeyboardInterrupt
        join(thread, timeout)

    with made:
        assert made.workers == made.workers == 1
        monkeypatch.setattr(made, "_close", slowly)
        with monkeypatch.context() as patch:
            patch.setattr(threading.Thread, "join", join)
            made.__exit__()
    assert made._client.status == "closed"


def test_the_dashboard_needs_a_package_that_may_be_missing(system, how, scheduler, monkeypatch):
    monkeypatch.setattr(cluster_module, "_can_show", lambda: True)
    with pool_for(packed(how, [system], "plain"), scheduler) as made:
        assert made.dashboard is not None
    monkeypatch.setattr(cluster_module, "_can_show", lambda: False)
    with pool_for(packed(how, [system], "plain"), scheduler) as made:
        assert made.dashboard == ""


def test_what_is_started_does_not_hear_the_terminal():
    with cluster_module._deaf():
        assert signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, [])
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, [])
    assert cluster_module._can_show() in (True, False)


@pytest.mark.parametrize("error", [TimeoutError("start timed out"), RuntimeError("Cluster failed to start")])
def test_workers_that_do_not_come_up_at_first_end_the_study_in_a_sentence(system, how, tmp_path, monkeypatch, error):
    def start(**_):
        raise error

    monkeypatch.setattr("distributed.LocalCluster", start)
    with pytest.raises(RailcosimError, match=rf"came up within 120 s .* \({error}\); ask for fewer by --workers"):
        run_study(plan_of(system, runs=2), how, tmp_path / "out", workers=2)


@pytest.mark.parametrize("state", ["alive", "ended", "closed", "none"])
def test_a_worker_that_is_given_up_is_ended(state, monkeypatch):
    """Of one that is still coming up Dask's nanny asserts that it is not, and forgets it."""
    killed = []

    class Process:
        def is_alive(self):
            if state == "closed":
                raise ValueError
            return state == "alive"

        async def kill(self):
            killed.append(self)

    async def close(self, timeout, reason):
        self.process = None
        assert state != "alive", Status.starting

    monkeypatch.setattr(Nanny, "close", close)
    made = object.__new__(cluster_module._nanny(distributed))
    made.process = None if state == "none" else SimpleNamespace(process=Process())
    assert asyncio.run(made.close()) == "OK"
    assert len(killed) == (state == "alive")


@pytest.fixture
def started(monkeypatch):
    """How a local cluster is started, in this process instead of others."""
    found = {}

    def start(**how):
        found.update(how)
        kept = {name: value for name, value in how.items() if name not in ("processes", "env", "host", "worker_class")}
        return LocalCluster(**kept, processes=False)

    class Dask:
        def __getattr__(self, name):
            return start if name == "LocalCluster" else getattr(__import__("distributed"), name)

    monkeypatch.setattr(cluster_module, "_dask", Dask)
    return found


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_a_local_cluster_leaves_nothing(how, tmp_path, undisturbed, started, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "temporary"))
    (tmp_path / "temporary").mkdir()
    study = run_study(undisturbed.plan, how, tmp_path / "out", workers=2)
    assert same(study, undisturbed)
    assert (started["n_workers"], started["threads_per_worker"], started["host"]) == (2, 1, "127.0.0.1")
    assert started["env"]["TMPDIR"] == started["local_directory"]
    assert not os.path.exists(started["local_directory"])
    for digest in list(worker._OPEN):  # those of processes of their own go with them
        worker.forget(digest)
    assert not list((tmp_path / "temporary").iterdir())


def test_workers_that_do_not_end_are_not_waited_for(system, how, monkeypatch):
    """As where one is killed while it is being started, of which Dask never hears."""
    said, made = [], Cluster(packed(how, [system], "plain"), workers=1)
    monkeypatch.setattr(cluster_module._LOG, "warning", lambda text, *_: said.append(text))
    with made:
        own = made._own
        (number,) = (nanny.pid for nanny in own.workers.values())
        close = own._close

        async def never():
            await asyncio.sleep(3600.0)

        monkeypatch.setattr(own, "_close", never)
        monkeypatch.setattr(cluster_module, "_PATIENCE", 0.2)
    assert [text.endswith("they are killed") for text in said] == [True]
    monkeypatch.setattr(cluster_module, "_PATIENCE", 30.0)
    with suppress(psutil.NoSuchProcess):
        psutil.Process(number).wait(10.0)
    monkeypatch.setattr(own, "_close", close)
    own.close()
