"""A bar for what takes longer than a second."""

import io
import re
import threading

import pytest
from railcosim.orchestrator import bars, load, progress_bar, run
from rich.console import Console


@pytest.fixture
def clock(monkeypatch):
    """Time passes by a second whenever it is asked for; what is shown after a second is shown at once."""
    times = iter(range(1000))
    monkeypatch.setattr(bars.world, "monotonic", lambda: float(next(times)))

    class Timer:
        def __init__(self, _, start):
            self.start, self.cancel, self.join = start, lambda: None, lambda: None

    monkeypatch.setattr(bars.threading, "Timer", Timer)


def shown(width, **console):
    """What a run of 350 s leaves on a terminal at 50.3 s, the last line."""
    out = Console(file=io.StringIO(), width=width, force_terminal=True, **console)
    with progress_bar("a cruise with a very long title indeed [bold]", 0.0, console=out) as bar:
        for time in (0.0, 50.0 + 1 / 3):
            bar(time, 350.0)
    text = out.file.getvalue()
    plain = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", text)
    return text, [line for line in re.split("[\r\n]", plain) if line.strip()][-1]


@pytest.mark.parametrize("width", [40, 60, 80, 100, 200])
def test_there_is_room_for_time_speed_and_estimate(width, clock):
    _, line = shown(width)
    assert len(line) <= width
    assert line.startswith("a cruise with a ver")
    assert line.rstrip().endswith("left")
    assert ("14%" in line) == (width < 60)
    assert ("50.3 of 350 s, 50.3x real time" in line) == (width >= 60)


def test_no_color_means_none(clock, monkeypatch):
    assert re.search(r"\x1b\[[0-9;]+m", shown(100, color_system="standard")[0])
    monkeypatch.setenv("NO_COLOR", "1")
    assert not re.search(r"\x1b\[[0-9;]*3\d[0-9;]*m", shown(100)[0])


def test_in_a_pipe_and_within_a_second_nothing_is_shown():
    for terminal in (False, True):
        out = Console(file=io.StringIO(), width=80, force_terminal=terminal)
        with progress_bar("short", console=out) as bar:
            bar(0.0, 1.0)
            bar.count(1, 2, "1 of 2")
            bar.tell("something else")
        assert out.file.getvalue() in ("", "\x1b[?25h")
        assert not [each for each in threading.enumerate() if isinstance(each, threading.Timer)]


@pytest.mark.parametrize("there", [False, True])
def test_in_a_notebook_it_takes_ipywidgets(there, monkeypatch):
    monkeypatch.setattr(bars, "find_spec", lambda _: there or None)
    with progress_bar("in a notebook", console=Console(force_jupyter=True)) as bar:
        bar(1.0, 2.0)
    assert (bar._display is not None) == there


def test_a_run_of_a_script_can_have_one(clock, tmp_path):
    text = "[simulation]\nstop_time = 1.0\nstep = 0.5\n[instances.train]\nstart.force = 0.0\n"
    (tmp_path / "train.toml").write_text(text + 'component = "PointMassTrain"\n')
    out = Console(file=io.StringIO(), width=100, force_terminal=True)
    with progress_bar("a run", console=out) as bar:
        bar.tell("compiling")
        assert run(load(tmp_path / "train.toml"), kind="plain", progress=bar).status == "completed"
    assert "1 of 1 s" in out.file.getvalue()
    assert bars._rounded(0.0, 0.0) == 0.0
