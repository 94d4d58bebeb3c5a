"""noise.c: numbers that are held and the same as in Python, and holds that cannot be."""

from pathlib import Path
from statistics import NormalDist

import pytest
from railcosim.components import Simulation
from railcosim.components.noise import cells
from railcosim.fmus.build import resolve

DICE = f"{Path(__file__).parents[2] / 'components' / 'samples.py'}:Dice"
OK = 0
ERROR = 3


def test_numbers_are_held_and_those_of_python(load):
    """A normal one for 0.1 s, a uniform pair for 0.4 s; to the bit."""
    fmu = load(DICE).initialize(seed=12345)
    python = Simulation(resolve(DICE)(seed=12345))
    python.initialize()
    python.start()
    normal, pairs = [], []
    for _ in range(40):
        normal.append(fmu.get("alone"))
        pairs.append([fmu.get("pair_seen[1]"), fmu.get("pair_seen[2]")])
        assert normal[-1] == python.get("alone")
        assert pairs[-1] == list(python.get("pair_seen"))
        assert fmu.step(0.1) == OK
        python.step(0.1)
    assert len(set(normal)) == 40
    assert [pairs[k] == pairs[k - 1] for k in range(1, 40)] == [k % 4 != 0 for k in range(1, 40)]
    assert all(0.0 <= number < 1.0 for pair in pairs for number in pair)


@pytest.mark.parametrize(
    ("hold", "time", "said"),
    [
        (0.0, 0.0, "hold must be positive"),
        (-1.0, 0.0, "hold must be positive"),
        (1e-300, 1e3, "hold = 1e-300 s is too short"),
    ],
)
def test_a_hold_that_cannot_be_is_an_error(load, hold, time, said):
    fmu = load(DICE).enter(start=time)
    assert fmu.set("hold", hold) == OK
    assert fmu.status_of_get("noisy") == ERROR
    assert said in fmu.said


def test_a_number_far_out(load):
    """One drawn once in 1e12 times: found by scrambling backwards; against the standard library's."""
    index, p = 13532568548595, 1.265765270375141e-12
    fmu = load(DICE).enter(start=float(index))
    assert (fmu.set("hold", 1.0), fmu.set("seed", 1)) == (OK, OK)
    assert fmu.get("alone") == pytest.approx(NormalDist().inv_cdf(p), rel=1e-14)
    assert fmu.get("alone") == cells("normal", 1, 0, index, ())
