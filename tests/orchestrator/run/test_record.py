"""What ``run.json``, ``metrics.json`` and ``units.json`` say of a run."""

import hashlib
import json
import math
import shlex
from datetime import date

import pytest
from railcosim.fmus.build import build
from railcosim.orchestrator.isolation import isolate
from railcosim.orchestrator.run.execution import run
from railcosim.orchestrator.run.record import _plain
from railcosim.orchestrator.scenario import load
from railcosim.orchestrator.system import System


@pytest.fixture
def files(tmp_path):
    """Run a system with names that were confused once; its three files, parsed."""
    system = System(
        stop_time=2.0, step=0.1, record=0.5, seed=7, title="T", text="title = 'T'", name="case", path="case.toml"
    )
    system.add("train", "PointMassTrain", speed=20.0)
    system.add("timetable", "Schedule", {"points": 2}, times=[0.0, 1.0], values=[3.0, 5.0])
    system.add("force", "Schedule", {"unit": "N"}, values=1e5)
    system.connect("force.value", "train.force", delay=1)
    system.judged.requirements["slow"] = "always train.speed <= 30"
    system.judged.metrics["end"] = "final(train.speed)"
    system.judged.published.append(
        {"metric": "end", "value": 20.0, "tolerance": 5.0, "where": "here", "origin": "stated"}
    )
    result = run(system, kind="python", output=tmp_path)
    return result, *(json.loads((tmp_path / f"{name}.json").read_text()) for name in ("run", "metrics", "units"))


def test_the_record_says_which_algorithm_order_and_delays_produced_the_numbers(files):
    _, record, _, _ = files
    assert record["algorithm"] == "gauss-seidel"
    assert record["order"] == ["train", "timetable", "force"]
    assert record["late"] == []
    assert record["delays"] == {"train.force": 1}
    assert (record["start_time"], record["stop_time"], record["step"], record["record"], record["seed"]) == (
        0,
        2,
        0.1,
        0.5,
        7,
    )


def test_the_record_identifies_models_data_and_program(files):
    _, record, _, _ = files
    train = record["instances"]["train"]
    assert train["digest"] == hashlib.sha256(build("PointMassTrain", kind="python").read_bytes()).hexdigest()
    assert (train["model"], train["kind"], train["start"]) == ("PointMassTrain", "python", {"speed_start": 20.0})
    assert record["instances"]["timetable"]["build"] == {"points": 2}
    assert record["versions"].keys() >= {"railcosim", "fmpy", "pythonfmu", "numpy"}
    assert record["scenario_text"] == "title = 'T'"
    assert (record["scenario"], record["path"], record["title"], record["kind"]) == ("case", "case.toml", "T", "python")
    assert record["python"]
    assert record["platform"]


def test_the_record_gives_parameters_as_the_run_used_them(files):
    _, record, _, _ = files
    assert record["parameters"]["train.mass"] == 400e3
    assert record["parameters"]["timetable.values[2]"] == 5.0
    assert "train.speed" not in record["parameters"]


def test_the_end_of_the_run(files):
    result, record, _, _ = files
    assert (record["status"], record["error"], record["time_reached"]) == ("completed", None, 2.0)
    assert record["seconds"] == result.seconds
    assert record["seconds"]["steps"] == 20


def test_units_of_everything_that_is_recorded(files):
    """An instance whose name begins with "time" is no time."""
    result, _, _, units = files
    assert units["time"] == "s"
    assert units["train.speed"] == "m/s"
    assert units["timetable.value"] == "m/s"
    assert units["force.value"] == "N"
    assert {name for name in result.names() if name not in units} == set()


def test_metrics_verdicts_and_published_values(files):
    result, _, metrics, _ = files
    assert metrics["metrics"]["end"]["values"] == {"": result["train.speed"][-1]}
    assert [row["verdict"] for row in metrics["requirements"]] == ["pass"]
    assert metrics["status"] == "completed"
    assert [(row["origin"], row["value"], row["verdict"]) for row in metrics["published"]] == [
        ("stated", 20.0, "reproduced")
    ]
    assert metrics["references"] == []


def test_no_part_file_is_left(files):
    assert not list(files[0].directory.glob("*.part"))


def test_jacobi_has_no_order(tmp_path):
    system = System(stop_time=1.0, step=0.5, algorithm="jacobi")
    system.add("gust", "Gust")
    run(system, kind="plain", output=tmp_path)
    record = json.loads((tmp_path / "run.json").read_text())
    assert (record["order"], record["late"]) == (None, None)
    assert record["record"] == 0.5


def test_what_json_cannot_say_becomes_text():
    given = {"a": math.inf, "b": (math.nan, -math.inf), 3: date(2020, 7, 1), "c": None, "d": {"e"}}
    assert _plain(given) == {"a": "inf", "b": ["nan", "-inf"], "3": "2020-07-01", "c": None, "d": ["e"]}


def test_the_command_runs_the_same_again(mine, tmp_path):
    """Quoted as a shell takes it; what goes on to another end, or at another step, says so once."""
    path = tmp_path / "two lags.toml"
    path.write_text(f'[simulation]\nstop_time = 1.0\n[instances.lag]\ncomponent = "{mine("Lag")}"\ncount = 2\n')
    system = load(path, settings=["lag.u=[0.5, 0.25]"], stop_time=2.0)
    run(isolate(system, ["lag[1]"]), stop_time=0.5, kind="plain", output=tmp_path / "run")
    told = json.loads((tmp_path / "run" / "run.json").read_text())["command"]
    program, command, *words = shlex.split(told)
    assert (program, command) == ("orchestrate", "run")
    assert words == [
        *(str(path), "--set", "lag.u=[0.5, 0.25]", "--isolate", "lag[1]", "--stop", "0.5", "--kind", "plain")
    ]
    assert f"'{path}'" in told


def test_what_python_made_has_no_command(files, mine, tmp_path):
    assert files[1]["command"] is None
    system = load("comfort_cruise")
    assert system.provenance.command == ("comfort_cruise",)
    assert system.changed(seed=3).provenance.command == ()
    system.add("lag", mine("Lag"))
    assert system.provenance.command == ()


def test_which_signals_hold_between_points(mine, tmp_path):
    system = System(stop_time=0.2, step=0.1)
    system.add("word", mine("Word"))
    system.add("wave", mine("Wave"))
    run(system, kind="plain", output=tmp_path)
    assert json.loads((tmp_path / "run.json").read_text())["stepwise"] == ["word.word", "word.n"]
