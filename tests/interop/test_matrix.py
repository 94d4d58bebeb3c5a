"""The matrix of tools over scenarios, benchmarks/interop.py: what counts as the same, and what a missing tool is."""

import zipfile

import numpy as np
import pytest
from railcosim.fmus.build import build


@pytest.fixture(scope="module")
def interop(benchmark):
    return benchmark("interop")


@pytest.fixture(scope="module")
def others(benchmark):
    return benchmark("others")


def test_signals_are_the_same_early_mixed_or_depart(others):
    ours = np.array([0.0, 100.0, 300.0, 200.0])
    shown = {
        "same": ours + 1e-10,
        "early": np.append(ours[1:], 7.0),
        "train.acceleration": ours + 1.0,
        "off": ours + 3.0,
    }
    found = others.fit(dict.fromkeys(shown, ours), shown, {"train.acceleration"})
    assert (found.plain, found.early, found.mixed) == (1, 1, 1)
    assert found.off == {"off": pytest.approx(0.01)}
    assert str(found) == "3e-13, 2 signals, 1 of them early, 1 more mixed, **1 more depart**, `off` most: 1e-02"
    broken = others.fit({"a": ours}, {"a": np.array([0.0, np.nan, 300.0, 200.0])})
    assert (broken.plain, broken.off) == (0, {"a": np.inf})
    with pytest.raises(ValueError, match="same: 3 points, not 4"):
        others.fit({"same": ours}, {"same": ours[:3]})


def test_a_tool_that_is_not_installed_has_its_row(interop):
    tool = interop.Tool("Elsewhere", "there_is_no_such_tool", "jacobi", lambda *_: {}, "nothing")
    assert list(interop.matrix((tool,), {}))[2:] == ["| Elsewhere | not installed here | | |"]


def test_the_tables_stand_between_the_marks(others):
    marks = "<!-- tables -->", "<!-- end -->"
    page = "\n".join(["before", *marks, "after"])
    assert others.written(page, "| new |", marks) == f"before\n{marks[0]}\n\n| new |\n\n{marks[1]}\nafter"
    old = others.written(page, "| old |", marks)
    assert others.written(old, "| new |", marks) == others.written(page, "| new |", marks)
    with pytest.raises(ValueError, match="no <!-- tables"):
        others.written("a page", "| new |", marks)


@pytest.mark.long
def test_both_checkers_find_what_is_wrong(interop, native, need, tmp_path):
    need("fmu_manipulation_toolbox")
    path = tmp_path / "broken.fmu"
    with zipfile.ZipFile(build("PointMassTrain", kind="native")) as old, zipfile.ZipFile(path, "w") as new:
        for name in old.namelist():
            content = old.read(name)
            if name == "modelDescription.xml":
                content = content.replace(b'causality="input"', b'causality="inward"')
            new.writestr(name, content)
    assert interop.by_fmpy(path)
    assert interop.by_toolbox(path)
