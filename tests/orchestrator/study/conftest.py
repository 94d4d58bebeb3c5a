"""A small system of toys that batches run."""

import logging
from pathlib import Path

import pytest
from distributed import LocalCluster
from railcosim.orchestrator.scenario.loading import load

TOYS = Path(__file__).parents[2] / "toys.py"
TEXT = """
[simulation]
stop_time = 1.0
step = 0.1
seed = 5

[instances.lag]
component = "{toys}:Lag"
count = 2
start.rate = "0.5 * i"

[instances.ramp]
component = "{toys}:Ramp"

[instances.noise]
component = "{toys}:Noisy"

[connections]
"lag[i].u" = "ramp.x"

[[events]]
signal = "lag[1].rate"
action = "set"
at = 0.5
value = 2.0

[metrics]
end = "final(lag[i].x)"
most = "max(noise.y)"

[require]
low = "always lag[i].x <= 1.5"

[presets.steep]
"lag.rate" = 4.0
"""


@pytest.fixture
def scenario(tmp_path):
    """The path of the scenario."""
    path = tmp_path / "small.toml"
    path.write_text(TEXT.replace("{toys}", str(TOYS)), encoding="utf-8")
    return path


@pytest.fixture
def system(scenario):
    """The system of the scenario."""
    return load(scenario)


@pytest.fixture
def scheduler():
    """The address of one of Dask in this process, with a worker."""
    how = {"n_workers": 1, "threads_per_worker": 2, "processes": False, "silence_logs": logging.CRITICAL}
    # Without an address for it, Dask takes port 8787 even where nothing is shown: there is one such port on a machine.
    with LocalCluster(**how, dashboard_address="127.0.0.1:0", scheduler_kwargs={"dashboard": False}) as made:
        yield made.scheduler_address
