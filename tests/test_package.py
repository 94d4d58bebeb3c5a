"""The package as others install it: a wheel in a foreign folder, complete, and quick to start."""

import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
FOLDERS = ("components", "fmus", "models", "orchestrator")
NEEDED = ("pyproject.toml", "README.md", "LICENSE", *FOLDERS)


def code() -> set[Path]:
    """Every module of the package; what stands in a folder ``resources`` is data, whatever it is."""
    found = {path for name in FOLDERS for path in (ROOT / name).rglob("*.py")}
    return {path for path in found if not {"dist", "resources"} & set(path.relative_to(ROOT).parts)}


def python(*arguments: object, folder: Path, path: Path) -> str:
    """What this Python prints in a folder, with nothing of the checkout in reach but what was installed in ``path``."""
    environment = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "MYPYPATH")}
    environment |= {"PYTHONPATH": str(path), "RAILCOSIM_CACHE": str(path / "cache")}
    done = subprocess.run(
        [sys.executable, *map(str, arguments)], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr + done.stdout
    return done.stdout


def pip(*arguments: object) -> None:
    """What pip reaches is not measured."""
    environment = {k: v for k, v in os.environ.items() if not k.startswith("COVERAGE")}
    command = [sys.executable, "-m", "pip", *map(str, arguments)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


@pytest.fixture(scope="session")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel, built from a copy of the checkout, which stays as it is."""
    source = tmp_path_factory.mktemp("source")
    for name in NEEDED:
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, source / name, ignore=shutil.ignore_patterns("__pycache__", "dist"))
        else:
            shutil.copy(ROOT / name, source)
    target = tmp_path_factory.mktemp("wheel")
    try:
        own = int(version("setuptools").split(".")[0]) >= 77
    except PackageNotFoundError:
        own = False
    isolation = (
        ["--no-build-isolation"] if own else []
    )  # otherwise pip fetches the setuptools that pyproject.toml asks for
    pip("wheel", "--quiet", "--no-deps", *isolation, "-w", target, source)
    (built,) = target.glob("railcosim-*.whl")
    return built


@pytest.fixture(scope="session")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder the wheel is installed into."""
    target = tmp_path_factory.mktemp("site")
    pip("install", "--quiet", "--no-deps", "--target", target, wheel)
    return target


@pytest.fixture
def foreign(tmp_path: Path) -> Path:
    """The folder of somebody who has packages of our folders' names."""
    for name in FOLDERS:
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text("WHOSE = 'mine'\n")
    return tmp_path


@pytest.mark.long
def test_the_wheel_runs_beside_folders_of_the_same_names(installed: Path, foreign: Path) -> None:
    script = foreign / "study.py"
    script.write_text(
        "import json, sys\n"
        "import components, fmus, models, orchestrator\n"
        "import railcosim.components, railcosim.fmus, railcosim.models, railcosim.orchestrator\n"
        "from railcosim.orchestrator import load, run\n"
        "result = run(load('comfort_cruise', stop_time=1.0))\n"
        "files = {name: module.__file__ for name, module in sys.modules.items()\n"
        "         if name.startswith('railcosim.') and getattr(module, '__file__', None)}\n"
        "whose = [m.WHOSE for m in (components, fmus, models, orchestrator)]\n"
        "print(json.dumps([whose, files, len(result.time)]))\n"
    )
    whose, files, points = json.loads(python(script, folder=foreign, path=installed))
    assert whose == ["mine"] * 4
    assert points == 11
    assert len(files) > 20
    outside = {name: file for name, file in files.items() if not Path(file).is_relative_to(installed)}
    assert outside == {}


@pytest.mark.long
def test_the_command_line_of_the_wheel_finds_its_scenarios(installed: Path, foreign: Path) -> None:
    """The command an entry point runs, from the foreign folder, models and all."""
    names = {path.stem for path in (ROOT / "models").glob("*.toml")}
    listed = python("-m", "railcosim.orchestrator.cli.app", "list", folder=foreign, path=installed)
    assert all(f"  {name}: " in listed for name in names)
    checking = ("-m", "railcosim.orchestrator.cli.app", "check", "comfort_cruise_bottom_layer")
    text = python(*checking, folder=foreign, path=installed)
    assert text.endswith("no errors\n")


def test_every_package_is_listed_and_typed() -> None:
    """Every folder with Python in it is a package, stands in pyproject.toml, and nothing else does."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]
    with_code = {path.parent for path in code()}
    assert all((folder / "__init__.py").is_file() for folder in with_code)
    found = {f"railcosim.{folder.relative_to(ROOT).as_posix().replace('/', '.')}" for folder in with_code}
    assert sorted(settings["packages"]) == sorted(found)
    assert settings["package-dir"] == {f"railcosim.{name}": name for name in FOLDERS}
    assert all((ROOT / name / "py.typed").is_file() for name in FOLDERS)


@pytest.mark.long
def test_the_wheel_holds_every_module_every_scenario_and_the_type_markers(wheel: Path) -> None:
    names = set(zipfile.ZipFile(wheel).namelist())
    data = {path for path in (ROOT / "models").rglob("*") if path.suffix in (".toml", ".json")}
    marks = {ROOT / name / "py.typed" for name in FOLDERS}
    wanted = {f"railcosim/{path.relative_to(ROOT).as_posix()}" for path in code() | data | marks}
    assert wanted - names == set()
    assert not [name for name in names if name.startswith(("tests", "docs", "benchmarks", "railcosim/tests"))]


@pytest.mark.long
def test_the_wheel_holds_what_fmus_are_made_of(wheel: Path) -> None:
    """The C runtime, and what else lies beside the modules of ``fmus``: licences, pictures."""
    names = set(zipfile.ZipFile(wheel).namelist())
    files = {path for folder in ("runtime", "resources") for path in (ROOT / "fmus" / folder).rglob("*.*")}
    wanted = {f"railcosim/{path.relative_to(ROOT).as_posix()}" for path in files if path.suffix not in (".py", ".pyc")}
    assert wanted - names == set()


@pytest.mark.long
def test_the_wheel_runs_a_scenario_in_a_fresh_environment(wheel: Path, tmp_path: Path) -> None:
    """Installed with what it depends on and nothing else; the compiled loop is in it, and its numbers are ours."""
    subprocess.run([sys.executable, "-m", "venv", str(tmp_path / "fresh")], check=True)
    programs = tmp_path / "fresh" / ("Scripts" if sys.platform == "win32" else "bin")
    environment = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "MYPYPATH", "VIRTUAL_ENV")}
    environment["RAILCOSIM_CACHE"] = str(tmp_path / "cache")

    def do(*command: object) -> str:
        called = [str(word) for word in command]
        done = subprocess.run(called, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    do(programs / "python", "-m", "pip", "install", "--quiet", wheel)
    kernel = do(programs / "python", "-c", "import railcosim.orchestrator.master.kernel as k; print(k.__file__)")
    assert Path(kernel.strip()).is_relative_to(tmp_path / "fresh")
    report = do(programs / "orchestrate", "run", "comfort_cruise", "--no-figures", "--output", "out")
    assert "4 of 4 requirements pass" in report
    assert "10 Python FMUs" in report  # no CasADi there
    here = [sys.executable, "-m", "railcosim.orchestrator.cli.app", "run", "comfort_cruise", "--no-figures", "-q"]
    subprocess.run([*here, "--kind", "plain", "-o", str(tmp_path / "here")], check=True, env=environment)
    assert (tmp_path / "out" / "results.csv").read_bytes() == (tmp_path / "here" / "results.csv").read_bytes()


def test_the_conda_recipe_asks_for_what_the_wheel_asks_for() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    recipe = (ROOT / "recipe" / "recipe.yaml").read_text().replace("matplotlib-base", "matplotlib")
    run = recipe.partition("  run:\n")[2].partition("  run_constraints:")[0]
    asked = dict(re.findall(r"- (\w+) (\S+)", run))
    assert asked.pop("python") == ">=${{"
    assert asked == dict(re.match(r"(\w+)(.*)", text).groups() for text in project["dependencies"])
    assert f'version: "{project["version"]}"' in recipe
    assert project["scripts"]["orchestrate"] in recipe


def test_the_command_starts_without_heavy_imports() -> None:
    """What only some runs need is imported when it is needed: figures, optimization, tables."""
    heavy = ("matplotlib", "scipy", "pandas", "casadi", "hypothesis")
    code = f"import sys, railcosim.orchestrator.cli.app; print([name for name in {heavy!r} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_the_public_names_are_there() -> None:
    from railcosim import components, orchestrator

    for package in (components, orchestrator):
        assert all(hasattr(package, name) for name in package.__all__)
    assert {"System", "load", "run"} <= set(orchestrator.__all__)
    assert set(components.CATALOGUE) <= set(components.__all__)
