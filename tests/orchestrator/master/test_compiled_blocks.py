"""The compiled step loop: how long a block is, and what interrupts one."""

import json
import shutil
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from railcosim.orchestrator.master import compiled
from railcosim.orchestrator.run.recording import Results

GCC = shutil.which("gcc")
pytestmark = [
    pytest.mark.skipif(compiled.kernel is None, reason="installed without the compiled step loop"),
    pytest.mark.skipif(not sys.platform.startswith("linux"), reason="FMUs by hand are compiled for Linux here"),
    pytest.mark.skipif(GCC is None, reason="FMUs by hand need gcc"),
]


# -------------------------------------------------------------------- blocks


def test_an_observer_ends_a_run_between_blocks(workspace, odd, ring, instantiated):
    master, seen = instantiated(ring(odd, 2)), []
    assert not master.run(0.0, 0.25, 10_000_000, 1, lambda k, rows: seen.append((k, len(rows))) or len(seen) < 4)
    assert seen[0] == (1, 1)
    assert sum(count for _, count in seen) == seen[-1][0] == master.steps < 10_000_000
    assert not master.run(0.0, 0.25, 1, 1, lambda *_: False), "not even at the last step"


def test_blocks_are_short_in_time(workspace, odd, ring, instantiated):
    """So that a progress bar moves and Ctrl-C is heeded; and long enough that Python costs nothing."""
    master, ends = instantiated(ring(odd, 100)), [time.perf_counter()]
    master.run(0.0, 0.25, 10_000_000, 10, lambda *_: ends.append(time.perf_counter()) or ends[-1] - ends[0] < 1.0)
    lengths = np.diff(ends)
    assert lengths.max() < 0.5
    assert np.median(lengths[3:]) > 0.01


ENDLESS = """
import sys
from railcosim.orchestrator import System, run
system = System(stop_time=1e9, step=0.25, record=25.0)
system.add("a", sys.argv[1], u=1.5)
system.add("b", sys.argv[1], v=0.5)
system.connect("a.y", "b.u")
print(run(system, output=sys.argv[2]).status)
"""


@pytest.mark.long
def test_ctrl_c_and_kill(odd, tmp_path):
    """Ctrl-C ends the run at a recorded point; after a kill the rows are there up to about a second before."""
    for ending in (signal.SIGINT, signal.SIGKILL):
        out = tmp_path / ending.name
        with subprocess.Popen([sys.executable, "-c", ENDLESS, odd, out], stdout=subprocess.PIPE, text=True) as process:
            while not (out / "results.bin").exists() or (out / "results.bin").stat().st_size < 5000:
                assert process.poll() is None
                time.sleep(0.02)
            process.send_signal(ending)
            said, _ = process.communicate(timeout=60)
        assert said.strip() == ("interrupted" if ending == signal.SIGINT else "")
        loaded = Results.load(out)
        assert not loaded.completed
        assert len(loaded.time) > 100
        whole = loaded.time[:-1] if ending == signal.SIGINT else loaded.time
        assert np.array_equal(whole, np.arange(len(whole)) * 25.0)
        assert (out / "results.csv").exists() == (ending == signal.SIGINT)
        if ending == signal.SIGINT:
            assert json.loads((out / "run.json").read_text())["time_reached"] == loaded.time[-1]
