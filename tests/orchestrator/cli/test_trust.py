"""What commands that only look execute: nothing outside of the scenario's folder, unless somebody trusts it."""

import inspect
import shutil
import typing
from pathlib import Path

import pytest
import typer
from railcosim.fmus import build
from railcosim.orchestrator import load
from railcosim.orchestrator.cli.app import app, call
from railcosim.orchestrator.run.execution import run

COMMANDS = typer.main.get_command(app).commands
EXECUTING = {"run", "compare", "linearize"}
"""Those that run a scenario: they execute what it names, and say so."""
NEEDED = {"pack": ["-o", "packed.fmu"], "linearize": ["--at", "0.1"], "build": ["-o", "built"]}
"""Options without which a command does nothing; one with another required option belongs here."""
COMPONENT = """from pathlib import Path

from railcosim.components import Component, State

Path({marker!r}).touch()


class Lag(Component):
    x = State("1", 1.0)

    def derivatives(self):
        return {{"x": -self.x}}
"""
SCENARIO = """[simulation]
stop_time = 1.0
[instances.thing]
component = "{file}:Lag"
"""


class Strange:
    """A folder from elsewhere: what it executes leaves a marker."""

    def __init__(self, root: Path) -> None:
        self.folder, self.marker = root / "downloaded", root / "marker"
        self.folder.mkdir()
        self.code = self.write(root / "elsewhere.py")

    def write(self, path: Path) -> Path:
        path.write_text(COMPONENT.format(marker=str(self.marker)))
        return path

    def scenario(self, file: object = "../elsewhere.py", more: str = "") -> Path:
        path = self.folder / "strange.toml"
        path.write_text(SCENARIO.format(file=file) + more)
        return path

    def executed(self) -> bool:
        there = self.marker.exists()
        self.marker.unlink(missing_ok=True)
        return there


@pytest.fixture
def strange(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(build, "native_problem", lambda _: "not wanted here: it takes a compiler")
    return Strange(tmp_path)


@pytest.fixture
def interrupted(strange):
    """The directory of a run, from elsewhere."""
    out = strange.folder / "out"
    run(load(strange.scenario()), kind="plain", output=out, checkpoint_every=0.5, figures=False)
    assert strange.executed()
    return out


def ways(command: str, scenario: Path, out: Path) -> list[list[str]]:
    """Every way to give a command the two: as its argument, and by each option that takes a path to read."""
    hints = typing.get_type_hints(inspect.unwrap(COMMANDS[command].callback))
    paths = {name for name, hint in hints.items() if Path in (hint, *typing.get_args(hint))}
    options = [
        [one.opts[0], str(out)]
        for one in COMMANDS[command].params
        if one.param_type_name == "option" and one.name in paths and one.name != "output"
    ]
    arguments = [] if command in EXECUTING else [[str(scenario)]]
    return [[command, *NEEDED.get(command, []), *way] for way in (*arguments, [str(out)], *options)]


@pytest.mark.sample(14)
@pytest.mark.parametrize("command", COMMANDS)
def test_no_command_that_looks_executes_what_is_elsewhere(strange, interrupted, capsys, command):
    for arguments in ways(command, strange.scenario(), interrupted):
        call(arguments)
        assert not strange.executed(), arguments
        assert "Traceback" not in capsys.readouterr().err


@pytest.mark.parametrize("command", sorted(EXECUTING))
def test_what_runs_says_what_it_executes(strange, capsys, command):
    call([command, str(strange.scenario()), "--kind", "plain", "-o", "out", "--no-figures", *NEEDED.get(command, [])])
    assert strange.executed()
    told = " ".join(capsys.readouterr().out.split())
    assert f"Python code for thing, which check and run import: {strange.code}, which executes what is outside" in told


def elsewhere(kind: str, strange: Strange) -> Path:
    """A scenario that names code outside of its folder, one way or another."""
    folder = strange.folder
    match kind:
        case "a path that goes up":
            return strange.scenario("../elsewhere.py")
        case "an absolute path":
            return strange.scenario(strange.code)
        case "a link":
            (folder / "link.py").symlink_to(strange.code)
            return strange.scenario("link.py")
        case "a folder that is a link":
            (folder / "sub").symlink_to(strange.code.parent)
            return strange.scenario("sub/elsewhere.py")
        case "a module beside it that is a link":
            (folder / "helper.py").symlink_to(strange.code)
            (folder / "own.py").write_text("import helper\n")
            return strange.scenario("own.py")
        case "a preset":
            strange.write(folder / "own.py")
            return strange.scenario("own.py", '[presets.p]\nthing.component = "../elsewhere.py:Lag"\n')
    raise AssertionError(kind)


@pytest.mark.parametrize(
    "kind",
    [
        "a path that goes up",
        "an absolute path",
        "a link",
        "a folder that is a link",
        "a module beside it that is a link",
        "a preset",
    ],
)
def test_check_says_what_it_would_import(strange, capsys, kind):
    scenario = elsewhere(kind, strange)
    arguments = ["check", str(scenario), *(["--preset", "p"] if kind == "a preset" else [])]
    assert call(arguments) == 2
    assert not strange.executed()
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("error: ")
    assert "instance 'thing' names Python code" in line
    assert str(strange.code) in line
    assert line.endswith("--trust imports it")
    call([*arguments, "--trust"])
    assert strange.executed()


def test_a_package_that_is_installed_is_elsewhere(strange, capsys):
    (strange.folder / "own.py").write_text("def later():\n    import casadi.tools\n")
    assert call(["check", str(strange.scenario("own.py"))]) == 2
    assert f"casadi (imported by {strange.folder / 'own.py'})" in capsys.readouterr().err


def test_what_is_in_the_folder_is_imported_and_said(strange, capsys):
    strange.write(strange.folder / "own.py")
    assert call(["check", str(strange.scenario("own.py"))]) == 0
    assert strange.executed()
    told = " ".join(capsys.readouterr().out.split())
    assert f"the scenario names Python code for thing, which check and run import: {strange.folder}/own.py" in told
    assert "outside" not in told
    call(["describe", str(strange.scenario("own.py"))])
    assert "which check and run import" in capsys.readouterr().out
    assert not strange.executed()


@pytest.mark.parametrize("option", ["--swap=thing=elsewhere.py:Lag", "--set=thing.component=elsewhere.py:Lag"])
def test_what_an_option_names_is_trusted(strange, capsys, option):
    scenario = strange.scenario(more="")
    assert call(["check", str(scenario), option]) == 0
    assert strange.executed()
    assert "names Python code" not in capsys.readouterr().out


def test_a_checkpoint_names_nothing_alone(strange, interrupted, capsys):
    assert call(["run", "--resume", str(interrupted)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert f"its checkpoint alone names Python code that would be imported: {strange.code}:Lag (thing); name" in line
    assert not strange.executed()
    scenario = strange.scenario()
    for trusting in ([str(scenario)], ["--trust"]):
        assert call(["run", *trusting, "--resume", str(interrupted), "--no-figures", "-q"]) == 0
        assert strange.executed()


def test_only_the_scenario_of_a_run_speaks_for_its_code(strange, interrupted, capsys):
    scenario = strange.scenario()
    scenario.write_text(scenario.read_text() + "# changed\n")
    for trust in ([], ["--trust"]):
        assert call(["run", str(scenario), *trust, "--resume", str(interrupted)]) == 2
        assert f"cannot be resumed: it is no run of {scenario} as that is now (SHA-256 " in capsys.readouterr().err
    assert not strange.executed()


def test_a_swap_speaks_for_its_code(strange, capsys):
    other = strange.write(strange.folder.parent / "mine.py")
    scenario, swap = strange.scenario(), ["--swap", f"thing={other}:Lag"]
    out = ["-o", "out", "-q", "--kind", "plain", "--no-figures", "--checkpoint-every", "0.5"]
    assert call(["run", str(scenario), *swap, *out]) == 0
    shutil.move("out", strange.folder / "out")
    resume = ["--resume", str(strange.folder / "out"), "--no-figures", "-q"]
    strange.executed()
    assert call(["run", str(scenario), *resume]) == 2
    assert not strange.executed()
    assert call(["run", str(scenario), *swap, *resume]) == 0
    assert strange.executed()
    capsys.readouterr()
    assert call(["run", *swap, *resume]) == 2
    assert "and the scenario of the run with the --swap it had" in capsys.readouterr().err


def test_options_that_take_a_directory_are_among_the_ways():
    assert ["run", "--resume", "out"] in ways("run", Path("s.toml"), Path("out"))
