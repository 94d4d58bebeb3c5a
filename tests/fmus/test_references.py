"""What a user names: components of the catalogue and of files, and data files."""

import zipfile

import pytest
from railcosim.components import ComponentError
from railcosim.fmus.build import build, plain
from railcosim.fmus.references import build_with, imports_of, resolve

USER = (
    "from railcosim.components import Component, Output\n\n\nclass C(Component):\n    y = Output('1')\n\n"
    "    def outputs(self):\n        return {'y': 1.0}\n"
)


@pytest.mark.parametrize(
    ("name", "complaint"),
    [
        ("ComfortCruse", "there is no component 'ComfortCruse'; did you mean 'ComfortCruise'?"),
        ("Zeppelin", "there is no component 'Zeppelin'; there is "),
        ("Zeppelin", "one of your own is written file.py:Class"),
        ("nowhere.py:C", "nowhere.py"),
    ],
)
def test_an_unknown_name(name, complaint):
    with pytest.raises(ComponentError) as caught:
        resolve(name)
    assert complaint in str(caught.value)


def test_an_unknown_class_of_a_file(write_component):
    path = write_component(USER.replace("class C", "class Controller")).rpartition(":")[0]
    with pytest.raises(ComponentError, match="has no component 'Controler'; did you mean 'Controller'\\?"):
        resolve(f"{path}:Controler")
    with pytest.raises(ComponentError, match="has no component 'Component'; there is Controller"):
        resolve(f"{path}:Component")


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("\n\nx = 1 +\n", ":3: SyntaxError"),
        ("\nx = 1\nraise RuntimeError('broken')\n", ":3: RuntimeError: broken"),
        ("\nimport helper\n", ":2: ZeroDivisionError"),
        ("\nimport not_installed_anywhere\n", ":2: ModuleNotFoundError: No module named 'not_installed_anywhere'"),
        (
            "from railcosim.components import Component, Memory\n\n\nclass C(Component):\n    time = Memory('s')\n",
            ":4: ComponentError: C.time",
        ),
    ],
)
def test_a_file_that_does_not_load_names_its_line(write_component, text, complaint):
    reference = write_component(text, helper="\n\n\n1 / 0\n")
    with pytest.raises(ComponentError) as caught:
        build(reference)
    assert f"my_controller.py{complaint}" in str(caught.value)


def test_a_syntax_error_in_a_helper_names_the_helper(write_component):
    with pytest.raises(ComponentError) as caught:
        build(write_component("\nimport helper\n", helper="\n\n\n\nx = = 1\n"))
    assert "my_controller.py:2: SyntaxError: invalid syntax (helper.py, line 5)" in str(caught.value)


def test_a_relative_path_starts_at_the_folder_given(write_component, tmp_path):
    write_component(USER)
    assert resolve("user/my_controller.py:C", tmp_path)().outputs() == {"y": 1.0}
    assert zipfile.is_zipfile(build("user/my_controller.py:C", folder=tmp_path))


def test_a_file_edited_within_the_second_is_read_again(write_component):
    """Python itself would take the compiled file of the same second and size: none is left behind."""
    for number in range(3):
        assert resolve(write_component(USER.replace("1.0", f"{number}.0")))().outputs() == {"y": float(number)}


# ---------------------------------------------------------------- data files


def test_a_data_file_is_read_and_belongs_to_the_identity(tmp_path):
    line = tmp_path / "line.json"
    line.write_text('[{"position": 0.0, "gradient": 0.005}]', encoding="utf-8")
    first = build("Line", {"line": str(line)})
    line.write_text('[{"position": 0.0, "gradient": 0.006}]', encoding="utf-8")
    assert build("Line", {"line": str(line)}) != first


@pytest.mark.parametrize(
    ("text", "complaint"), [(None, "cannot be read"), ("[1,", "is not JSON"), (100_000 * "[", "is nested too deep")]
)
def test_a_data_file_that_cannot_be_used(tmp_path, text, complaint):
    path = tmp_path / "line.json"
    if text is not None:
        path.write_text(text, encoding="utf-8")
    with pytest.raises(ComponentError, match=complaint):
        build("Line", {"line": str(path)})


def test_a_table_is_rows_by_the_names_in_its_first_line(tmp_path):
    path = tmp_path / "profile.csv"
    path.write_text("position,time,speed\n0,0,0\n2,2,2\n4.0,4e0,0\n", encoding="utf-8")
    plan = build_with(resolve("ProfileTimetable"), {"profile": str(path)}).profile
    assert (plan.duration, plan.distance) == (9.0, 4.0)
    for wrong in ("position,time,speed\n0,0,0\n1,2\n", "position,time,speed\n0,0,0\n1,2;5,3\n"):
        path.write_text(wrong, encoding="utf-8")
        with pytest.raises(ComponentError, match=r"profile: .*profile.csv: line 3 is not a number for each column"):
            build_with(resolve("ProfileTimetable"), {"profile": str(path)})


def test_a_vast_data_file_is_not_read(tmp_path):
    path = tmp_path / "line.json"
    with path.open("wb") as stream:
        stream.truncate(100 << 20)
    with pytest.raises(ComponentError, match=r"^line: .*line\.json has 100 MiB; no more than 16 are read$"):
        build("Line", {"line": str(path)})


def test_what_is_wrong_in_a_data_file_is_told_with_the_file(tmp_path):
    path = tmp_path / "line.json"
    path.write_text('[{"position": 0.0}, {"position": 100.0, "gradient": 5.0}]')
    for make in (build, plain):
        with pytest.raises(ComponentError) as told:
            make("Line", {"line": str(path)})
        assert str(told.value).startswith(f"{path}: Line: build argument 'line' is unusable: section 2: 'gradient' is")


def test_what_an_import_executes_is_known_before(tmp_path):
    (tmp_path / "own.py").write_text(
        "import math, numpy.linalg, helper, dated.more\nfrom railcosim.components import Component\n\n\n"
        "def later():\n    from scipy import linalg\n    import helper\n    import data, json\n    import folder\n"
    )
    (tmp_path / "helper.py").write_text("import own\nimport dated\nfrom . import nothing\nfrom .x import nothing\n")
    for folder in ("data", "json", "folder"):  # data in it, or modules
        (tmp_path / folder).mkdir()
    (tmp_path / "folder" / "__init__.py").write_text("")
    (tmp_path / "dated.py").write_text("this is not Python")
    found = imports_of(tmp_path / "own.py")
    assert sorted(found.files) == sorted((tmp_path / name).resolve() for name in ("own.py", "helper.py", "dated.py"))
    own = (tmp_path / "own.py").resolve()
    assert found.others == {"scipy": own, "data": own, str(own.parent / "folder"): own}


def test_shipped_data_are_found_by_name_where_the_folder_has_none(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert len(build_with(resolve("Line"), {"line": "lines/yizhuang.json"}).line.stops) == 27
    (tmp_path / "lines").mkdir()
    (tmp_path / "lines" / "yizhuang.json").write_text('[{"position": 0.0}]', encoding="utf-8")
    assert build_with(resolve("Line"), {"line": "lines/yizhuang.json"}).line.stops == ()
    for name in ("lines/nowhere.json", "hilly_line.json"):
        with pytest.raises(ComponentError, match="cannot be read"):
            build_with(resolve("Line"), {"line": name})
