"""What cannot be resumed is refused in words, and what had been computed stays where it is."""

import json
import random
import shutil
import zipfile
from pathlib import Path

import pytest
from railcosim.orchestrator.errors import FmuError, RailcosimError, ScenarioError
from railcosim.orchestrator.run import checkpoint
from railcosim.orchestrator.run.execution import execute, resume, run
from railcosim.orchestrator.run.recording import Results
from railcosim.orchestrator.system import Event, System

TOYS = Path(__file__).parents[2] / "toys.py"


@pytest.fixture
def mine(tmp_path):
    """A toy out of a file that a test may change."""
    path = Path(shutil.copy(TOYS, tmp_path / "mine.py"))
    return lambda cls: f"{path}:{cls}"


def pair(mine, **how):
    """Two lags, one of which follows the other, and a wave."""
    system = System(**{"stop_time": 3.0, "step": 0.1} | how)
    system.add("a", mine("Lag"), x=2.0)
    system.add("b", mine("Lag"))
    system.add("wave", mine("Wave"))
    system.connect("a.x", "b.u")
    return system


def read(directory):
    """What a run has left."""
    return (directory / "results.csv").read_bytes(), json.loads((directory / "metrics.json").read_text())


@pytest.fixture
def made(mine, tmp_path):
    """A run with a checkpoint at 2 s, of the system of `pair`."""
    run(pair(mine), kind="plain", output=tmp_path / "out", checkpoint_every=2.0, figures=False)
    return tmp_path / "out"


def refusal(directory, **how):
    with pytest.raises(ScenarioError) as caught:
        resume(directory, **how)
    return str(caught.value)


def test_without_a_checkpoint(made, tmp_path):
    (made / "checkpoint.zip").unlink()
    wanted = "has no checkpoint.zip: only a run with --checkpoint-every can be resumed, once it has written one"
    assert refusal(made) == f"{made} {wanted}"
    assert refusal(tmp_path / "nowhere") == f"{tmp_path / 'nowhere'} {wanted}"


@pytest.mark.parametrize("stop", [2.0, 1.0, -1.0, float("nan")])
def test_a_stop_that_is_not_later(made, stop):
    assert "its checkpoint is at t = 2 s; it cannot go on to an earlier stop time" in refusal(made, stop_time=stop)


def test_a_stop_that_is_no_point(made):
    assert "stop_time = 2.55 s is not a whole multiple of step = 0.1 s" in refusal(made, stop_time=2.55)


def test_another_model_than_it_began_with(made, tmp_path):
    path = tmp_path / "mine.py"
    path.write_text(path.read_text().replace("3.0 * self.time", "3.5 * self.time"))
    before = (made / "results.csv").read_bytes()
    message = refusal(made)
    assert message.startswith(
        f"{made} cannot be resumed: a, b, wave are not the model the run began with (its file, or"
    )
    assert (made / "results.csv").read_bytes() == before


def test_another_fmu_of_the_same_name(tmp_path, foreign, xml):
    v = xml["variable"]
    how = {"simulation": 'canGetAndSetFMUstate="true" canSerializeFMUstate="true"'}
    system = System(stop_time=3.0, step=0.1)
    system.add("it", foreign([v("u", "input", start=0.0), v("y", "output")], **how))
    system.add("gust", "Gust")
    point = run(system, kind="python", output=tmp_path / "out")
    assert point.status == "completed"
    digests = {name: model.digest for name, model in point.checked.models.items()}
    taken = checkpoint.Checkpoint(system, "python", [[1, 0]], digests, {}, {}, 1.0, [], "")
    taken.check(point.checked.models, tmp_path)
    foreign([v("u", "input", start=1.0), v("y", "output")], **how)
    other = run(system, kind="python").checked.models
    with pytest.raises(ScenarioError, match=r"cannot be resumed: it is not the model the run began with"):
        taken.check(other, tmp_path)


def forget_the_end(directory):
    """Let the record be that of a run that was killed, which does not tell of its rows."""
    record = json.loads((directory / "run.json").read_text())
    del record["rows"]
    (directory / "run.json").write_text(json.dumps(record))


def test_results_with_too_few_rows(made):
    forget_the_end(made)
    path = made / "results.csv"
    path.write_text("".join(path.read_text().splitlines(keepends=True)[:21]))
    assert refusal(made) == (f"{made} cannot be resumed: its results have 20 rows, fewer than the 21 of its checkpoint")


def test_results_of_another_run(made, tmp_path):
    forget_the_end(made)
    lines = (made / "results.csv").read_text().splitlines()
    wanted = f"{made} cannot be resumed: its results and its checkpoint are of different runs"
    (made / "results.csv").write_text("\n".join(line.rpartition(",")[0] for line in lines) + "\n")
    assert refusal(made) == wanted
    longer = ["time" + lines[0][4:], *(f"{float(x.partition(',')[0]) * 2},{x.partition(',')[2]}" for x in lines[1:])]
    (made / "results.csv").write_text("\n".join(longer) + "\n")
    assert refusal(made) == wanted
    other = [lines[0], *(f"{line.rpartition(',')[0]},{k}" for k, line in enumerate(lines[1:]))]
    (made / "results.csv").write_text("\n".join(other) + "\n")
    assert refusal(made) == wanted
    (made / "results.csv").unlink()
    assert refusal(made).startswith(f"{made} cannot be resumed: its results cannot be read: [Errno 2] No such file")


@pytest.mark.parametrize("every", [0.0, -1.0, float("inf"), float("nan")])
def test_a_distance_that_is_none(mine, made, tmp_path, every):
    with pytest.raises(ScenarioError, match="checkpoints: their distance must be a positive number of s"):
        run(pair(mine), kind="plain", output=tmp_path / "new", checkpoint_every=every)
    assert not (tmp_path / "new").exists()
    assert "their distance must be" in refusal(made, checkpoint_every=every)


def test_checkpoints_are_files(mine):
    with pytest.raises(ScenarioError, match="checkpoints are files: name an output directory for them"):
        run(pair(mine), kind="plain", checkpoint_every=1.0)


def test_fmus_that_cannot_serialize_are_named_before_the_run(mine, foreign, xml, tmp_path):
    system = pair(mine)
    for name in ("mute", "dumb"):
        system.add(name, foreign([xml["variable"]("y", "output")], name=f"{name}.fmu"))
    with pytest.raises(ScenarioError) as caught:
        run(system, kind="plain", output=tmp_path / "out", checkpoint_every=1.0)
    assert str(caught.value) == (
        "no checkpoints: mute, dumb cannot serialize their state (canSerializeFMUstate is false); leave "
        "--checkpoint-every out, or put another model in by --swap"
    )
    assert not (tmp_path / "out").exists()


def test_an_fmu_that_promised_too_much_ends_the_run_and_keeps_its_rows(foreign, xml, tmp_path):
    how = {"simulation": 'canGetAndSetFMUstate="true" canSerializeFMUstate="true"'}
    system = System(stop_time=3.0, step=0.1)
    system.add("it", foreign([xml["variable"]("y", "output")], **how))
    outcome = execute(system, output=tmp_path, checkpoint_every=1.0)
    assert (outcome.status, outcome.error.instance) == ("failed", "it")
    assert Results.load(tmp_path).time[-1] == pytest.approx(1.0)
    assert not (tmp_path / "checkpoint.zip").exists()


def test_a_checkpoint_that_cannot_be_written(mine, tmp_path):
    (tmp_path / "checkpoint.zip.part").mkdir()
    with pytest.raises(RailcosimError, match=r"checkpoint\.zip\.part cannot be written: Is a directory"):
        run(pair(mine), kind="plain", output=tmp_path, checkpoint_every=1.0)
    assert Results.load(tmp_path).time[-1] == pytest.approx(1.0)
    assert json.loads((tmp_path / "run.json").read_text())["status"] == "failed"


def test_a_file_of_another_version(made):
    content = archive(made)
    point = json.loads(content["checkpoint.json"])
    content["checkpoint.json"] = json.dumps(point | {"format": 99})
    rewrite(made, content)
    assert refusal(made).endswith("checkpoint.zip is of another version of railcosim; run the scenario from the start")


def archive(directory):
    with zipfile.ZipFile(directory / "checkpoint.zip") as stream:
        return {name: stream.read(name) for name in stream.namelist()}


def rewrite(directory, content):
    with zipfile.ZipFile(directory / "checkpoint.zip", "w") as stream:
        for name, data in content.items():
            stream.writestr(name, data)


WRONG = {
    "no zip": lambda d: (d / "checkpoint.zip").write_bytes(b"PK, or not"),
    "nothing": lambda d: (d / "checkpoint.zip").write_bytes(b""),
    "half of it": lambda d: (d / "checkpoint.zip").write_bytes((d / "checkpoint.zip").read_bytes()[:2000]),
    "no json": lambda d: rewrite(d, archive(d) | {"checkpoint.json": b"{"}),
    "a list": lambda d: rewrite(d, archive(d) | {"checkpoint.json": b"[]"}),
    "an empty object": lambda d: rewrite(d, archive(d) | {"checkpoint.json": b"{}"}),
    "no states": lambda d: rewrite(d, {"checkpoint.json": archive(d)["checkpoint.json"]}),
    "no system": lambda d: change(d, system={}),
    "a system with more": lambda d: change(d, system=json.loads(archive(d)["checkpoint.json"])["system"] | {"x": 1}),
    "no progress": lambda d: change(d, progress={}),
    "no rows": lambda d: change(d, marks=[]),
    "rows in words": lambda d: change(d, marks=[["many", 0]]),
}


def change(directory, **parts):
    content = archive(directory)
    content["checkpoint.json"] = json.dumps(json.loads(content["checkpoint.json"]) | parts)
    rewrite(directory, content)


@pytest.mark.parametrize("wrong", WRONG)
def test_a_file_that_is_broken(made, wrong):
    WRONG[wrong](made)
    before = (made / "results.csv").read_bytes()
    message = refusal(made)
    assert message.startswith(f"{made / 'checkpoint.zip'} cannot be read (")
    assert message.endswith("); run the scenario from the start")
    assert (made / "results.csv").read_bytes() == before


def test_a_file_with_a_few_wrong_bytes(made, tmp_path):
    """Refused in words, or, where the byte says nothing, resumed as if nothing were."""
    wanted, whole = read(made), (made / "checkpoint.zip").read_bytes()
    draw, refused, read_well = random.Random(2), 0, 0
    for _ in range(150):
        content = bytearray(whole)
        for _ in range(draw.randrange(1, 4)):
            content[draw.randrange(len(content))] = draw.randrange(256)
        (made / "checkpoint.zip").write_bytes(content)
        try:
            checkpoint.read_checkpoint(made)
        except ScenarioError as error:
            refused += "checkpoint.zip " in str(error)
        else:
            shutil.copytree(made, tmp_path / "copy", dirs_exist_ok=True)
            resume(tmp_path / "copy", figures=False)
            assert read(tmp_path / "copy") == wanted
            read_well += 1
    assert refused + read_well == 150
    assert 0 < read_well < 50, (refused, read_well)


@pytest.mark.parametrize(
    "parts",
    [
        {"values": [1.0]},
        {"history": 5},
        {"events": {"acting": [["a", "x", 0, 0, 0.0, 1.0]]}},
        {"steps": None},
    ],
)
def test_progress_that_does_not_fit_the_system(mine, tmp_path, parts):
    system = pair(mine, events=[Event("a.x", "freeze", 1.0)])
    run(system, kind="plain", output=tmp_path, checkpoint_every=2.0, figures=False)
    before = read(tmp_path)[0]
    change(tmp_path, progress=json.loads(archive(tmp_path)["checkpoint.json"])["progress"] | parts)
    message = refusal(tmp_path)
    assert "different runs" in message or "does not fit" in message
    assert (tmp_path / "results.csv").read_bytes() == before


def test_states_that_an_fmu_does_not_take_back(mine, tmp_path):
    """The run fails, is said to have failed, and what was computed is still there."""
    run(pair(mine), kind="native", output=tmp_path, checkpoint_every=2.0, figures=False)
    before = read(tmp_path)[0]
    content = archive(tmp_path)
    content["states/1"] = content["states/1"][:-8]
    rewrite(tmp_path, content)
    with pytest.raises(FmuError) as caught:
        resume(tmp_path)
    assert caught.value.instance == "b"
    assert (tmp_path / "results.csv").read_bytes() == before
    assert json.loads((tmp_path / "run.json").read_text())["status"] == "failed"
    assert not list(tmp_path.glob("*.new"))


def test_a_new_run_in_the_same_place_takes_the_checkpoint_away(mine, made):
    run(pair(mine), kind="plain", output=made, figures=False)
    assert not (made / "checkpoint.zip").exists()
