"""Tables of many rows, laid out in one pass."""

import io

from railcosim.orchestrator.cli.printing.listing import show_listing
from rich.console import Console

HEADS = ("name", "start", "what it is")
ROWS = [
    ("x", "1.5", "a length"),
    ("a  long name", "20", "what takes several lines where it is narrow"),
    ("größe", "", ""),
]


def listed(width, rows=ROWS):
    stream = io.StringIO()
    out = Console(file=stream, width=width)
    show_listing(out, "Title", HEADS, rows, right=("start",), fold=("name", "what it is"))
    return stream.getvalue().splitlines()


def test_a_wide_console_takes_a_line_a_row():
    assert [line.rstrip() for line in listed(100)] == [
        "",
        "Title",
        "name          start  what it is",
        "x               1.5  a length",
        "a  long name     20  what takes several lines where it is narrow",
        "größe",
    ]


def test_a_narrow_console_folds_the_widest_column_that_may_be():
    lines = listed(45)
    assert max(map(len, lines)) <= 45
    assert [line.rstrip() for line in lines[4:7]] == [
        "a  long name     20  what takes several lines",
        "                     where it is narrow",
        "größe",
    ]


def test_columns_stay_wide_enough_to_be_read():
    lines = listed(5)
    assert "what" in [line.split("  ")[-1].strip() for line in lines]
    assert "several" in [line.strip() for line in lines]


def test_what_steers_a_terminal_is_named():
    lines = listed(100, [("x\x1b[31m", "", "two\nlines")])
    assert lines[-1].split("  ")[0] == r"x\x1b[31m"
    assert lines[-1].endswith("two lines")
