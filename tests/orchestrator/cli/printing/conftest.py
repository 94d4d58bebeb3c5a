"""What is printed, as lines of text."""

import io
import re

import pytest
from railcosim.orchestrator import bars
from rich.console import Console


def _shown(show, *arguments, width=120):
    """What a function prints on a terminal of that width, without colours; no line is wider than it."""
    out = Console(file=io.StringIO(), width=width, highlight=False, force_terminal=True, color_system=None)
    show(out, *arguments)
    text = re.sub(r"\x1b\[[0-9;]*m", "", out.file.getvalue())
    assert max(map(len, text.splitlines())) <= width
    return [line.rstrip() for line in text.splitlines()]


@pytest.fixture
def shown():
    return _shown


@pytest.fixture
def at_once(monkeypatch):
    """What is shown after a second is shown at once."""

    class Timer:
        def __init__(self, _, start):
            self.start, self.cancel, self.join = start, lambda: None, lambda: None

    monkeypatch.setattr(bars.threading, "Timer", Timer)
