"""Where the values of steps are kept."""

import numpy as np
import pytest
from railcosim.orchestrator.master import Table


def test_what_is_written_into_the_room_is_seen_as_rows_and_as_columns():
    table = Table([4, 2], 3)
    cells = table.room(2)
    cells[:, :2] = [[0.0, 0.5], [1.0, 2.0], [3.0, 4.0]]
    rows = table.filled(2)
    assert rows.tolist() == [[0.0, 1.0, 3.0], [0.5, 2.0, 4.0]]
    rows[-1][0] = 0.25
    table.append(np.array([[0.75, 5.0, 6.0]]))
    assert table.columns().tolist() == [[0.0, 0.25, 0.75], [1.0, 2.0, 5.0], [3.0, 4.0, 6.0]]
    assert table.kept.tolist() == [4, 2]
    assert table.count == 3


def test_rows_of_all_values_are_kept_and_shown():
    table, shown = Table([2, 0]), []
    observe = table.keeping(lambda steps, rows: shown.append((steps, rows.tolist())) or True)
    assert observe(1, [[0.5, 1, 2, 3.0]])
    assert observe(2, ())
    assert shown == [(1, [[0.5, 3.0, 1.0]]), (2, [])]
    assert table.columns().tolist() == [[0.5], [3.0], [1.0]]


def test_columns_are_views():
    table = Table([0], 5000)
    table.append(np.zeros((3, 2)))
    assert np.shares_memory(table.columns(), table.room(0))
    assert table.columns()[1].flags.c_contiguous


@pytest.mark.parametrize("rows", [0, 10**15, 10**18], ids=["unknown", "beyond memory", "beyond addresses"])
def test_it_grows_where_there_is_no_room(rows):
    table = Table(range(100), rows)
    numbers = np.arange(2500.0)
    for begin in range(0, 2500, 500):
        table.append(np.tile(numbers[begin : begin + 500], (101, 1)).T)
    assert (table.columns() == numbers).all()
    assert table.room(0).nbytes < 5_000_000
