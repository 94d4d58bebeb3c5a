"""Signal temporal logic by its definition, point by point, and random formulas to compare it with ours."""

import math
import random
from types import SimpleNamespace

import numpy as np
import pytest
from railcosim.orchestrator.evaluation import signals
from railcosim.orchestrator.run.recording import Results

STEP, FORGIVEN = 0.5, 0.5e-6
PAST = ("once", "historically", "since")


def made(time, columns, *, units=None, parameters=None, completed=True):
    """A run of arrays."""
    time = np.asarray(time, float)
    columns = {name: np.broadcast_to(np.asarray(x, float), time.shape) for name, x in columns.items()}
    stop, more = float(time[-1]), {"units": units or {}, "parameters": parameters or {}}
    return Results(columns, time, step=STEP, stop_time=stop, completed=completed, **more)


def direct(formula, run):
    """The least and the most that a formula can be at every point of a run: a list of pairs."""
    word, *parts = formula
    if word == "signal":
        return [(value - parts[1],) * 2 for value in run[parts[0]]]
    if word == "not":
        return [(-high, -low) for low, high in direct(parts[0], run)]
    if word in ("and", "or", "implies"):
        left, right = direct(("not", parts[0]) if word == "implies" else parts[0], run), direct(parts[1], run)
        choose = min if word == "and" else max
        return [tuple(map(choose, *pair)) for pair in zip(left, right, strict=True)]
    if word in ("rise", "fall"):
        now = direct(parts[0] if word == "rise" else ("not", parts[0]), run)
        before = [(-math.inf, -math.inf), *now[:-1]]
        return [(min(a, -d), min(b, -c)) for (a, b), (c, d) in zip(now, before, strict=True)]
    operands = [direct(part, run) for part in parts[1:]]
    return [_at(word, parts[0], operands, k, run) for k in range(run.points)]


def _at(word, interval, operands, k, run):
    (low, high), time, past = interval, run.time, word in PAST
    near, far = (time[k] - high, time[k] - low) if past else (time[k] + low, time[k] + high)
    sides = range(k + 1) if past else range(k, len(time))
    window = [j for j in sides if near - FORGIVEN <= time[j] <= far + FORGIVEN]
    beyond = not past and (far > time[-1] + FORGIVEN if high < math.inf else not run.completed)
    gap = not window and not beyond and not (past and far < time[0] - FORGIVEN)
    if word in ("always", "historically"):
        worst = [min((operands[0][j][s] for j in window), default=math.inf) for s in (0, 1)]
        return (-math.inf if beyond or gap else worst[0], worst[1])
    if word in ("eventually", "once"):
        best = [max((operands[0][j][s] for j in window), default=-math.inf) for s in (0, 1)]
        return (best[0], math.inf if beyond or gap else best[1])
    held, then = operands

    def until_then(s, j):
        between = range(j + 1, k + 1) if past else range(k, j)
        return min((held[i][s] for i in between), default=math.inf)

    best = [max((min(then[j][s], until_then(s, j)) for j in window), default=-math.inf) for s in (0, 1)]
    if beyond:
        return best[0], max(best[1], until_then(1, len(time)))
    if gap and past:
        return -math.inf, until_then(1, max(j for j in sides if time[j] <= far + FORGIVEN))
    if gap:
        return -math.inf, until_then(1, min((j for j in sides if time[j] >= near), default=len(time)))
    return tuple(best)


def written(formula):
    """The text of a formula."""
    word, *parts = formula
    if word == "signal":
        return f"({parts[0]} >= {parts[1]!r})"
    if word in ("not", "rise", "fall"):
        return f"({word} {written(parts[0])})" if word == "not" else f"{word}({written(parts[0])})"
    if word in ("and", "or", "implies"):
        return f"({written(parts[0])} {word} {written(parts[1])})"
    interval = f"{word}[{parts[0][0]}, {parts[0][1]}]"
    if len(parts) == 3:
        return f"({written(parts[1])} {interval} {written(parts[2])})"
    return f"({interval} {written(parts[1])})"


WORDS = "not and or implies rise fall always always eventually eventually once historically until until since since"


def drawn(source, depth, bounds=(0, 0.5, 1, 2.5, 0.3), lengths=(0, 0.5, 1, 3, 0.1), endless=0.25):
    """A random formula, nested so deep at most."""
    if not depth or source.random() < 0.15:
        return "signal", f"s.{source.choice('xyz')}", round(source.uniform(-2, 2), 2)
    word = source.choice(WORDS.split())
    count = 2 if word in ("and", "or", "implies", "until", "since") else 1
    operands = [drawn(source, depth - 1, bounds, lengths, endless) for _ in range(count)]
    if word in ("not", "and", "or", "implies", "rise", "fall"):
        return word, *operands
    low = source.choice(bounds)
    return word, (low, math.inf if source.random() < endless else low + source.choice(lengths)), *operands


def drawn_run(source, count, *, even=False, completed=True):
    """A random run of three signals; its steps may differ."""
    steps = [STEP if even else source.choice([STEP, STEP, 0.25, 0.1, 0.7]) for _ in range(count - 1)]
    columns = {f"s.{name}": [source.randrange(-12, 13) / 4 for _ in range(count)] for name in "xyz"}
    return made(np.cumsum([0.0, *steps]), columns, completed=completed)


@pytest.fixture
def logic():
    """What tests of formulas share."""
    return SimpleNamespace(made=made, direct=direct, written=written, drawn=drawn, drawn_run=drawn_run)


@pytest.fixture(params=range(60))
def case(request, monkeypatch):
    """A random formula with its text and a run, which is looked at in blocks of some size."""
    source = random.Random(request.param)
    monkeypatch.setattr(signals, "BLOCK", source.choice([3, 4, 8192]))
    run = drawn_run(source, source.randrange(1, 20), even=source.random() < 0.5, completed=source.random() < 0.7)
    formula = drawn(source, source.randrange(1, 4))
    return formula, written(formula), run
