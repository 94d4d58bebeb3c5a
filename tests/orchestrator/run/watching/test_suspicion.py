"""Whoever is not suspected of growing does not: the quick look and the thorough one agree."""

from types import SimpleNamespace

import numpy as np
import pytest
from railcosim.orchestrator.master import compiled
from railcosim.orchestrator.names import SignalName
from railcosim.orchestrator.run.watching import divergence
from railcosim.orchestrator.run.watching.divergence import Suspicion, find_growth
from railcosim.orchestrator.run.watching.swings import find_swings

SIZE = 2.0
TIME = 0.1 * np.arange(400)


def suspicion(count):
    """Signals of one size."""
    face = SimpleNamespace(variables={f"x[{k}]": SimpleNamespace(nominal=-SIZE) for k in range(count)})
    return Suspicion([SignalName("a", f"x[{k}]") for k in range(count)], {"a": face})


def waves():
    """Signals that grow, calm down, rest and begin to grow, at any pace, in steps and with noise."""
    draw = np.random.default_rng(7)
    for _ in range(300):
        pace, frequency, size = draw.uniform(-0.6, 0.9), draw.uniform(0.5, 30.0), 10.0 ** draw.uniform(-9.0, 3.0)
        begin, noise = draw.uniform(0.0, 30.0), 10.0 ** draw.uniform(-16.0, 1.0) * draw.normal(size=len(TIME))
        wave = size * np.exp(pace * np.maximum(TIME - begin, 0.0)) * np.sin(frequency * TIME) + noise
        yield np.repeat(wave[::4], 4) if draw.random() < 0.3 else wave


@pytest.mark.skipif(compiled.kernel is None, reason="installed without the compiled step loop")
def test_nobody_who_grows_goes_unsuspected():
    signals = list(waves())
    watched = suspicion(len(signals))
    for begin in range(0, len(TIME), 57):
        for number, values in enumerate(signals):
            watched.see(number, values[begin : begin + 57])
    found = set(watched.suspects())
    growing = {
        f"a.x[{k}]"
        for k, values in enumerate(signals)
        for first in (0, 31)  # the thorough look begins where it likes
        if find_swings(values[first:], SIZE)
        or find_growth(TIME[first:], values[first:], 0.1, size=SIZE)
        or find_growth(TIME[first:], values[first:], 0.1, size=SIZE, failed=True)
    }
    assert growing <= found
    assert len(growing) > 50
    assert len(found) < len(signals) - 50, "most of the others are told from them"


def test_without_the_kernel_all_are_suspected(monkeypatch):
    monkeypatch.setattr(compiled, "HAS_KERNEL", False)
    monkeypatch.setattr(divergence, "HAS_KERNEL", False)
    watched = suspicion(2)
    watched.see(0, np.zeros(3))
    assert watched.suspects() == ["a.x[0]", "a.x[1]"]
