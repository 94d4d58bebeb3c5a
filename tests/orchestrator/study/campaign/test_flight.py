"""Chunks under way: each run comes back once, whatever becomes of its worker."""

import itertools
import random
from collections import Counter
from concurrent.futures import CancelledError

import pytest
from distributed import KilledWorker
from railcosim.orchestrator import world
from railcosim.orchestrator.study import Row
from railcosim.orchestrator.study.campaign.flight import Flight


class Future:
    """What comes back at once."""

    numbers, status = itertools.count(), "finished"

    def __init__(self, outcome):
        self.key, self._outcomes, self.is_cancelled = next(self.numbers), [*outcome], False
        for one in self._outcomes:
            if isinstance(one, KilledWorker) and one.task == "own":
                one.args = (self.key, *one.args[1:])

    def add_done_callback(self, call):
        call(self)

    def result(self, timeout):
        assert timeout == 60.0
        outcome = self._outcomes.pop(0) if len(self._outcomes) > 1 else self._outcomes[0]
        if isinstance(outcome, Exception):
            raise outcome
        return outcome

    def cancel(self, force):
        assert force
        self.is_cancelled = True


class Workers:
    """Workers that some runs end, and that some first chunks do not come back from at once."""

    def __init__(self, workers=2, *, deadly=(), first=(), allowed=0):
        self.workers, self.deadly, self.first, self.allowed = workers, deadly, list(first), allowed
        self.sent, self.futures, self.waits, self.with_files = [], [], 0, []

    def submit(self, changes, *, with_files):
        self.with_files.append(with_files)
        numbers = [change["n"] for change in changes]
        self.sent.append(numbers)
        outcome = [([Row("completed", steps=number) for number in numbers], 0.1 * len(numbers))]
        if set(numbers) & set(self.deadly):
            outcome = [KilledWorker("own", None, self.allowed)]
        elif self.first:
            outcome = [self.first.pop(0), *outcome]
        self.futures.append(Future(outcome))
        return self.futures[-1]

    def wait_for_scheduler(self):
        self.waits += 1


def fly(workers, count=60, is_over=lambda: False):
    flight = Flight(workers, ((number, {"n": number}) for number in range(count)), count)
    found = list(flight.rows(is_over))
    flight.end()
    assert len({number for (number, _), _ in found}) == len(found)
    return {number: row for (number, _), row in found}


def test_all_come_back_in_chunks_that_grow():
    workers = Workers()
    rows = fly(workers)
    assert {number: row.steps for number, row in rows.items()} == {number: number for number in range(60)}
    assert [len(chunk) for chunk in workers.sent[:5]] == [1, 1, 1, 1, 7]


@pytest.mark.parametrize(("allowed", "times"), [(0, 3), (3, 8)])
def test_a_run_that_ends_its_worker_is_found_and_is_a_row(allowed, times, caplog):
    workers = Workers(deadly=[17, 40], allowed=allowed)
    rows = fly(workers)
    lost = {number: row.error for number, row in rows.items() if row.status == "failed"}
    assert sorted(lost) == [17, 40]
    assert lost[17].startswith(f"it ended the process of its worker {times} times")
    assert all(workers.sent.count([number]) == (3 if allowed == 0 else 2) for number in lost)
    assert len(rows) == 60
    assert caplog.messages == (
        ["a worker died, and what it had is run again; an FMU that crashes is kept to its own run by --isolate"]
    )


def test_a_neighbour_that_was_waiting_behind_such_a_run_is_not_blamed():
    workers = Workers(first=[KilledWorker("own", None, 3) for _ in range(4)])
    rows = fly(workers, 4)
    assert {row.status for row in rows.values()} == {"completed"}
    assert len(workers.sent) == 8


def test_files_go_to_who_has_not_had_them():
    workers = Workers(first=[None, None])
    rows = fly(workers, 3)
    assert {row.status for row in rows.values()} == {"completed"}
    assert workers.sent == [[0], [1], [2], [0], [1]]
    assert workers.with_files == [False, False, False, True, True]


@pytest.mark.parametrize("error", [CancelledError(), OSError("the connection is closed")])
def test_a_scheduler_that_began_anew_gets_what_it_lost(error):
    workers = Workers(first=[error, error])
    assert len(fly(workers)) == 60
    assert workers.waits == 2


@pytest.mark.parametrize("status", ["finished", "pending", "lost"])
def test_a_result_that_was_lost_with_its_worker_is_waited_for(monkeypatch, status):
    """No fetch is cut short for it: of that Dask's client does not recover."""
    monkeypatch.setattr(world, "sleep", lambda seconds: None)
    statuses = iter([status])
    monkeypatch.setattr(Future, "status", property(lambda _: next(statuses, "finished")))
    workers = Workers(first=[TimeoutError()])
    assert len(fly(workers)) == 60
    assert sum(map(len, workers.sent)) == 60


@pytest.mark.parametrize("seed", range(20))
def test_every_run_comes_once_whatever_is_lost_and_when(seed):
    """At random: workers die, the scheduler begins anew, results and files are lost; and two runs end any worker."""
    draw, kills = random.Random(seed), Counter()

    class Disturbed(Workers):
        def submit(self, changes, *, with_files):
            numbers = [change["n"] for change in changes]
            fate = draw.choice(["die", "lose", "wait", "forget", "", "", ""])
            self.first = []
            if fate == "die" and all(kills[number] < 2 for number in numbers):  # a third time would be its own doing
                kills.update(numbers)
                self.first = [KilledWorker("own", None, 0)]
            elif fate in ("lose", "wait"):
                self.first = [draw.choice([CancelledError(), OSError()]) if fate == "lose" else TimeoutError()]
            elif fate == "forget" and not with_files:
                self.first = [None]
            return super().submit(changes, with_files=with_files)

    deadly = set(draw.sample(range(60), 2))
    rows = fly(Disturbed(draw.randint(1, 4), deadly=deadly))
    assert sorted(rows) == list(range(60))
    assert {number for number, row in rows.items() if row.status == "failed"} == deadly
    assert all(row.steps == number for number, row in rows.items() if number not in deadly)


def test_it_ends_when_it_is_told_to():
    workers, looks = Workers(), iter([False] * 3)
    rows = fly(workers, is_over=lambda: next(looks, True))
    assert len(rows) == 3
    assert sum(future.is_cancelled for future in workers.futures) >= 1


def test_it_looks_up_while_nothing_comes(monkeypatch):
    monkeypatch.setattr(Future, "add_done_callback", lambda self, call: None)
    monkeypatch.setattr("railcosim.orchestrator.study.campaign.flight._TICK", 0.001)
    looks = iter([False] * 3)
    assert not fly(Workers(), is_over=lambda: next(looks, True))


def test_there_may_be_no_worker_yet():
    assert len(fly(Workers(0))) == 60
