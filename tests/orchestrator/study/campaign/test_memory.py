"""A study of very many runs takes no more memory than one of few: runs are on disk, and not in the process."""

import psutil
import pytest
from railcosim.orchestrator.study.campaign import run_study, running
from railcosim.orchestrator.study.rows import Row

from .conftest import plan_of

RUNS = 100_000


class Quick:
    """Workers whose runs take no time."""

    workers, dashboard = 2, ""

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    def rows(self, points, count, is_over):
        for number, changes in points:
            row = {"end[1]": float(number), "end[2]": changes["lag.rate"], "most": 1.0}
            yield (
                (number, changes),
                Row("completed", metrics=row, verdicts={"low": "pass"}, margins={"low": 0.5}, scaled={"low": 0.5}),
            )


@pytest.mark.long
def test_memory_stays_flat_over_a_hundred_thousand_runs(system, how, tmp_path, monkeypatch):
    monkeypatch.setattr(running, "pool_for", lambda *_: Quick())
    me, sizes = psutil.Process(), {}

    def look(done, count, failed):
        if done in (RUNS // 5, RUNS):
            sizes[done] = me.memory_info().rss

    study = run_study(plan_of(system, runs=RUNS), how, tmp_path / "out", progress=look)
    assert study.told["status"] == "completed"
    assert len(study) == RUNS
    assert sizes[RUNS] - sizes[RUNS // 5] < 100 * (RUNS - RUNS // 5)  # bytes: a row that is kept takes over a thousand
