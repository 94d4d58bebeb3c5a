"""An error about equations points at a line of their author's, not of ours or NumPy's."""

import numpy as np
from railcosim.components import maths
from railcosim.components.authors import line_of, place_of


def caught(function):
    try:
        function()
    except Exception as error:
        return error
    raise AssertionError("nothing was raised")


def test_lines_inside_our_own_files_and_numpy_are_passed_over():
    def in_ours():
        return maths.sqrt(-1.0)

    def in_numpy():
        return np.linalg.inv(np.zeros((2, 2)))

    for function in (in_ours, in_numpy):
        line = function.__code__.co_firstlineno + 1
        assert line_of(caught(function)).startswith(f"test_authors.py:{line}, 'return ")


def test_nothing_is_said_where_no_line_is_an_authors(tmp_path):
    assert line_of(ValueError()) == ""
    code = compile("1 / 0", str(tmp_path / "theirs.py"), "exec")
    error = caught(lambda: exec(code))
    assert line_of(error).startswith("theirs.py:1")
    assert line_of(error, tmp_path).startswith("test_authors.py:")


def test_the_place_of_a_method():
    assert place_of(caught) == f"test_authors.py:{caught.__code__.co_firstlineno}"
    assert place_of(None) == place_of(len) == ""
