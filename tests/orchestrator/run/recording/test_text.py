"""The text of results: the shortest digits, whatever the neighbours of a number are."""

import io
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from railcosim.orchestrator.run.recording import text
from railcosim.orchestrator.run.recording.text import read_csv, write_csv
from railcosim.orchestrator.run.recording.words import Words

COLUMNS = ["time", "a.x", "a.on", "a.word", "b.x"]


def written(rows, whole=(2,), columns=COLUMNS, words=None):
    stream = io.BytesIO()
    write_csv(stream, columns, whole, words or Words(()), [np.array(rows, dtype=float)])
    return stream.getvalue().decode()


def test_kinds_of_columns_side_by_side():
    words = Words([3])
    rows = words.encode([[0.0, 0.5, 1, "so, so", -0.0], [0.1, 1e-7, 0, "b", 2e9]])
    assert (
        written(rows, words=words) == 'time,a.x,a.on,a.word,b.x\n0.0,0.5,1,"so, so",-0.0\n0.1,1e-7,0,b,2000000000.0\n'
    )


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_what_is_no_number_is_written_all_the_same(value):
    """The row at which a run fails may hold it."""
    assert written([[0.0, value]], (), ["time", "a.x"]) == f"time,a.x\n0.0,{value!r}\n"


@pytest.mark.parametrize("value", [2.0**63, -(2.0**64), 1e300, math.inf])
def test_whole_numbers_beyond_64_bits(value):
    line = written([[0.0, value]], (1,), ["time", "a.n"]).splitlines()[1]
    assert line == f"0.0,{int(value) if math.isfinite(value) else 'inf'}"


@given(st.lists(st.floats(), min_size=1, max_size=20), st.sets(st.integers(1, 3)))
def test_the_same_numbers_come_back(tmp_path_factory, numbers, whole):
    path = tmp_path_factory.mktemp("text") / "results.csv"
    rows = np.array([[k, x, -x, x / 3] for k, x in enumerate(numbers)], dtype=float)
    rows[:, list(whole)] = np.round(rows[:, list(whole)])
    with path.open("wb") as stream:
        write_csv(stream, COLUMNS[:4], whole, Words(()), [rows[:3], rows[3:]])
    header, _, blocks = read_csv(path, ())
    assert header == COLUMNS[:4]
    back = np.concatenate(list(blocks))
    np.testing.assert_array_equal(back, rows)


def test_long_texts_are_read_piece_by_piece(tmp_path, monkeypatch):
    monkeypatch.setattr(text, "_SLAB", 7)
    path = tmp_path / "results.csv"
    path.write_text("time,x\n0.0,1.25\n1.0,2.25\n2.0,3")
    blocks = list(read_csv(path, ())[2])
    assert len(blocks) > 1
    np.testing.assert_array_equal(np.concatenate(blocks), [[0.0, 1.25], [1.0, 2.25]])


def test_rows_of_another_width(tmp_path):
    path = tmp_path / "results.csv"
    path.write_text("time,x\n0.0,1.25,7\n")
    with pytest.raises(ValueError, match="its rows have 3 columns, its header has 2"):
        list(read_csv(path, ())[2])
