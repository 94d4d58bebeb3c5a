"""Packages that load what they offer when they are asked for it."""

import subprocess
import sys

import pytest
import railcosim.components
from railcosim.components.doors import hang_door


@pytest.fixture
def package(tmp_path, monkeypatch):
    """A package with a door, a function of the same name as its module, and another room's function renamed."""
    folder = tmp_path / "house_with_a_door"
    folder.mkdir()
    (folder / "__init__.py").write_text("from railcosim.components.doors import hang_door\nhang_door(__name__)\n")
    (folder / "__init__.pyi").write_text('from .walk import walk, run as hurry\n\n__all__ = ["hurry", "walk"]\n')
    (folder / "walk.py").write_text("def walk(): ...\ndef run(): ...\n")
    monkeypatch.syspath_prepend(tmp_path)
    yield __import__(folder.name)
    for name in [name for name in sys.modules if name.partition(".")[0] == folder.name]:
        del sys.modules[name]


def test_nothing_is_loaded_before_it_is_asked_for(package):
    assert f"{package.__name__}.walk" not in sys.modules
    assert package.hurry.__name__ == "run"
    assert package.hurry is sys.modules[f"{package.__name__}.walk"].run


def test_a_function_is_not_hidden_by_the_module_of_its_name(package):
    __import__(f"{package.__name__}.walk")
    assert callable(package.walk)
    package.other = sys  # any other module may stand there
    assert package.other is sys


def test_what_is_offered_is_listed_and_nothing_else_is_there(package):
    assert package.__all__ == ["walk", "hurry"]
    assert {"walk", "hurry", "__name__"} <= set(dir(package))
    with pytest.raises(AttributeError, match="'house_with_a_door' has no attribute 'fly'"):
        package.fly  # noqa: B018


def test_a_package_that_is_loaded_stays_open():
    hang_door("railcosim.components")
    assert railcosim.components.simulate is railcosim.components.Simulation.__init__.__globals__["simulate"]


def test_scripts_load_what_they_use():
    code = "import sys; from railcosim.orchestrator import System; print('numpy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "False\n"
