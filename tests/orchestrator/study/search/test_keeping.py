"""What a scenario names is kept beside it: models, data, and the Python files that belong together."""

import pytest
from railcosim.orchestrator import System
from railcosim.orchestrator.scenario import dump, load
from railcosim.orchestrator.study.search.keeping import copy, kept

CODE = "from railcosim.components import Component, Output\n{more}\n\nclass One(Component):\n    y = Output('1')\n"


@pytest.fixture
def mine(tmp_path):
    """A folder of a user's own, with files of some content."""

    def write(folder="mine", **files):
        place = tmp_path / folder
        place.mkdir(exist_ok=True)
        for name, content in files.items():
            (place / name.replace("__", ".")).write_text(content)
        return place

    return write


def keep(directory, *models, **builds):
    """The models and build arguments of a system that is kept in a directory, and what was copied."""
    system = System()
    for number, model in enumerate(models):
        system.add(f"one{number}", str(model), builds)
    directory.mkdir(exist_ok=True)
    made, copies = kept(system, directory)
    copy(copies, directory)
    there = sorted(str(path.relative_to(directory)) for path in directory.rglob("*") if path.is_file())
    return [one.model for one in made.instances.values()], [one.build for one in made.instances.values()], there


def test_models_and_data_stand_beside_it(mine, tmp_path):
    place = mine(a__fmu="a", b__py=CODE.format(more="import helper\nimport scipy"), helper__py="", line__json="[1]")
    models, builds, there = keep(
        tmp_path / "out", place / "a.fmu", f"{place / 'b.py'}:One", "Line", profile=str(place / "line.json"), cars=8
    )
    assert models == ["models/a.fmu", "models/b.py:One", "Line"]
    assert builds == [{"profile": "models/line.json", "cars": 8}] * 3
    assert there == ["models/a.fmu", "models/b.py", "models/helper.py", "models/line.json"]


def test_what_is_below_is_not_copied(mine, tmp_path):
    place = mine(a__fmu="a")
    assert keep(tmp_path, place / "a.fmu")[0] == ["mine/a.fmu"]


def test_files_of_two_folders_do_not_see_one_another(mine, tmp_path):
    one, other = mine("one", a__fmu="a"), mine("other", a__fmu="b")
    models, _, there = keep(tmp_path / "out", one / "a.fmu", other / "a.fmu", one / "a.fmu")
    assert models == ["models/a.fmu", "models-2/a.fmu", "models/a.fmu"]
    assert there == ["models-2/a.fmu", "models/a.fmu"]


def test_what_was_copied_is_known_until_it_changes(mine, tmp_path):
    place = mine(a__fmu="a")
    for content, expected in (("a", "models/a.fmu"), ("a", "models/a.fmu"), ("b", "models-2/a.fmu")):
        mine(a__fmu=content)
        assert keep(tmp_path / "out", place / "a.fmu")[0] == [expected]
        assert (tmp_path / "out" / expected).read_text() == content


@pytest.mark.parametrize("more", ["import whole", "import folder", "HERE = __file__", "import linked"])
def test_code_that_may_need_more_stays_where_it_is(mine, tmp_path, more):
    place = mine(b__py=CODE.format(more=more))
    for name in ("whole", "folder"):
        (place / name).mkdir()
    (place / "whole" / "__init__.py").touch()
    (place / "linked.py").symlink_to(mine("elsewhere", linked__py="") / "linked.py")
    assert keep(tmp_path / "out", f"{place / 'b.py'}:One") == ([f"{place / 'b.py'}:One"], [{}], [])


def test_the_directory_runs_elsewhere(mine, tmp_path):
    place = mine(b__py=CODE.format(more=""))
    (tmp_path / "out").mkdir()
    system = System()
    system.add("one", f"{place / 'b.py'}:One")
    system, copies = kept(system, tmp_path / "out")
    copy(copies, tmp_path / "out")
    (tmp_path / "out" / "it.toml").write_text(dump(system))
    (tmp_path / "out").rename(tmp_path / "there")
    (place / "b.py").unlink()
    assert load(tmp_path / "there" / "it.toml").instances["one"].model == f"{tmp_path / 'there/models/b.py'}:One"
