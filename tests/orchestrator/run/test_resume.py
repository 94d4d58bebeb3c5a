"""What was interrupted is taken up: after a kill, Ctrl-C or a failure; what is on the disk never becomes less."""

import json
import os
import signal
import subprocess
import sys
import time
from contextlib import contextmanager

import numpy as np
import pytest
from railcosim.orchestrator import load, world
from railcosim.orchestrator.cli import app as cli
from railcosim.orchestrator.cli import printing
from railcosim.orchestrator.cli.printing.progress import Shown
from railcosim.orchestrator.errors import FmuError
from railcosim.orchestrator.run import checkpoint, session
from railcosim.orchestrator.run.execution import execute, resume, run
from railcosim.orchestrator.run.recording import ROWS_FILE, Recorder, Results
from railcosim.orchestrator.run.recording import recorder as recording
from railcosim.orchestrator.system import System

POSIX = pytest.mark.skipif(sys.platform == "win32", reason="signals")
SCENARIO = """title = "Two things"
[simulation]
stop_time = 4.0
step = 0.1
record = 0.3
[instances.thing]
component = "{model}"
count = 2
start.x = [1.0, 5.0]
[connections]
"thing[1].u" = "thing[2].x"
"thing[2].u" = "thing[1].x"
[[events]]
signal = "thing[2].x"
action = "bias"
at = 1.0
value = 0.5
duration = 2.0
[require]
low = "always thing[2].x < 100"
[metrics]
end = "final(thing[1].x)"
[[figures]]
title = "Both"
y = ["thing[:].x"]
"""


@pytest.fixture
def scenario(mine, tmp_path):
    path = tmp_path / "things.toml"
    path.write_text(SCENARIO.format(model=mine("Lag")))
    return path


@pytest.fixture
def orchestrate(capsys):
    """Run a command; exit code, what it prints, what it says to be wrong."""

    def call(*arguments):
        code = cli.call([str(argument) for argument in arguments])
        said = capsys.readouterr()
        return code, said.out, said.err

    return call


def things(mine, words=False, **how):
    system = System(**{"stop_time": 4.0, "step": 0.1} | how)
    for name, x in (("a", 1.0), ("b", 5.0)):
        system.add(name, mine("Lag"), x=x)
    system.connect("a.x", "b.u")
    system.connect("b.x", "a.u")
    if words:
        system.add("word", mine("Word"))
    return system


def interrupted(system, at, directory, every=1.0, **how):
    """A run that is stopped by Ctrl-C at a time in s, or a little later."""

    def press(now, _):
        if now >= at:
            os.kill(os.getpid(), signal.SIGINT)

    return execute(system, kind="plain", output=directory, checkpoint_every=every, progress=press, figures=False, **how)


# -------------------------------------------------------------------- after Ctrl-C, and after a kill


@POSIX
@pytest.mark.parametrize("words", [False, True])
@pytest.mark.parametrize("record", [None, 0.3])
def test_after_ctrl_c(mine, tmp_path, words, record):
    """The point at which it was stopped stands in the record of rows, though none was due; resumed, it does not."""
    system = things(mine, words, record=record)
    run(system, kind="plain", output=tmp_path / "whole", figures=False)
    stopped = interrupted(system, 2.59, tmp_path / "parts")
    assert (stopped.status, stopped.time[-1]) == ("interrupted", pytest.approx(2.6))
    assert checkpoint.read_checkpoint(tmp_path / "parts").time == 2.0
    result = resume(tmp_path / "parts", figures=False)
    assert result.status == "completed"
    for name in ("results.csv", "metrics.json"):
        assert (tmp_path / "parts" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes()
    assert not list(tmp_path.glob("parts/*.new"))
    judged = ["seen.bin"] if system.stepping.record else []  # points that are no results, for who goes on
    assert [path.name for path in tmp_path.glob("parts/*.bin")] == judged


LONG = """
import sys
from railcosim.orchestrator import System, resume, run
if sys.argv[1] == "resume":
    resume(sys.argv[2], stop_time=1e6, checkpoint_every=1.0)
else:
    system = System(stop_time=1e6, step=0.01, record=0.1)
    for name, x in (("a", 1.0), ("b", 5.0)):
        system.add(name, sys.argv[1], x=x)
    system.connect("a.x", "b.u")
    system.connect("b.x", "a.u")
    run(system, kind="plain", output=sys.argv[2], checkpoint_every=1.0)
"""


def killed(what, directory, until):
    """Run in a process of its own until a checkpoint is as far as that, and kill it."""
    with subprocess.Popen([sys.executable, "-c", LONG, what, directory]) as process:
        try:
            while not (directory / "checkpoint.zip").exists() or checkpoint.read_checkpoint(directory).time < until:
                assert process.poll() is None
                time.sleep(0.02)
        finally:
            process.kill()


@POSIX
def test_after_a_kill_and_a_kill_while_it_was_resumed(mine, tmp_path):
    """Rows since the last flush are lost with the process, and computed again."""
    model, out = mine("Lag"), tmp_path / "out"
    killed(model, out, 3.0)
    first = checkpoint.read_checkpoint(out).time
    assert json.loads((out / "run.json").read_text())["status"] == "running"
    assert (out / "results.bin").exists()
    before = len(Results.load(out).time)
    killed("resume", out, first + 3.0)
    point = checkpoint.read_checkpoint(out)
    assert len(Results.load(out).time) >= max(before, point.rows)
    stop = point.time + 5.0
    result = resume(out, stop_time=stop, figures=False)
    assert result.seconds["steps"] == pytest.approx(500)
    system = result.system
    run(system, kind="plain", output=tmp_path / "whole", figures=False)
    assert (out / "results.csv").read_bytes() == (tmp_path / "whole/results.csv").read_bytes()
    assert sorted(path.name for path in out.iterdir()) == [
        ".lock", "checkpoint.zip", "metrics.json", "results.csv", "run.json", "seen.bin", "units.json",
    ]  # fmt: skip


@POSIX
@pytest.mark.parametrize("words", [False, True])
@pytest.mark.parametrize("ended", ["killed", "interrupted"])
def test_nothing_is_lost_whenever_a_resumed_run_is_killed(mine, tmp_path, monkeypatch, words, ended):
    """After every single step, every renaming and every removal of a file, all rows of before can be read."""
    system = things(mine, words)
    out = tmp_path / "out"
    interrupted(system, 3.0, out, every=1.3)
    if ended == "killed" and not words:  # a run with texts has its results as text from the beginning
        columns = Results.load(out)
        identity = json.loads((out / "run.json").read_text())["run"]
        (out / "results.csv").unlink()
        recorder = Recorder(list(columns.names()), ["Real"] * 2, out / ROWS_FILE, identity=identity)
        recorder.extend(np.array([columns.time, *(columns[name] for name in columns.names())]).T)
        recorder.flush()
        recorder._writer._file.close()  # as the end of its process does
        assert [path.name for path in out.glob("results*")] == ["results.bin"]
    before = Results.load(out)
    assert len(before.time) > 30
    looks = []

    def look(*_):
        now = Results.load(out)
        looks.append(len(now.time))
        assert np.array_equal(now.time[: len(before.time)], before.time)
        for name in before.names():
            assert np.array_equal(now[name][: len(before.time)], before[name])

    def looking(function):
        def wrapped(*arguments, **rest):
            look()
            done = function(*arguments, **rest)
            look()
            return done

        return wrapped

    monkeypatch.setattr(recording, "_FLUSH_SECONDS", -1.0)
    for name in ("replace", "unlink"):
        monkeypatch.setattr(world, name, looking(getattr(world, name)))
    result = resume(out, progress=look, figures=False)
    assert result.status == "completed"
    assert (looks[0], looks[-1]) == (len(before.time), 41)
    assert len(set(looks)) > 5, "the new rows are seen as soon as there are more of them than before"


@POSIX
def test_a_stop_before_the_old_end_leaves_the_rows_up_to_there(mine, tmp_path):
    """Ctrl-C is an end: what is on the disk is what the record says."""
    out = tmp_path / "out"
    run(things(mine), kind="plain", output=out, checkpoint_every=1.0, figures=False)
    interrupted_again = []

    def press(now, _):
        interrupted_again.append(os.kill(os.getpid(), signal.SIGINT))

    result = resume(out, progress=press, figures=False)
    assert result.status == "interrupted"
    assert len(Results.load(out).time) == 32
    assert json.loads((out / "run.json").read_text())["time_reached"] == pytest.approx(3.1)
    assert not list(out.glob("*.new"))


def test_a_resumption_that_does_not_begin_leaves_what_there_was(mine, tmp_path, monkeypatch):
    """An FMU that cannot be had once, for want of a licence say, costs nothing of what was computed."""
    out = tmp_path / "out"
    run(things(mine), kind="plain", output=out, checkpoint_every=1.0, stop_time=2.5, figures=False)
    before = Results.load(out)
    with monkeypatch.context() as patch:
        patch.setattr(session, "assembled", lambda *_, **__: (_ for _ in ()).throw(FmuError("no licence")))
        with pytest.raises(FmuError, match="no licence"):
            resume(out, stop_time=4.0, figures=False)
    record = json.loads((out / "run.json").read_text())
    assert (record["status"], record["error"]) == ("failed", "no licence")
    assert np.array_equal(Results.load(out)["a.x"], before["a.x"])
    assert resume(out, stop_time=4.0, figures=False).status == "completed"


# -------------------------------------------------------------------- the command line


def test_a_run_and_its_resumption(orchestrate, scenario, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    arguments = ["run", scenario, "--kind", "plain", "--no-figures"]
    assert orchestrate(*arguments, "-o", "whole", "--stop", 6)[0] == 0
    code, _, err = orchestrate(*arguments, "-o", "parts", "--checkpoint-every", 1.5)
    assert code == 0
    assert len(err.splitlines()) == 10
    code, out, err = orchestrate("run", scenario, "--resume", "parts", "--stop", 6, "--no-figures")
    assert code == 0
    assert "Two things" in out
    assert "\n1 event, listed in run.json\n" in out
    assert "1 of 1 requirements pass" in out
    assert err.splitlines() == [f"things: {percent} % of 6 s" for percent in range(60, 101, 10)]
    for name in ("results.csv", "metrics.json"):
        assert (tmp_path / "parts" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes()
    told = [json.loads((tmp_path / name / "run.json").read_text()) for name in ("parts", "whole")]
    assert [one["resumed"] for one in told] == [pytest.approx(3.0), None]
    assert told[0]["command"] == told[1]["command"] == f"orchestrate run {scenario} --stop 6.0 --kind plain"
    assert orchestrate("run", "--trust", "--resume", "parts", "--stop", 7, "--quiet") == (0, "", "")
    assert (tmp_path / "parts/both.png").exists()


def test_a_requirement_that_fails_in_the_end_ends_with_1(orchestrate, scenario, tmp_path):
    scenario.write_text(scenario.read_text().replace("< 100", "< 3"))
    out = tmp_path / "out"
    assert orchestrate("run", scenario, "--kind", "plain", "--checkpoint-every", 1, "-o", out, "-q")[0] == 1
    assert orchestrate("run", "--resume", out, "-q", "--trust")[0] == 1


def test_a_model_that_fails_ends_with_3_and_says_how_to_go_on(orchestrate, scenario, mine, tmp_path):
    text = scenario.read_text() + '[instances."thing[2]"]\n' + f'component = "{mine("Fails")}"\nstart.until = 2.95\n'
    scenario.write_text(text.replace("start.x = [1.0, 5.0]\n", ""))
    out = tmp_path / "out"
    for arguments in (
        ["run", scenario, "--kind", "plain", "--checkpoint-every", 1, "-o", out],
        ["run", "--resume", out, "--trust"],
    ):
        code, said, err = orchestrate(*arguments)
        assert code == 3, err
        assert f"to go on from the last checkpoint: orchestrate run --resume {out} --trust\n" in said
        assert "failed at t = " in said
        assert "error: an FMU failed: thing[2], t = " in err


@POSIX
def test_an_interrupted_run_says_how_to_go_on(orchestrate, scenario, tmp_path, monkeypatch):
    @contextmanager
    def pressing(*_):
        yield Shown(lambda now, _: os.kill(os.getpid(), signal.SIGINT) if now > 2.5 else None, lambda *_: None)

    out = tmp_path / "out"
    with monkeypatch.context() as patch:
        patch.setattr(printing, "show_progress", pressing)
        code, said, _ = orchestrate("run", scenario, "--kind", "plain", "--checkpoint-every", 1, "-o", out)
    assert code == 130
    assert "interrupted at t = 2.6 s of 4 s\n" in said
    assert f"to go on from the last checkpoint: orchestrate run --resume {out} --trust\n" in said
    code, said, _ = orchestrate("run", "--resume", out, "--trust")
    assert code == 0
    assert "to go on" not in said


WITH_RESUME = [
    ["SCENARIO", "--preset", "x"],
    ["--set", "thing.x=1"],
    ["--with", "thing.x=1"],
    ["--swap", "thing=Gust"],
    ["--step", "0"],
    ["--step", "0.05"],
    ["--algorithm", "jacobi"],
    ["--kind", "plain"],
    ["--isolate", "all"],
    ["--verify-step"],
    ["--output", "elsewhere"],
]


@pytest.mark.parametrize("other", WITH_RESUME, ids=" ".join)
def test_a_resumed_run_is_not_changed(orchestrate, scenario, tmp_path, other):
    out = tmp_path / "out"
    run(load(scenario), kind="plain", output=out, checkpoint_every=1.0, figures=False)
    before = (out / "run.json").read_bytes()
    other = [str(scenario) if word == "SCENARIO" else word for word in other]
    code, said, err = orchestrate("run", *other, "--resume", out)
    assert (code, said) == (2, "")
    assert err.startswith("error: --resume takes the run as its directory has it: give no change but --stop; ")
    assert (out / "run.json").read_bytes() == before


@pytest.mark.parametrize(
    "case",
    [
        ([], "error: name a scenario (see 'orchestrate list'), or a run to go on with by --resume DIR"),
        (["--trust", "--resume", "OUT", "--stop", "0.5"], "it cannot go on to an earlier stop time, 0.5 s"),
        (
            ["--trust", "--resume", "OUT", "--stop", "4.04"],
            "stop_time = 4.04 s is not a whole multiple of step = 0.1 s",
        ),
        (
            ["--trust", "--resume", "OUT", "--checkpoint-every", "-1"],
            "their distance must be a positive number of s, not -1.0",
        ),
        (["--resume", "nowhere"], "nowhere has no checkpoint.zip: only a run with --checkpoint-every can be resumed"),
        (["SCENARIO", "--checkpoint-every", "0"], "their distance must be a positive number of s, not 0.0"),
        (["SCENARIO", "--checkpoint-every", "nan"], "their distance must be a positive number of s, not nan"),
        (["SCENARIO", "--checkpoint-every", "often"], "Invalid value for '--checkpoint-every'"),
    ],
)
def test_wrong_input(orchestrate, scenario, tmp_path, case, monkeypatch):
    arguments, message = case
    monkeypatch.chdir(tmp_path)
    run(load(scenario), kind="plain", output=tmp_path / "OUT", checkpoint_every=1.0, figures=False)
    code, said, err = orchestrate("run", *(str(scenario) if word == "SCENARIO" else word for word in arguments))
    assert (code, said) == (2, "")
    assert message in err


# -------------------------------------------------------------------- looking at a run that was killed


def test_plot_makes_the_table_of_a_run_that_was_killed_or_goes_on(orchestrate, scenario, tmp_path, monkeypatch):
    """The numbers stay where they are, for whoever writes them may be alive; it then replaces the table."""
    out, codes = tmp_path / "out", []
    monkeypatch.setattr(recording, "_FLUSH_SECONDS", -1.0)

    def look(now, _):
        if not codes and now > 2.0:
            assert not (out / "results.csv").exists()
            codes.append(orchestrate("plot", out, "-o", tmp_path / "figures"))
            codes.append((out / "results.csv").read_text())
            assert (out / "results.bin").exists()

    execute(load(scenario), kind="plain", output=out, progress=look, figures=False)
    code, said, err = codes[0]
    assert (code, err) == (0, "")
    assert said.splitlines() == [str(out / "results.csv"), str(tmp_path / "figures/both.png")]
    assert (tmp_path / "figures/both.png").exists()
    final = (out / "results.csv").read_text()
    assert final.startswith(codes[1])
    assert len(codes[1].splitlines()) == 1 + 8 < len(final.splitlines())
    assert not (out / "results.bin").exists()
    assert orchestrate("plot", out, "thing[1].x", "-o", tmp_path)[1].splitlines() == [str(tmp_path / "thing-1-x.png")]
