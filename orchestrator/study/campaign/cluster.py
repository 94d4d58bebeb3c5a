"""Runs on Dask: chunks of them go to workers in other processes, on this machine or on others."""

from __future__ import annotations

import importlib
import importlib.util
import logging
import signal
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any

from ... import world
from ...errors import RailcosimError, RunError
from ...leftovers import PREFIX, own, sweep
from ..rows import Row
from . import worker
from .flight import Flight, Future, Point
from .parcel import Parcel

_LOG = logging.getLogger(__name__)
_PATIENCE = 30.0
"""How long, in s, a scheduler may be away, or the end of workers may take."""
_START = 120.0
"""How long, in s, a worker may take to be started; then it is given up, and another one is."""
_LOOK = 1.0
"""How often, in s, workers are counted."""
_KEPT = 256 << 20
"""What a worker keeps of the memory that it gives back, in bytes."""
_LARGE = 32 << 20
"""From how many bytes on a block of memory goes back at once: the most that the C library takes."""
_CONFIG = {
    "distributed.scheduler.allowed-failures": 0,  # which run ends its worker is found by division
    "distributed.scheduler.worker-ttl": None,  # a long step is no death; of that the connection tells
    "distributed.admin.large-graph-warning-threshold": "1TiB",  # an FMU is as large as it is
    # Dask watches itself all the time: it took a twentieth of two processors.
    "distributed.worker.profile.enabled": False,
    "distributed.admin.tick.interval": "1s",
    "distributed.admin.system-monitor.interval": "2s",
    # Memory that goes back to the system after each run is paged in again for the next one: a tenth of a run's time.
    "distributed.nanny.pre-spawn-environ.MALLOC_TRIM_THRESHOLD_": _KEPT,
    "distributed.nanny.pre-spawn-environ.MALLOC_MMAP_THRESHOLD_": _LARGE,
}


class Cluster:
    """Workers of Dask, while this is entered.

    Args:
        parcel: what they need.
        scheduler: the address of one that is there; None starts one, and workers, on this machine.
        workers: how many of them; by default as many as there are processors.

    Attributes:
        dashboard: the address at which to look at what they do; empty where there is none.

    Raises:
        RailcosimError: from `rows`, too: there is no scheduler, or a worker cannot run the study at all.
    """

    def __init__(self, parcel: Parcel, scheduler: str | None = None, workers: int | None = None) -> None:
        self._parcel, self._scheduler, self._wanted = parcel, scheduler, workers
        self._held = ExitStack()
        self._counted, self._count = -_LOOK, 0
        self._own: Any = None
        self.dashboard = ""

    def __enter__(self) -> Cluster:
        with ExitStack() as held:
            held.enter_context(_dask().dask.config.set(_CONFIG))
            self._contents = [content for _, content in self._parcel.contents()]  # as they are now, for all workers
            client = self._remote() if self._scheduler else self._local(held)
            self._client = held.enter_context(client)
            self.dashboard = client.dashboard_link if _can_show() else ""
            self._held = held.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        closing = threading.Thread(target=self._close, name="closing")
        closing.start()
        while closing.is_alive():
            with suppress(KeyboardInterrupt):  # half closed, it would go on for longer at the end of the process
                closing.join()

    @property
    def workers(self) -> int:
        """How many there are now; of those on this machine, what Dask has given up is started again."""
        if world.monotonic() - self._counted > _LOOK:
            self._counted = world.monotonic()
            with suppress(OSError, TimeoutError):
                self._count = len(self._client.nthreads())
            # One that dies before its nanny has seen it run is not started again, and with none the runs would wait.
            if self._own is not None and self._count < (wanted := len(self._own.worker_spec)):
                for name, nanny in list(self._own.workers.items()):
                    if nanny.status.name in ("closed", "failed"):  # while there is one of that name, none is started
                        self._own.workers.pop(name, None)
                self._own.scale(wanted)
        return self._count

    def rows(
        self, points: Iterator[Point], count: int, is_over: Callable[[], bool] = lambda: False
    ) -> Iterator[tuple[Point, Row]]:
        """What comes out of runs, as it comes.

        Args:
            points: number and changes of each.
            count: how many they are.
            is_over: whether to leave it at that; asked several times a second.
        """
        flight = Flight(self, points, count)
        try:
            yield from flight.rows(is_over)
        finally:
            flight.end()

    def submit(self, changes: Sequence[Mapping[str, Any]], *, with_files: bool) -> Future:
        """Send runs away, with all files for a worker that has not had them yet."""
        contents = self._contents if with_files else None
        future: Future = self._client.submit(worker.work, self._parcel.sent(), list(changes), contents, pure=False)
        return future

    def wait_for_scheduler(self) -> None:
        """Wait for one that has lost everything to be there again.

        Raises:
            RunError: it is not.
        """
        until = world.monotonic() + _PATIENCE
        while self._client.status != "running":
            if self._client.status == "closed" or world.monotonic() > until:
                where = self._scheduler or "on this machine"
                raise RunError(f"the scheduler {where} is gone: start it and go on by --resume")
            world.sleep(0.1)

    def _close(self) -> None:
        with self._held:
            if self._scheduler and self._client.status == "running":  # its workers stay
                with suppress(OSError, TimeoutError):
                    self._client.run(worker.forget, self._parcel.digest)

    def _local(self, held: ExitStack) -> Any:
        dask = _dask()
        folder = Path(world.mkdtemp(prefix=PREFIX))
        held.callback(world.rmtree, folder, ignore_errors=True)
        held.callback(own(folder).release)
        sweep(folder)
        held.enter_context(dask.dask.config.set({"temporary-directory": str(folder)}))
        dask.utils.get_mp_context().Lock()  # its tracker makes the thread that starts it hear again
        try:
            with _deaf():
                self._own = dask.LocalCluster(
                    n_workers=self._wanted,
                    threads_per_worker=1,
                    worker_class=_nanny(dask),
                    processes=True,
                    host="127.0.0.1",
                    dashboard_address="127.0.0.1:0",  # None would take port 8787 all the same
                    local_directory=str(folder),
                    silence_logs=logging.CRITICAL,
                    death_timeout=f"{_START:g}s",
                    env={"TMPDIR": str(folder)},
                )
        except (TimeoutError, RuntimeError) as error:
            raise RailcosimError(
                f"not all workers came up within {_START:g} s on this machine ({error}); ask for fewer by --workers"
            ) from error
        held.callback(self._close_own)
        return dask.Client(self._own, set_as_default=False, timeout=_PATIENCE)

    def _close_own(self) -> None:
        """End the scheduler and the workers on this machine, within a time.

        Of a worker that is killed while it is being started Dask waits for ever to hear: ``multiprocessing`` goes on
        writing what it is to do into a pipe that nobody reads.
        """
        try:
            self._own.close(timeout=_PATIENCE)
        except TimeoutError:
            import psutil

            _LOG.warning("Dask does not end its workers within %g s: they are killed", _PATIENCE)
            for number in filter(None, [nanny.pid for nanny in self._own.workers.values()]):
                with suppress(psutil.Error):
                    psutil.Process(number).kill()
            _kill_untold(_PATIENCE / 2)

    def _remote(self) -> Any:
        try:
            return _dask().Client(self._scheduler, set_as_default=False, timeout=_PATIENCE)
        except (OSError, ValueError) as error:
            raise RailcosimError(
                f"no scheduler answers at {self._scheduler} ({error}); start one by 'dask scheduler', and workers by "
                f"'dask worker {self._scheduler} --nthreads 1'"
            ) from error


def _dask() -> Any:
    """Dask, an extra without types."""
    return importlib.import_module("distributed")


def _nanny(dask: Any) -> Any:
    """What starts and ends a worker, which Dask's leaves alive, and itself half closed, when it gives up its start."""

    class Nanny(dask.Nanny):  # type: ignore[misc]
        async def close(self, timeout: float = 5, reason: str = "nanny-close") -> str:
            started = self.process and self.process.process
            try:
                with suppress(AssertionError):  # of a process that is still coming up
                    await super().close(timeout=timeout, reason=reason)
            finally:
                with suppress(ValueError):  # of one that has ended, and is closed
                    if started and started.is_alive():
                        await started.kill()
                    elif started:
                        _kill_untold(_START / 2)
            return "OK"

    return Nanny


def _kill_untold(age: float) -> None:
    """Kill what ``multiprocessing`` has spawned so many s ago, and has still not told what to do.

    It writes that into a pipe, and waits where the pipe is full; until all of it is written nothing knows the process.
    """
    import psutil

    told = {one.pid for one in _dask().utils.get_mp_context().active_children()}
    for one in psutil.Process().children():
        with suppress(psutil.Error):
            is_spawned = "--multiprocessing-fork" in one.cmdline()
            if is_spawned and one.pid not in told and world.now() - one.create_time() > age:
                one.kill()


@contextmanager
def _deaf() -> Iterator[None]:
    """Let threads and processes that are started meanwhile not hear what a terminal says: it is meant for us."""
    if not hasattr(signal, "pthread_sigmask"):  # pragma: no cover: Windows
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGHUP})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _can_show() -> bool:
    """Whether there is what draws the dashboard, a package that Dask can do without."""
    return importlib.util.find_spec("bokeh") is not None
