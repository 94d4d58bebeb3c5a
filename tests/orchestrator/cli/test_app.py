"""The command line as a user meets it: what it prints where, what it leaves behind, and its exit code."""

import contextlib
import csv
import io
import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from railcosim.fmus.kinds import KINDS
from railcosim.orchestrator import Results
from railcosim.orchestrator.cli.app import call
from railcosim.orchestrator.cli.options import KindName

COMMAND = [sys.executable, "-c", "from railcosim.orchestrator.cli.app import main; main()"]
OK, FAILED, WRONG_INPUT, FMU_FAILED, INTERRUPTED = 0, 1, 2, 3, 130

SMALL = """
title = "A train on its own"
default_preset = "calm"
[simulation]
stop_time = 2.0
step = 0.1
[instances.train]
component = "PointMassTrain"
start = { speed = 10.0, force = 0.0 }
[presets.fast]
"train.speed" = 20.0
[require]
forward = "always train.speed > 0"
[metrics]
start = "initial(train.speed)"
slowest = "min(train.speed)"
[[published]]
metric = "start"
value = 10.0
tolerance = 0.5
where = "own example"
origin = "stated"
[[published]]
metric = "start"
preset = "fast"
value = 20.0
tolerance = 0.5
claim = "a preset starts faster"
where = "own example"
origin = "stated"
[[published]]
metric = "start"
value = 99.0
origin = "misprint"
[[figures]]
title = "Speed"
y = ["train.speed"]
"""

BARE = SMALL.partition("[presets")[0]

FAILING = '''
from railcosim.components import CruiseController
from railcosim.components.maths import sqrt

class Failing(CruiseController):
    """Works until the train has left its place."""

    def outputs(self):
        return {"demand": sqrt(1000.0 - self.position), "force": 1e5, "range_violated": False}
'''


@pytest.fixture(autouse=True, scope="module")
def a_pipe_of_the_usual_width() -> Iterator[None]:
    """What runs the tests may ask for another width (pytest-xdist does)."""
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("COLUMNS", raising=False)
        yield


def orchestrate(*arguments: object, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run the command in a folder, without a terminal, in this process; what would be a traceback fails the test."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.chdir(folder), contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = call([str(argument) for argument in arguments])
    return subprocess.CompletedProcess(arguments, code, out.getvalue(), err.getvalue())


def refused(*arguments: object, folder: Path) -> str:
    """What it says to wrong input."""
    done = orchestrate(*arguments, folder=folder)
    assert done.returncode == WRONG_INPUT, done.stderr
    assert done.stdout == ""
    return done.stderr


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a scenario of one train, run once."""
    folder = tmp_path_factory.mktemp("small")
    (folder / "small.toml").write_text(SMALL)
    done = orchestrate("run", "small.toml", "-o", "out", folder=folder)
    assert done.returncode == OK, done.stderr
    (folder / "stdout.txt").write_text(done.stdout)
    (folder / "stderr.txt").write_text(done.stderr)
    return folder


# ---------------------------------------------------------------- run


def test_run_prints_metrics_verdicts_and_where_the_files_are(small: Path) -> None:
    text = (small / "stdout.txt").read_text()
    order = [
        "A train on its own",
        "Metrics",
        "Requirements",
        "Published values",
        "1 of 1 requirements pass",
        "Files in out",
    ]
    places = [text.index(part) for part in order]
    assert places == sorted(places)
    assert re.search(r"^start +10 +10 +0\.5 +m/s +reproduced", text, re.MULTILINE)
    assert re.search(r"^start +99 +10 +m/s +not judged", text, re.MULTILINE)
    assert "not judged: a misprint is printed, never judged (start)" in text
    assert text.rstrip().endswith("results.csv, units.json, metrics.json, run.json, 1 figure")


def test_run_leaves_results_metrics_record_and_figures(small: Path) -> None:
    names = sorted(path.name for path in (small / "out").iterdir())
    assert names == [".lock", "metrics.json", "results.csv", "run.json", "speed.png", "units.json"]
    rows = list(csv.reader((small / "out/results.csv").read_text().splitlines()))
    assert rows[0][0] == "time"
    assert len(rows) == 1 + 21
    assert json.loads((small / "out/run.json").read_text())["status"] == "completed"


def test_without_a_terminal_progress_is_one_line_per_ten_percent(small: Path) -> None:
    lines = (small / "stderr.txt").read_text().splitlines()
    assert lines == [f"small: {percent} % of 2 s" for percent in range(10, 101, 10)]


def test_results_go_to_a_folder_named_after_scenario_and_preset(small: Path) -> None:
    done = orchestrate("run", "small.toml", "--preset", "fast", "--no-figures", "--quiet", folder=small)
    assert (done.returncode, done.stdout, done.stderr) == (OK, "", "")
    assert (small / "results/small-fast/results.csv").is_file()
    assert not list((small / "results/small-fast").glob("*.png"))
    assert Results.load(small / "results/small-fast")["train.speed"][0] == 20.0


def test_every_change_on_the_command_line_reaches_the_run(small: Path) -> None:
    options = ["--set", "train.speed=30", "--stop", 1, "--step", 0.05, "--algorithm", "jacobi", "--kind", "plain"]
    done = orchestrate("run", "small.toml", *options, "--no-figures", "-o", "changed", folder=small)
    assert done.returncode == OK
    record = json.loads((small / "changed/run.json").read_text())
    assert (record["stop_time"], record["step"], record["algorithm"]) == (1.0, 0.05, "jacobi")
    assert (record["kind"], record["modified"]) == ("plain", True)
    assert Results.load(small / "changed")["train.speed"][0] == 30.0
    assert "not judged, because the scenario was modified" in done.stdout


def test_a_build_argument_reaches_the_run(tmp_path: Path) -> None:
    text = '[simulation]\nstop_time = 1\nstep = 0.1\n[instances.goal]\ncomponent = "Schedule"\nbuild = { points = 1 }\n'
    (tmp_path / "goal.toml").write_text(text)
    arguments = ["run", "goal.toml", "--with", "goal.points=3", "--set", "goal.values=[1, 2, 3]", "-o", "out", "-q"]
    arguments += ["--set", "goal.times=[0, 0.5, 2]"]
    assert orchestrate(*arguments, folder=tmp_path).returncode == OK
    assert json.loads((tmp_path / "out/run.json").read_text())["instances"]["goal"]["build"]["points"] == 3


def test_the_choices_of_the_command_line_are_those_of_the_program() -> None:
    assert tuple(KindName) == KINDS


# ---------------------------------------------------------------- swapping


def test_swapping_in_the_same_component_from_a_file_gives_identical_results(tmp_path: Path) -> None:
    built = orchestrate("build", "ComfortCruise", "-o", "my fmus", folder=tmp_path)
    assert built.stdout.split("\n") == ["my fmus/ComfortCruise.fmu", ""]
    base = ["run", "comfort_cruise", "--stop", 5, "--no-figures", "--quiet"]
    orchestrate(*base, "-o", "own", folder=tmp_path)
    orchestrate(*base, "-o", "swapped", "--swap", "cruise=my fmus/ComfortCruise.fmu", folder=tmp_path)
    own, swapped = (tmp_path / name / "results.csv" for name in ("own", "swapped"))
    assert own.read_bytes() == swapped.read_bytes()
    assert len(own.read_bytes()) > 10_000


def test_a_new_controller_swaps_into_a_published_scenario(tmp_path: Path) -> None:
    orchestrate("new", "my_controller.py", folder=tmp_path)
    swap = ["--swap", "cruise=my_controller.py:MyController"]
    done = orchestrate("run", "comfort_cruise", "--stop", 2, "-o", "out", *swap, folder=tmp_path)
    assert done.returncode == FAILED  # 2 s are too short for the requirement on the final speed
    assert "MyController has no alpha, beta, gamma, gap_min, gap_max; dropped with the swap" in done.stdout
    results = Results.load(tmp_path / "out")
    assert results["train[1].acceleration"][0] == pytest.approx(0.03 * (85.0 - 83.0))
    assert np.all(results["train[4].acceleration"] <= 1.0)


def test_an_fmu_with_another_interface_is_refused_with_what_is_missing(tmp_path: Path) -> None:
    orchestrate("build", "Gust", "-o", ".", folder=tmp_path)
    said = refused("run", "comfort_cruise", "--swap", "cruise=Gust.fmu", folder=tmp_path)
    for name in ("position", "speed", "ahead_position", "target_speed", "force"):
        assert f"has no variable '{name}'" in said
    assert "its outputs are acceleration" in said
    assert "(and 3 more like it, for other indices)" in said


# ---------------------------------------------------------------- exit codes


def test_a_requirement_that_fails_ends_with_1_even_when_quiet(small: Path) -> None:
    (small / "strict.toml").write_text(SMALL.replace("train.speed > 0", "train.speed > 15"))
    done = orchestrate("run", "strict.toml", "-o", "strict", "--quiet", "--no-figures", folder=small)
    assert (done.returncode, done.stdout) == (FAILED, "")
    assert done.stderr == "0 of 1 requirements pass; fail: forward\n"


def test_a_missed_published_value_ends_with_1(small: Path) -> None:
    (small / "missed.toml").write_text(SMALL.replace("value = 10.0", "value = 12.0"))
    done = orchestrate("run", "missed.toml", "-o", "missed", "--no-figures", folder=small)
    assert done.returncode == FAILED
    assert "0 of 1 stated values reproduced; missed: start" in done.stdout


@pytest.mark.parametrize("kind", ["python", "plain"])
def test_an_fmu_that_fails_ends_with_3_its_name_the_time_the_status_and_the_line(kind: str, tmp_path: Path) -> None:
    (tmp_path / "failing.py").write_text(FAILING)
    text = BARE.replace(", force = 0.0", ", position = 995.0") + (
        '[instances.cruise]\ncomponent = "failing.py:Failing"\nstart.target_speed = 1.0\n[connections]\n'
        '"train.force" = "cruise.force"\n"cruise.position" = "train.position"\n"cruise.speed" = "train.speed"\n'
    )
    (tmp_path / "failing.toml").write_text(text)
    done = orchestrate("run", "failing.toml", "--no-figures", "-o", "out", "--kind", kind, folder=tmp_path)
    assert done.returncode == FMU_FAILED, done.stderr
    assert re.search(r"error: an FMU failed: cruise, t = 0\.[4-6] s, status (error|fatal): ", done.stderr)
    assert "ValueError: " in done.stderr
    assert "failing.py:9, in outputs" in done.stderr
    assert re.search(r"failed at t = 0\.[4-6] s of 2 s", done.stdout)
    results = Results.load(tmp_path / "out")
    assert not results.completed
    assert len(results.time) > 4


@pytest.mark.skipif(sys.platform == "win32", reason="signals")
def test_ctrl_c_ends_with_130_and_leaves_what_was_computed(tmp_path: Path) -> None:
    # Long enough for the compiled loop to be far from the end when the first rows reach the disk, after a second.
    command = [*COMMAND, "run", "comfort_cruise_bottom_layer", "--stop", "10000000", "--no-figures", "-o", "out"]
    command += ["--set", "simulation.record=10"]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        while not (tmp_path / "out/results.bin").is_file() or (tmp_path / "out/results.bin").stat().st_size < 2000:
            assert process.poll() is None, process.stderr.read()
            time.sleep(0.02)
        process.send_signal(signal.SIGINT)
        stdout, stderr = process.communicate(timeout=120)
    assert process.returncode == INTERRUPTED, stderr
    assert "Traceback" not in stderr
    reached = re.search(r"interrupted at t = (\S+) s of 10000000 s", stdout)
    assert reached
    results = Results.load(tmp_path / "out")
    assert results.time[-1] == pytest.approx(float(reached[1]), rel=1e-4)
    assert not results.completed
    assert json.loads((tmp_path / "out/run.json").read_text())["status"] == "interrupted"


# ---------------------------------------------------------------- wrong input

WRONG = {
    "scenario": (["comfort_cruse"], "no shipped scenario 'comfort_cruse'; did you mean 'comfort_cruise'?"),
    "file": (["missing.toml"], "there is no file 'missing.toml'"),
    "preset": (["comfort_cruise", "--preset", "as-statd"], "no preset 'as-statd'; did you mean 'as-stated'?"),
    "setting": (["comfort_cruise", "--set", "cruise.alhpa=1"], "no such variable; did you mean 'alpha'?"),
    "instance": (["comfort_cruise", "--set", "crise.alpha=1"], "no instance 'crise'; did you mean 'cruise'?"),
    "index": (["comfort_cruise", "--set", "train[9].speed=1"], "there are train[1] to train[4]"),
    "syntax": (
        ["comfort_cruise", "--set", "cruise.alpha"],
        "not of the form name=value, as in --set train[4].speed=10",
    ),
    "value": (["comfort_cruise", "--set", "cruise.alpha=fast"], "unknown name 'fast'"),
    "with": (["comfort_cruise", "--with", "train"], "not of the form name=value, as in --with train.carriages=8"),
    "argument": (["comfort_cruise", "--with", "train.carriages=8"], "PointMassTrain has no 'carriages'"),
    "swap": (["comfort_cruise", "--swap", "cruise"], "not of the form instance=model"),
    "swapped": (["comfort_cruise", "--swap", "crise=ComfortCruise"], "no instance 'crise'; did you mean 'cruise'?"),
    "component": (["comfort_cruise", "--swap", "cruise=ComfrtCruise"], "did you mean 'ComfortCruise'?"),
    "fmu": (["comfort_cruise", "--swap", "cruise=nope.fmu"], "--swap cruise=nope.fmu: there is no file"),
    "python": (["comfort_cruise", "--swap", "cruise=nope.py:X"], "--swap cruise=nope.py:X: there is no file"),
    "stop": (["comfort_cruise", "--stop", "-5"], "the stop time, -5 s, must be later than the start, 0 s"),
    "infinite": (["comfort_cruise", "--stop", "inf"], "takes a finite number, not inf"),
    "number": (["comfort_cruise", "--stop", "soon"], "Invalid value for '--stop'"),
    "step": (["comfort_cruise", "--step", "0.3"], "350 s is not a whole number of steps of 0.3 s"),
    "zero": (["comfort_cruise", "--step", "0"], "the step must be greater than 0 s"),
    "algorithm": (
        ["comfort_cruise", "--algorithm", "euler"],
        "there is no algorithm 'euler'; there are adaptive, gauss-seidel, iterative, jacobi",
    ),
    "kind": (["comfort_cruise", "--kind", "nativ"], "'nativ' is not one of"),
    "option": (["comfort_cruise", "--bogus"], "No such option: --bogus"),
    "output": (["comfort_cruise", "--stop", "1", "-o", "a_file"], "a_file cannot be used: "),
}


@pytest.mark.parametrize(("arguments", "message"), WRONG.values(), ids=WRONG)
def test_run_refuses_wrong_input_in_words(arguments: list[str], message: str, tmp_path: Path) -> None:
    (tmp_path / "a_file").write_text("")
    said = refused("run", *arguments, folder=tmp_path)
    assert message in said
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a_file"]


def test_all_mistakes_are_told_at_once_and_alike_ones_once(tmp_path: Path) -> None:
    wrong = ["--set", "crise.alpha=1", "--set", "train[9].speed=1", "--swap", "cruise=nope.fmu", "--preset", "nope"]
    said = refused("run", "comfort_cruise", *wrong, folder=tmp_path).splitlines()
    assert len(said) == 4
    assert all(line.startswith("error: ") for line in said)
    said = refused("run", "comfort_cruise", "--set", "cruise.alhpa=1", folder=tmp_path).splitlines()
    assert len(said) == 1
    assert "cruise[1].alhpa" in said[0]
    assert said[0].endswith("(and 3 more like it, for other indices)")


def test_a_results_folder_that_cannot_be_written_is_one_clear_line(small: Path) -> None:
    (small / "blocked/results.csv").mkdir(parents=True)
    said = refused("run", "small.toml", "--no-figures", "-q", "-o", "blocked", folder=small)
    assert re.fullmatch(r"error: .*blocked.*: Is a directory\n", said)


# ---------------------------------------------------------------- the other commands


def test_list_shows_scenarios_with_presets_and_components(tmp_path: Path) -> None:
    text = orchestrate("list", folder=tmp_path).stdout
    assert "  comfort_cruise: Comfort-aware cooperative cruise of four high-speed trains\n" in text
    assert "--preset figure-consistent: as it stands" in text
    assert "--preset no-gust: Figure-consistent gains, no gust." in text
    assert "  PointMassTrain: A train as a point mass" in text


def test_describe_shows_a_component_by_causality_with_units_and_dependencies(tmp_path: Path) -> None:
    text = orchestrate("describe", "ComfortCruise", folder=tmp_path).stdout
    assert text.index("Parameters") < text.index("Inputs") < text.index("Outputs")
    assert "source: Wang et al. 2020, eqs. 3-9" in text
    assert re.search(r"^alpha +Real +1/s +0\.034285\d+ +gain on the error", text, re.MULTILINE)
    assert re.search(
        r"^ahead_speed +Real +m/s +0 +speed of the train ahead \(read where has_ahead\)", text, re.MULTILINE
    )
    assert re.search(r"^bottom_demand +Real +m/s2 .* position, speed, target_speed, has_ahead", text, re.MULTILINE)


def test_describe_shows_build_arguments(tmp_path: Path) -> None:
    text = orchestrate("describe", "Schedule", "--with", "points=3", folder=tmp_path).stdout
    assert re.search(r"^build arguments: .*points = 3", text, re.MULTILINE)
    assert "values[3]" in text


def test_describe_reads_a_class_in_a_file_and_an_fmu_alike(tmp_path: Path) -> None:
    orchestrate("new", "my_controller.py", folder=tmp_path)
    orchestrate("build", "my_controller.py:MyController", "-o", ".", folder=tmp_path)
    of_class = orchestrate("describe", "my_controller.py:MyController", folder=tmp_path).stdout
    of_fmu = orchestrate("describe", "MyController.fmu", folder=tmp_path).stdout
    assert "acceleration_limit" in of_class
    assert [line for line in of_class.splitlines() if not line.startswith("not native: ")] == of_fmu.splitlines()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["describe", "Gst"], "error: there is no component or shipped scenario 'Gst'; did you mean 'Gust'?"),
        (["describe", "nope.fmu"], "error: nope.fmu cannot be read"),
        (["describe", "text.fmu"], "error: text.fmu is not a usable FMU"),
        (["describe", "Gust", "--with", "a"], "error: --with a: write NAME=VALUE, as in --with carriages=8"),
        (["describe", "Schedule", "--with", f"points={'9' * 5000}"], "takes a whole number of at least 1, not '9999"),
        (["describe", "Schedule", "--with", "ponts=3"], "Schedule has no 'ponts'; did you mean 'points'?"),
        (["check", "nope"], "there is no shipped scenario 'nope'"),
        (["check", "comfort_cruise", "--set", "cruise.alhpa=1"], "did you mean 'alpha'?"),
        (["build"], "error: name the components to build, or --all; there is PointMassTrain"),
        (["build", "Gst"], "did you mean 'Gust'?"),
        (["build", "Gust", "-o", "text.fmu"], "error: text.fmu: File exists"),
        (["plot", "nowhere"], "error: nowhere holds no run that can be read"),
        (["reproduce", "Nobody"], "error: no published case belongs to 'Nobody'"),
        (["rum"], "No such command 'rum'"),
    ],
)
def test_commands_refuse_wrong_input_in_words(arguments: list[str], message: str, tmp_path: Path) -> None:
    (tmp_path / "text.fmu").write_text("not a zip")
    assert message in refused(*arguments, folder=tmp_path)


def test_check_says_how_the_run_would_step(tmp_path: Path) -> None:
    done = orchestrate("check", "comfort_cruise", folder=tmp_path)
    assert done.returncode == OK
    assert "10 instances, 37 scalar connections, step 0.1 s" in done.stdout
    assert re.search(r"gauss-seidel steps in the order: cruise\[1\], .*target, gust\n", done.stdout)
    assert done.stdout.endswith("no errors\n")


def test_check_tells_of_delays_and_of_jacobi(small: Path) -> None:
    text = BARE.replace(", force = 0.0", "").replace("step = 0.1", 'step = 0.1\nalgorithm = "jacobi"')
    text += '[instances.cruise]\ncomponent = "ComfortCruise"\nstart.target_speed = 5.0\n[connections]\n'
    text += '"cruise.position" = "train.position"\n"cruise.speed" = "train.speed"\n'
    text += '"train.force" = { from = "cruise.force", delay = 2 }\n'
    (small / "delayed.toml").write_text(text)
    out = orchestrate("check", "delayed.toml", folder=small).stdout
    assert "delay: train.force receives cruise.force 2 communication points later" in out
    assert "jacobi steps all instances in parallel" in out


def test_check_reads_the_study_as_well(small: Path) -> None:
    study = '[study]\nruns = 3\ndesign = "sobol"\n[study.vary]\ntrain.mass = "normal(4e5, 2e4)"\n'
    (small / "varied.toml").write_text(BARE + study)
    out = orchestrate("check", "varied.toml", folder=small).stdout
    assert "study: 3 runs (sobol) over train.mass\na Sobol sequence is balanced for" in out
    (small / "varied.toml").write_text(BARE + study.replace("normal", "norml"))
    said = refused("check", "varied.toml", folder=small)
    assert "study.vary.train.mass: there is no distribution 'norml'; did you mean 'normal'?" in said
    (small / "varied.toml").write_text(BARE + "[study]\nruns = 1\n")
    assert "study: 1 run (random) over noise alone" in orchestrate("check", "varied.toml", folder=small).stdout


@pytest.mark.long
def test_build_all_builds_the_catalogue_once_each(tmp_path: Path) -> None:
    done = orchestrate("build", "--all", "Gust", "-o", "fmus", folder=tmp_path)
    names = sorted(path.name for path in (tmp_path / "fmus").iterdir())
    assert {"ComfortCruise.fmu", "Gust.fmu", "PointMassTrain.fmu", "Schedule.fmu"} <= set(names)
    assert sorted(done.stdout.split()) == [f"fmus/{name}" for name in names]


def test_a_build_argument_is_part_of_the_fmu(tmp_path: Path) -> None:
    assert orchestrate("build", "Schedule", "--with", "points=2", "-o", ".", folder=tmp_path).returncode == OK
    text = orchestrate("describe", "Schedule.fmu", folder=tmp_path).stdout
    assert "points = 2" in text
    assert "values[2]" in text
    assert "values[3]" not in text


def test_plot_draws_the_figures_of_a_run_again_or_chosen_signals(small: Path) -> None:
    again = orchestrate("plot", "out", "-o", "again", folder=small)
    assert again.stdout == "again/speed.png\n"
    chosen = orchestrate("plot", "out/results.csv", "train.speed", "3.6 * train.speed", "-o", "chosen", folder=small)
    (path,) = chosen.stdout.split()
    assert (small / path).read_bytes().startswith(b"\x89PNG")
    assert "did you mean 'train.speed'?" in refused("plot", "out", "train.sped", folder=small)
    record = json.loads((small / "out" / "run.json").read_text(encoding="utf-8"))
    (small / "out" / "run.json").write_text(json.dumps(record | {"figures_wanted": [{"y": "train.sped"}]}))
    assert "title is missing" in refused("plot", "out", folder=small)


@pytest.mark.skipif(sys.platform != "linux", reason="file names are text there")
def test_letters_that_a_pipe_or_utf_8_lacks_are_escaped(tmp_path: Path) -> None:
    name = os.fsdecode(b"gr\xf6\xdfe.toml")  # Latin-1
    (tmp_path / name).write_text(BARE.replace("A train", "Größe eines Zuges"), encoding="utf-8")
    command = [*COMMAND, "run", name, "--kind", "plain", "-o", "out"]
    place = os.environ | {"PYTHONIOENCODING": "ascii"}
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, env=place, check=False)
    assert (done.returncode, done.stderr.splitlines()[0]) == (OK, "gr??e: 10 % of 2 s")
    assert "Gr\\xf6\\xdfe eines Zuges" in done.stdout
    assert json.loads((tmp_path / "out" / "run.json").read_text(encoding="utf-8"))["path"] == name


def test_new_says_what_to_type_next(tmp_path: Path) -> None:
    done = orchestrate("new", "my_controller.py", folder=tmp_path)
    assert done.returncode == OK
    assert "orchestrate run comfort_cruise --swap cruise=my_controller.py:MyController" in done.stdout
    assert "exists already" in refused("new", "my_controller.py", folder=tmp_path)


def test_help_and_version(tmp_path: Path) -> None:
    assert re.fullmatch(r"railcosim \d+\.\d+\.\d+\n", orchestrate("--version", folder=tmp_path).stdout)
    text = orchestrate("run", "--help", folder=tmp_path).stdout
    for option in (
        "--preset",
        "--set",
        "--with",
        "--swap",
        "--stop",
        "--step",
        "--algorithm",
        "--kind",
        "--verify-step",
    ):
        assert option in text
    assert "130" in text


@pytest.mark.skipif(sys.platform == "win32", reason="head")
def test_a_reader_who_stops_reading_gets_no_traceback(tmp_path: Path) -> None:
    command = subprocess.list2cmdline(COMMAND[:1]) + f' -c "{COMMAND[2]}" describe ComfortCruise | head -n 1'
    done = subprocess.run(["bash", "-c", command], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.stdout, done.stderr) == ("ComfortCruise\n", "")
