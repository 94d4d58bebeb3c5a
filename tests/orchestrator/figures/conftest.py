"""A run to draw, and its figures as matplotlib objects."""

import numpy as np
import pytest
from railcosim.orchestrator.figures import draw


class Run:
    """Three trains with a controller each, twelve cars and a target, over 10 s."""

    step, completed, stop_time = 0.5, True, 10.0
    time = np.arange(21) * 0.5
    parameters = {"cruise[1].gap_min": 15e3, "cruise[1].mode": "comfort"}  # noqa: RUF012

    def __init__(self):
        self.columns = {"target.value": np.full(21, 20.0)}
        self.units = {"target.value": "m/s"}
        for i in range(1, 4):
            self.columns[f"train[{i}].speed"] = i * self.time
            self.columns[f"train[{i}].position"] = -17e3 * i + i * self.time**2 / 2
            self.columns[f"cruise[{i}].force"] = np.full(21, 1e5 * i)
            self.units |= {f"train[{i}].speed": "m/s", f"train[{i}].position": "m", f"cruise[{i}].force": "N"}
        for i in range(1, 13):
            self.columns[f"car[{i}].speed"] = self.time / i
        self.columns |= {f"consist[{i}].force[{k}]": self.time * k for i in (1, 2) for k in (1, 2)}
        self.columns |= {f"lone.{name}": self.time for name in ("force[1]", "force[2]", "map[1,1]", "map[1,2]")}
        self.columns |= {f"lone.{name}": self.time for name in ("x[0]", "x[-1]", "n[1][1]", "n[1][2]", "$a")}

    def names(self):
        return self.columns.keys()

    points = len(time)

    def part(self, first, last):
        return {name: values[first:last] for name, values in {"time": self.time, **self.columns}.items()}

    def __getitem__(self, name):
        return self.columns[name]


@pytest.fixture
def recorded():
    return Run()


@pytest.fixture
def names(recorded):
    """What an expression may mention."""
    return [*recorded.names(), *recorded.parameters]


@pytest.fixture
def drawn(recorded, tmp_path, monkeypatch):
    """Draw a figure; gives its axes, caught on their way to the file."""
    from matplotlib.figure import Figure

    kept = []
    original = Figure.savefig
    monkeypatch.setattr(Figure, "savefig", lambda self, *args, **how: (kept.append(self), original(self, *args, **how)))

    def axes(**figure):
        draw([{"title": "Figure", **figure}], recorded, tmp_path)
        return kept[-1].axes

    return axes
