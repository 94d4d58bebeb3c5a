"""Standard output and error that are closed, full or without a reader: the run goes on, its exit code is its own."""

import os
import subprocess
import sys

import pytest

COMMAND = "from railcosim.orchestrator.cli.app import main; main()"
RUN = """
[simulation]
stop_time = 1.0
step = 0.1
[instances.train]
component = "PointMassTrain"
start = { speed = 10.0, force = 0.0 }
[require]
forward = "always train.speed > 0"
faster = "finally train.speed > VALUE"
"""
pytestmark = pytest.mark.skipif(os.name != "posix", reason="of descriptors as POSIX has them")


@pytest.fixture
def outcome(tmp_path):
    """What becomes of a run whose command stands in a line of the shell: it must be complete."""

    def run(line, speed):
        scenario, out = tmp_path / "small.toml", tmp_path / "out"
        scenario.write_text(RUN.replace("VALUE", str(speed)))
        command = f"'{sys.executable}' -c '{COMMAND}' run '{scenario}' -o '{out}'"
        whole = f"set -o pipefail; {line.replace('RUN', command)}"
        done = subprocess.run(["bash", "-c", whole], capture_output=True, text=True, timeout=60, check=False)
        rows = (out / "results.csv").read_text().splitlines()
        assert len(rows) == 12
        assert all(row[0].isdigit() for row in rows[1:])  # nothing printed has come in between
        assert "Traceback" not in done.stderr
        return done

    return run


@pytest.mark.parametrize("line", ["RUN >&-", "RUN 2>&-", "RUN <&- >&- 2>&-", "RUN 2> /dev/full"])
def test_the_exit_code_is_that_of_the_run(line, outcome):
    assert outcome(line, 99).returncode == 1


def test_what_is_lost_on_a_full_disk_is_told(outcome):
    done = outcome("RUN >/dev/full", 0)
    assert done.returncode == 0
    assert "warning: what was printed is lost: No space left on device\n" in done.stderr


def test_a_reader_that_is_gone_is_nothing_to_speak_of(outcome):
    done = outcome("RUN | true", 0)
    assert done.returncode == 0
    assert "lost" not in done.stderr
