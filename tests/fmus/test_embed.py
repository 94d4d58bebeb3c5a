"""The copy of the equations inside an FMU: what it holds, whom it imports, and that copies never meet."""

import ast
import sys
from pathlib import Path

import pytest
from railcosim.components import ComfortCruise, Component, ComponentError, Output
from railcosim.fmus import embed
from railcosim.fmus.build import build
from railcosim.fmus.embed import embedded_files
from railcosim.fmus.references import resolve

COMPONENTS = Path(__file__).parents[2] / "components"
HEAD = "from railcosim.components import Component, Output\n"
GIVES = "\n\nclass C(Component):\n    y = Output('1')\n\n    def outputs(self):\n        return {{'y': {}}}\n"


def value(instantiate, reference, arguments=None):
    """What the only output of a component's FMU gives, while every FMU made before is still alive."""
    return instantiate(reference, arguments).initialize().get("y")


# ---------------------------------------------------------------- copies never meet


def test_two_versions_of_one_file_each_keep_their_own_behaviour(write_component, instantiate):
    first = instantiate(write_component(HEAD + GIVES.format("1.0"))).initialize()
    second = instantiate(write_component(HEAD + GIVES.format("2.0"))).initialize()
    third = instantiate(write_component(HEAD + GIVES.format("1.0"))).initialize()
    assert [f.get("y") for f in (first, second, third)] == [1.0, 2.0, 1.0]
    assert first.description.guid == third.description.guid != second.description.guid


def test_two_versions_of_a_helper_beside_the_same_file(write_component, instantiate):
    text = HEAD + "import helper" + GIVES.format("helper.number()")
    first = instantiate(write_component(text, helper="def number():\n    return 1.0\n")).initialize()
    second = instantiate(write_component(text, helper="def number():\n    return 2.0\n")).initialize()
    assert [f.get("y") for f in (first, second)] == [1.0, 2.0]


def test_helpers_of_one_name_in_two_folders(write_component, instantiate):
    text = HEAD + "from helper import number" + GIVES.format("number")
    values = [
        value(instantiate, write_component(text, folder=f, helper=f"number = {n}\n"))
        for f, n in (("a", 1.0), ("b", 2.0))
    ]
    assert values == [1.0, 2.0]


def test_the_component_itself_sees_the_helper_beside_it(write_component):
    text = HEAD + "import helper" + GIVES.format("helper.number")
    for number in (1.0, 2.0):
        cls = resolve(write_component(text, helper=f"number = {number}\n"))
        assert cls().outputs() == {"y": number}


def test_loading_leaves_no_trace(write_component, tmp_path):
    sentinel = sys.modules["helper"] = type(sys)("helper")
    before, flag = list(sys.path), sys.dont_write_bytecode
    try:
        resolve(write_component(HEAD + "import helper" + GIVES.format("helper.number"), helper="number = 1.0\n"))
        assert sys.modules["helper"] is sentinel
    finally:
        del sys.modules["helper"]
    resolve(write_component(HEAD + "import helper" + GIVES.format("helper.number"), helper="number = 1.0\n"))
    assert "helper" not in sys.modules
    assert (sys.path, sys.dont_write_bytecode) == (before, flag)
    assert not list(tmp_path.rglob("__pycache__"))


def test_different_build_arguments_in_one_process(write_component, instantiate):
    reference = write_component(
        "from railcosim.components import Component, Output, Size\n\n\nclass C(Component):\n    n = Size(1)\n"
        "    y = Output('1')\n\n    def outputs(self):\n        return {'y': 1.0 * self.n}\n"
    )
    instances = [instantiate(reference, {"n": n}).initialize() for n in (1, 2, 3)]
    assert [i.get("y") for i in instances] == [1.0, 2.0, 3.0]


# ---------------------------------------------------------------- imports


@pytest.mark.parametrize(
    ("imports", "expression"),
    [
        ("import helper", "helper.number"),
        ("import helper as h", "h.number"),
        ("import math, helper as h, sys", "math.pi * 0 + h.number + 0 * sys.maxsize"),
        ("from helper import number", "number"),
        ("from helper import number as n, other", "n + 0 * other"),
        ("from helper import (\n    number,\n    other,\n)", "number + 0 * other"),
        ("from helper import *", "number"),
        ("import helper; shift = 0.0  # and more on the line", "helper.number + shift"),
        ("import math; import helper; from helper import number", "0 * math.pi + helper.number * number / 7.0"),
        ("größe = 0.0; from helper import number; größe = 0.0", "number + größe"),
        ("if True: import helper", "helper.number"),
        ("try:\n    import helper\nexcept ImportError:\n    helper = None", "helper.number"),
        ("from railcosim.components import maths; import helper", "maths.absolute(-helper.number)"),
        ("from railcosim.components.maths import absolute as a", "a(-7.0)"),
        (
            "from railcosim.components import maths as m, Gust\nfrom math import pi",
            "m.cos(0 * pi) * 7.0 * (Gust is not None)",
        ),
        ("from railcosim.components.environment.gust import Gust", "Gust(size=7.0, start_time=0.0).size"),
        ("import numpy as np\nfrom numpy import linalg", "float(np.array([7.0])[0]) + 0 * len(linalg.__name__)"),
        ("import os.path", "7.0 + 0 * len(os.path.sep)"),
        ("", "__import__('math').sqrt(49.0)"),
    ],
)
def test_imports_work_in_the_copy_as_in_the_file(write_component, instantiate, imports, expression):
    helper = "import second\n\nnumber = second.seven()\nother = 1.0\n"
    second = "from railcosim.components.maths import absolute\n\n\ndef seven():\n    return absolute(-7.0)\n"
    reference = write_component(HEAD + imports + GIVES.format(expression), helper=helper, second=second)
    assert resolve(reference)().outputs() == {"y": 7.0}
    assert value(instantiate, reference) == 7.0


def test_helpers_that_import_each_other(write_component, instantiate):
    reference = write_component(
        HEAD + "import even" + GIVES.format("1.0 * even.is_even(4)"),
        even="import odd\n\n\ndef is_even(n):\n    return n == 0 or odd.is_odd(n - 1)\n",
        odd="import even\n\n\ndef is_odd(n):\n    return n != 0 and even.is_even(n - 1)\n",
    )
    assert value(instantiate, reference) == 1.0


def test_a_class_that_extends_a_shipped_one(write_component, instantiate):
    reference = write_component(
        "from railcosim.components import ComfortCruise\n\n\nclass C(ComfortCruise):\n    '''Half as eager.'''\n\n"
        "    def outputs(self):\n        found = super().outputs()\n"
        "        return {**found, 'demand': 0.5 * found['demand']}\n"
    )
    whole, half = instantiate("ComfortCruise"), instantiate(reference)
    for instance in (whole, half):
        instance.initialize(target_speed=3.0)
    assert whole.get("demand") != 0.0
    assert half.get("demand") == 0.5 * whole.get("demand")


def test_a_byte_order_mark_and_windows_line_ends(write_component, instantiate):
    text = (HEAD + "import helper" + GIVES.format("helper.number")).replace("\n", "\r\n")
    assert value(instantiate, write_component("\ufeff" + text, helper="\ufeffnumber = 7.0\r\n")) == 7.0


def test_the_copy_imports_nothing_of_the_project(reference):
    files, _ = embedded_files(resolve(reference))
    for name, text in files.items():
        lines = [line.strip() for line in text.splitlines()]
        offenders = [line for line in lines if line.startswith(("from railcosim", "import railcosim"))]
        assert not offenders, name
        assert "import pythonfmu" not in text


def test_the_copy_holds_what_is_needed_and_no_more():
    files, module = embedded_files(ComfortCruise)
    assert module == "components.cruise.comfort"
    assert {"components/cruise/comfort.py", "components/cruise/port.py", "components/maths.py"} <= files.keys()
    assert {"fmus/pythonfmu_slave.py", "fmus/variables.py", "__init__.py", "components/__init__.py"} <= files.keys()
    assert not [name for name in files if "gust" in name or "description" in name or "build" in name]


# ---------------------------------------------------------------- what is refused


def refusal(reference):
    with pytest.raises(ComponentError) as caught:
        build(reference)
    return str(caught.value)


def test_an_unnamed_package_is_refused_with_place_and_remedy(write_component):
    reference = write_component(HEAD + "\nimport platformdirs" + GIVES.format("1.0"))
    file = reference.rpartition(":")[0]
    assert (
        refusal(reference) == f"{file}:3: C imports 'platformdirs'; name it in the class: requires = ('platformdirs',)"
    )


def test_an_unnamed_package_in_a_helper_is_refused_there(write_component):
    reference = write_component(HEAD + "import helper" + GIVES.format("1.0"), helper="\n\nfrom rich.text import Text\n")
    assert "helper.py:3: C imports 'rich'; name it in the class" in refusal(reference)


def test_a_named_package_is_honoured(write_component, instantiate):
    body = GIVES.format("1.0 * len(platformdirs.__name__)").replace(
        "y = Output", "requires = ('platformdirs',)\n    y = Output"
    )
    assert value(instantiate, write_component(HEAD + "import platformdirs" + body)) == len("platformdirs")


@pytest.mark.parametrize(
    ("statement", "complaint"),
    [
        ("import railcosim.components.maths as maths", ":2: write 'from railcosim.components import ...'"),
        ("from railcosim.fmus.build import build", ":2: a component may import from railcosim.components only"),
        ("from railcosim import components", ":2: a component may import from railcosim.components only"),
        ("from railcosim.components import CATALOGUE", ":2: railcosim.components has no 'CATALOGUE'"),
        (
            "from railcosim.components.cruise import comfort",
            ":2: railcosim.components.cruise is a folder; import 'comfort'",
        ),
        (
            "from folder import inside",
            ":2: 'folder' is a folder; a component's local modules are single files beside it",
        ),
        ("import folder.inside", ":2: 'folder' is a folder"),
    ],
)
def test_imports_that_a_copy_cannot_serve(write_component, tmp_path, statement, complaint):
    reference = write_component(HEAD + statement + GIVES.format("1.0"))
    (tmp_path / "user" / "folder").mkdir()
    (tmp_path / "user" / "folder" / "inside.py").write_text("number = 1.0\n")
    assert "my_controller.py" + complaint in refusal(reference)


def test_a_relative_import_is_refused(write_component, tmp_path):
    # Python refuses it too, where the file is no part of a package: the message is its own, with the line.
    reference = write_component(HEAD + "from .helper import number" + GIVES.format("number"), helper="number = 1.0\n")
    assert "my_controller.py:2: ImportError: attempted relative import" in refusal(reference)


@pytest.mark.parametrize("name", ["my-controller.py", "2020.py", "class.py", "größe.py", "a b.py"])
def test_a_file_name_that_is_no_module_name(write_component, name):
    message = refusal(write_component(HEAD + GIVES.format("1.0"), name=name))
    assert f"{name}: rename the file to ASCII letters, digits and _ only" in message


def test_a_class_inside_a_function_is_refused():
    class Inner(Component):
        y = Output("1")

        def outputs(self):
            return {"y": 1.0}

    with pytest.raises(ComponentError, match="Inner must stand at the top level of a file"):
        embedded_files(Inner)


def test_a_class_typed_at_a_prompt_is_refused():
    space = {"__name__": "a_notebook"}
    exec(HEAD + GIVES.format("1.0"), space)
    with pytest.raises(ComponentError, match="C must stand at the top level of a file, so that its FMU can carry"):
        embedded_files(space["C"])


def test_files_of_the_project_are_found_as_python_finds_them():
    """What is read by a pattern, beside the parsed statements."""
    for path in sorted(COMPONENTS.rglob("*.py")):
        name = f"components/{path.relative_to(COMPONENTS).as_posix()}"
        nodes = [n for n in ast.walk(ast.parse(path.read_text())) if isinstance(n, ast.ImportFrom) and n.level]
        wanted = set()
        for node in nodes:
            base = Path(name).parents[node.level - 1]
            names = [node.module] if node.module else [alias.name for alias in node.names]
            wanted |= {f"{(base / each.replace('.', '/')).as_posix()}.py" for each in names}
        assert set(embed._own_file(name)[1]) == wanted, name
