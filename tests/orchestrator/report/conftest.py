"""Runs whose pages are looked at."""

from functools import partial

import pytest
from railcosim.orchestrator import System, run
from railcosim.orchestrator.report.content import Columns, read_content, signals_of, told_of
from railcosim.orchestrator.report.panels import panels

TITLE = 'A </script><img src=x onerror="document.title=1"> & $$x$$'


def build(mine, **how):
    """Two lags behind a wave, with requirements that hold and that do not."""
    system = System(**{"stop_time": 20.0, "step": 0.1} | how)
    system.add("wave", mine("Wave"))
    system.add("lag[1]", mine("Lag"), x=0.3)
    system.add("lag[2]", mine("Lag"), x=0.9)
    system.connect("wave.y", "lag[1].u")
    system.connect("lag[1].x", "lag[2].u")
    system.provenance.title = TITLE
    system.judged.metrics = {"peak": "peak(lag[i].x)", "end": "final(wave.y)"}
    system.judged.requirements = {"low": "always lag[i].x < 0.95", "lower": "always lag[i].x < 0.5"}
    twice = {"title": "twice, up to {max(lag[1].x)}", "y": ["lag[1].x"], "scale": 2.0, "y_label": "2 x"}
    system.judged.figures = [
        {"title": "Both </script>", "y": ["lag[:].x", "wave.y", "lag[1].x - wave.y"]},
        {"title": "Scaled", "panels": [twice]},
        {"title": "Over another", "x": "lag[1].x", "y": ["lag[2].x"]},
    ]
    return system


@pytest.fixture
def wavy(mine):
    """Makes such a system."""
    return partial(build, mine)


@pytest.fixture
def title():
    """Of such a system: one that wants to be markup, or mathematics."""
    return TITLE


@pytest.fixture
def directory(wavy, tmp_path):
    """Of a run that has ended."""
    run(wavy(), kind="native", output=tmp_path / "run", figures=False)
    return tmp_path / "run"


def tell(*directories):
    """What the script of a page is given of runs, and the runs."""
    columns = Columns()
    contents = [read_content(directory, columns) for directory in directories]
    names = [str(k) for k in range(len(contents))]
    data = {
        "runs": [told_of(content, name, columns) for content, name in zip(contents, names, strict=True)],
        "signals": signals_of(contents),
        "panels": panels(contents, names, columns),
        "columns": columns.told,
    }
    return data, contents


@pytest.fixture
def told():
    """Tells what a page is given of runs."""
    return tell
