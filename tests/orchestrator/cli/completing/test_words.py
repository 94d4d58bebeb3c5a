"""What shells are offered, asked as bash, zsh and fish ask."""

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from railcosim.components import CATALOGUE
from railcosim.fmus.build import package
from railcosim.orchestrator.cli.app import call
from railcosim.orchestrator.cli.completing import algorithms, components, designs, metrics
from railcosim.orchestrator.cli.completing.models import variables_of
from railcosim.orchestrator.master import ALGORITHMS
from railcosim.orchestrator.study.design.sampling import DESIGNS

MINE = '''
from railcosim.components import CruiseController, Parameter
raise RuntimeError("completion executes nothing")

class Base(CruiseController):
    gain = Parameter("1/s", 0.03)
    a = b = print("no declaration")

class Mine(Base):
    """A controller."""
    other, more = 1, 2
    limit = Parameter("m/s2", 0.8)
'''
SCENARIO = """
default_preset = "calm"
[simulation]
stop_time = 1.0
[instances.train]
component = "PointMassTrain"
count = 3
[instances.cruise]
component = "mine.py:Mine"
[instances.gust]
fmu = "Gust.fmu"
[instances.gone]
fmu = "none.fmu"
[instances.bad]
component = "bad.py:Bad"
[instances]
odd = 3
[metrics]
gap_min = "1"
[require]
safe = "always true"
[presets.fast]
description = "in haste"
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.py").write_text(MINE)
    (tmp_path / "bad.py").write_text("class Bad(")
    (tmp_path / "own.toml").write_text(SCENARIO.replace("[instances]\nodd = 3\n", ""))
    (tmp_path / "runs").mkdir()
    return tmp_path


@pytest.fixture
def offered(monkeypatch, capsys):
    """What a shell is told, a line each."""

    def ask(line, shell="bash"):
        monkeypatch.setenv("_ORCHESTRATE_COMPLETE", f"complete_{shell}")
        if shell == "bash":
            words = parted(line)
            monkeypatch.setenv("COMP_WORDS", "\n".join(words))
            monkeypatch.setenv("COMP_CWORD", str(len(words) - 1))
            monkeypatch.delenv("_TYPER_COMPLETE_ARGS", raising=False)
        else:
            monkeypatch.setenv("_TYPER_COMPLETE_ARGS", line)
            monkeypatch.setenv("_TYPER_COMPLETE_FISH_ACTION", "get-args")
        capsys.readouterr()
        assert call([]) == 0
        return capsys.readouterr().out.split()

    return ask


def parted(line):
    """A line as bash parts it."""
    words = [""]
    for letter in line:
        if letter == " ":
            words.append("")
        elif letter in "=:":
            words += [letter] if words[-1] else []
            words[-1] = letter
            words.append("")
        else:
            words[-1] += letter
    if len(words) > 1 and not words[-1] and words[-2] in ("=", ":"):
        words.pop()
    return words


def test_scenarios_presets_components_and_what_else_has_a_name(offered, folder):
    assert "comfort_cruise" in offered("orchestrate run comf")
    assert offered("orchestrate run ow") == ["own.toml"]
    assert offered("orchestrate check runs/") == []
    assert offered("orchestrate check nowhere/") == []
    assert offered("orchestrate compare comfort_cruise ru") == ["runs/"]
    assert offered("orchestrate run own.toml --preset ") == ["calm", "fast"]
    assert offered("orchestrate describe PointM") == ["PointMassTrain"]
    assert offered("orchestrate build mi") == ["mine.py"]
    assert offered("orchestrate build Gust --platforms linux64,w") == ["linux64,win64", "linux64,wasm"]
    assert offered("orchestrate run own.toml --algorithm jac") == ["jacobi"]
    assert offered("orchestrate study own.toml --design la") == ["latin-hypercube"]
    assert offered("orchestrate falsify own.toml --requirement ") == ["safe"]
    assert offered("orchestrate optimize own.toml --minimize ") == ["gap_min"]
    assert offered("orchestrate run own.toml --isolate ")[:5] == ["all", "together", "auto", "train", "cruise"]
    assert offered("orchestrate run own.toml --quie") == ["--quiet"]
    assert offered("orchestrate run 'own.toml --preset ") == []
    assert offered("orchestrate run nothing.toml --preset ") == []


def test_variants_of_an_archive(offered, folder):
    """Its own alone, by the table of contents: what is in the files is not looked at."""
    with zipfile.ZipFile(folder / "line.ssp", "w") as archive:
        for name in ("Winter.ssd", "SystemStructure.ssd", "inner/Summer.ssd", "Winter.txt"):
            archive.writestr(name, "")
    (folder / "bad.ssp").write_text("no archive")
    assert offered("orchestrate run lin") == ["line.ssp"]
    assert offered("orchestrate run line.ssp --variant ") == ["SystemStructure", "Winter"]
    assert offered("orchestrate check line.ssp --variant W") == ["Winter"]
    assert offered("orchestrate run bad.ssp --variant ") == offered("orchestrate run own.toml --variant ") == []


def test_an_open_quote_hides_no_scenario(folder, monkeypatch):
    monkeypatch.setenv("_TYPER_COMPLETE_ARGS", "orchestrate optimize own.toml --minimize 'gap")
    assert metrics() == ["gap_min"]


def test_names_of_a_scenario(offered, folder):
    path = package("Gust", {})[0]
    (folder / "Gust.fmu").write_bytes(path.read_bytes())
    assert offered("orchestrate run own.toml --set train.sp") == ["train.speed="]
    assert offered("orchestrate run own.toml --set train[2].sp") == ["train[2].speed="]
    assert offered("orchestrate study own.toml --record train[:].sp") == ["].speed"]
    assert offered("orchestrate run own.toml --set gust.si") == ["gust.size="]
    assert offered("orchestrate run own.toml --set cruise.") != []
    assert {"cruise.gain=", "cruise.limit=", "cruise.position="} < {*offered("orchestrate run own.toml --set cruise.")}
    assert offered("orchestrate study own.toml --vary simulation.se") == ["simulation.seed"]
    assert offered("orchestrate run own.toml --set train.speed=") == []
    assert offered("orchestrate run own.toml --set gone.") == offered("orchestrate run own.toml --set bad.") == []
    with zipfile.ZipFile(folder / "none.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", '<Float64 name="a&lt;b" causality="parameter"/><Real start="1"/>')
    assert offered("orchestrate run own.toml --set gone.") == ["gone.a<b="]


def test_a_swap_in_bash_is_answered_with_the_part_that_bash_replaces(offered, folder):
    assert offered("orchestrate run own.toml --swap cr") == ["cruise="]
    assert offered("orchestrate run own.toml --swap cruise=FixedD") == ["FixedDistanceCruise"]
    assert "ComfortCruise" in offered("orchestrate run own.toml --swap cruise=")
    assert offered("orchestrate run own.toml --swap cruise=mi") == ["mine.py"]


def test_what_a_run_has_recorded(offered, folder):
    (folder / "runs/results.csv").write_text("time,train[1].speed,train[2].speed\n0,1,2\n")
    assert offered("orchestrate plot runs train[2") == ["train[2].speed"]
    assert offered("orchestrate plot runs/run.json train[1") == ["train[1].speed"]
    assert offered("orchestrate plot nowhere train") == []


@pytest.mark.parametrize("shell", ["zsh", "fish"])
def test_other_shells_get_the_same_with_what_it_is(offered, folder, shell):
    text = "\n".join(offered("orchestrate run own.toml --preset f", shell))
    assert "fast" in text
    assert "haste" in text
    assert "cruise=FixedDistanceCruise" in "\n".join(offered("orchestrate run own.toml --swap cruise=FixedD", shell))


def test_names_that_are_read_without_an_import_are_those_of_the_program():
    assert components("no/such/folder") == list(CATALOGUE)
    assert {name for name, _ in algorithms()} == set(ALGORITHMS)
    assert designs() == list(DESIGNS)


def test_bash_gets_a_script(capsys, monkeypatch):
    monkeypatch.setenv("_ORCHESTRATE_COMPLETE", "source_bash")
    assert call([]) == 0
    assert "complete -o default -F" in capsys.readouterr().out


def test_little_is_loaded_for_it():
    asked = {"_ORCHESTRATE_COMPLETE": "complete_zsh", "_TYPER_COMPLETE_ARGS": "orchestrate run comfort_cruise --set tr"}
    code = """
import sys
from railcosim.orchestrator.cli.app import call
call([])
print([name for name in ("fmpy", "lxml", "numpy", "rich", "railcosim.orchestrator.run") if name in sys.modules])
"""
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, check=True, env={**os.environ, **asked})
    assert done.stdout.splitlines()[-1] == "[]"
    assert "train.speed=" in done.stdout


@pytest.mark.parametrize("name", CATALOGUE)
def test_what_a_component_declares_is_read_without_an_import(name):
    sorts = {"parameter", "state", "input", "output"}
    declared = {each: type(one).__name__.lower() for each, one in CATALOGUE[name].declarations.items()}
    wanted = {each: sort for each, sort in declared.items() if sort in sorts}
    table = {"component": name}
    assert {each: sort for sort in sorts for each in variables_of(Path(), table, [sort])} == wanted


def test_classes_that_are_each_others_bases_have_no_names(tmp_path):
    (tmp_path / "round.py").write_text("class A(B):\n    pass\n\nclass B(A):\n    pass\n")
    assert variables_of(tmp_path, {"component": "round.py:A"}, ["parameter"]) == []
