"""Studies and searches whose pages are looked at."""

import json

import pandas as pd
import pytest
from railcosim.orchestrator.scenario import load
from railcosim.orchestrator.study.campaign import run_study
from railcosim.orchestrator.study.design import make_plan

TEXT = """title = "Lags <b>$$x$$</b>"
[simulation]
stop_time = 1.0
step = 0.25
[instances.lag]
component = "{model}"
[metrics]
end = "final(lag.x)"
[require]
"<i>low" = "always lag.x <= 0.5"
never = "always lag.x <= -1"
[study.vary]
"lag.u" = [0.5, 1.0, 2.0]
"lag.x" = "uniform(0.0, 0.4)"
"""


@pytest.fixture
def study(mine, tmp_path):
    """The directory of a study with runs that pass and that fail; by arguments of its plan."""

    def make(runs=6, **how):
        path = tmp_path / "lags.toml"
        path.write_text(TEXT.format(model=mine("Lag")))
        told = {"scenario": str(path), "kind": "plain", "record": ["lag.x"]} | how
        done = run_study(make_plan(load(path), runs=runs, seed=3), told, tmp_path / "out", workers=0)
        return done.directory

    return make


@pytest.fixture
def search(tmp_path):
    """The directory of a search, with what its search.json says."""

    def make(**told):
        directory = tmp_path / "search"
        directory.mkdir(exist_ok=True)
        frame = pd.DataFrame(
            {
                "run": [1, 0, 2],
                "lag.u": [0.5, 1.0, None],
                "lag": [None, "Other", None],
                "seed": 0,
                "status": ["completed", "completed", "failed"],
                "error": ["", "", "it <fails>"],
                "seconds": 0.1,
                "steps": 4,
                "metric.end": [1.0, 2.0, None],
                "metric.objective_2_": [3.0, 1.0, None],
                "verdict.low": ["pass", "fail", None],
                "margin.low": [0.5, -0.5, None],
                "robustness.low": [0.1, -0.1, None],
            }
        )
        frame.to_parquet(directory / "runs.parquet")
        (directory / "search.json").write_text(json.dumps({"vary": ["lag.u=0:2"], "seed": 7} | told))
        return directory

    return make
