"""One run at a time owns a directory, and what two runs have written is never taken for one."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from railcosim.orchestrator import Results, load, run
from railcosim.orchestrator.errors import RailcosimError, ScenarioError
from railcosim.orchestrator.run import resume
from railcosim.orchestrator.run.directory import RunDirectory

COMMAND = [sys.executable, "-c", "from railcosim.orchestrator.cli.app import main; main()"]


def train(tmp_path, speed=10.0):
    path = tmp_path / "train.toml"
    path.write_text(
        "[simulation]\nstop_time = 2.0\nstep = 0.1\n[instances.train]\ncomponent = 'PointMassTrain'\n"
        f"start = {{ speed = {speed}, force = 0.0 }}\n"
    )
    return path


def test_a_directory_in_use_is_refused_and_the_run_in_it_is_left_alone(tmp_path):
    out = tmp_path / "out"
    run(load(str(train(tmp_path))), kind="plain", output=out, checkpoint_every=1.0, figures=False)
    before = {path.name: path.read_bytes() for path in out.iterdir()}
    with RunDirectory(out):
        done = subprocess.run(
            [*COMMAND, "run", train(tmp_path, 20.0), "-o", "out", "--kind", "plain"],
            capture_output=True,
            text=True,
            cwd=tmp_path,
            check=False,
        )
        with pytest.raises(RailcosimError, match="in use by another run"):
            resume(out, stop_time=3.0)
    assert done.returncode == 2
    assert f"error: out is in use by another run (train, process {os.getpid()} on " in done.stderr
    assert "; name another directory by -o" in done.stderr
    assert {path.name: path.read_bytes() for path in out.iterdir()} == before
    assert resume(out, stop_time=3.0).status == "completed"


def test_the_lock_dies_with_its_owner(tmp_path):
    code = "import os, sys; from pathlib import Path\nfrom railcosim.orchestrator.run.directory import RunDirectory\n"
    code += "RunDirectory(Path(sys.argv[1])).__enter__(); os._exit(0)"
    subprocess.run([sys.executable, "-c", code, tmp_path], check=True)
    with RunDirectory(tmp_path):
        pass


def test_the_place_is_settled_at_once(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    place = RunDirectory(Path("out"))
    monkeypatch.chdir("/")
    with place:
        assert (tmp_path / "out").is_dir()
    assert (place.given, place.path) == (Path("out"), tmp_path / "out")


def test_rows_of_another_run_are_refused(tmp_path):
    """Two runs of one scenario, which differ in a start value: files of both in one directory."""
    one, two = tmp_path / "one", tmp_path / "two"
    for out, speed in ((one, 10.0), (two, 20.0)):
        run(load(str(train(tmp_path, speed))), kind="plain", output=out, checkpoint_every=1.0, figures=False)
    assert len({json.loads((out / "run.json").read_text())["run"] for out in (one, two)}) == 2
    (one / "results.csv").write_bytes((two / "results.csv").read_bytes())
    with pytest.raises(ScenarioError, match=r"results\.csv is not that of the run in run\.json"):
        Results.load(one)
    with pytest.raises(ScenarioError, match="its results and its checkpoint are of different runs"):
        resume(one, stop_time=3.0)
    (one / "run.json").write_bytes((two / "run.json").read_bytes())
    assert len(Results.load(one).time) == 21  # all of the other one's, but for the checkpoint
    with pytest.raises(ScenarioError, match="its results and its checkpoint are of different runs"):
        resume(one, stop_time=3.0)


def test_runs_of_the_same_are_the_same_to_the_byte(tmp_path):
    for name in "ab":
        run(load(str(train(tmp_path))), kind="plain", output=tmp_path / name, figures=False)
    for name in ("results.csv", "metrics.json", "units.json"):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()
