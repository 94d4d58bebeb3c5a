"""What an equation returns is checked, and what it raises passes."""

import math
from pathlib import Path

import numpy as np
import pytest
from railcosim.components import (
    Component,
    Input,
    Memory,
    Output,
    State,
    Tape,
    simulate,
)

# ---------------------------------------------------------------- values and messages

MISSING = object()


class Faulty(Component):
    """Returns what a test puts in."""

    u = Input("1", 0.0)
    x = State("1", 0.0)
    v = State("1", 0.0, shape=(2,))
    m = Memory("1", 0.0)
    n = Memory("1", 0, type=int)
    f = Memory("1", False)
    y = Output("1")
    t = Output("1", str)
    wrong: dict = {}  # noqa: RUF012

    def _give(self, method, good):
        wrong = self.wrong.get(method, {})
        return {k: v for k, v in {**good, **wrong}.items() if v is not MISSING} if isinstance(wrong, dict) else wrong

    def initial(self):
        return self._give("initial", {})

    def derivatives(self):
        return self._give("derivatives", {"x": 0.0, "v": [0.0, 0.0]})

    def outputs(self):
        return self._give("outputs", {"y": 0.0, "t": "fine"})

    def update(self):
        return self._give("update", {"m": 0.0, "n": 0, "f": False})


@pytest.mark.parametrize(
    ("method", "wrong", "expected"),
    [
        ("outputs", {"z": 1.0}, "Faulty.outputs returns ['z']; it may return ['t', 'y']"),
        ("outputs", {"y": MISSING}, "Faulty.outputs returns no value of ['y']"),
        ("outputs", {"y": np.nan}, "Faulty.outputs: 'y' is nan at t = 0.0 s; guard the arguments it comes from"),
        ("outputs", {"y": np.float64("inf")}, "Faulty.outputs: 'y' is inf at t = 0.0 s"),
        ("outputs", {"y": np.zeros(2)}, "Faulty.outputs: 'y' has shape (2,), declared ()"),
        ("outputs", {"y": True}, "Faulty.outputs: 'y' is declared float, not True"),
        ("outputs", {"t": 1.0}, "Faulty.outputs: 't' is declared str, not 1.0"),
        ("outputs", None, "Faulty.outputs returns None; it must return a dict"),
        ("outputs", [1.0], "Faulty.outputs returns [1.0]; it must return a dict"),
        ("initial", {"y": 1.0}, "Faulty.initial returns ['y']; it may return ['f', 'm', 'n', 'v', 'x']"),
        ("initial", {"v": [1.0]}, "Faulty.initial: 'v' has shape (1,), declared (2,)"),
        ("update", {"y": 1.0}, "Faulty.update returns ['y']; it may return ['f', 'm', 'n', 'v', 'x']"),
        ("update", {"m": MISSING}, "Faulty.update returns no value of ['m']"),
        ("update", {"n": 1.5}, "Faulty.update: 'n' is declared int, not 1.5"),
        ("update", {"n": True}, "Faulty.update: 'n' is declared int, not True"),
        ("update", {"n": math.inf}, "Faulty.update: 'n' is declared int, not inf"),
        ("update", {"f": 1.0}, "Faulty.update: 'f' is declared bool, not 1.0"),
        ("update", {"v": 1.0}, "Faulty.update: 'v' has shape (), declared (2,)"),
        ("update", {"v": [1.0, np.nan]}, "Faulty.update: 'v' is [1.0, nan] at t = 0.0 s"),
        ("update", None, "Faulty.update returns None; it must return a dict"),
        ("derivatives", {"x": MISSING}, "Faulty.derivatives returns no value of ['x']"),
        ("derivatives", {"m": 1.0}, "Faulty.derivatives returns ['m']; it may return ['v', 'x']"),
        ("derivatives", {"x": np.nan}, "Faulty.derivatives: 'x' is nan at t = 0.1 s"),
        ("derivatives", {"x": np.zeros(2)}, "Faulty.derivatives: 'x' has shape (2,), declared ()"),
        ("derivatives", {"v": 1.0}, "Faulty.derivatives: 'v' has shape (), declared (2,)"),
        ("derivatives", {"v": [1.0, 2.0, 3.0]}, "Faulty.derivatives: 'v' has shape (3,), declared (2,)"),
        ("derivatives", None, "Faulty.derivatives returns None; it must return a dict"),
    ],
)
def test_what_an_equation_returns_is_checked(monkeypatch, method, wrong, expected, *, running, refusal):
    def run():
        simulation = running(Faulty())
        simulation.get("y")
        monkeypatch.setattr(Faulty, "wrong", {method: wrong})
        simulation.reset()
        simulation.initialize()
        simulation.start()
        simulation.get("y")
        simulation.step(0.1)

    assert refusal(run).startswith(expected)


def test_a_whole_real_number_may_stand_for_an_integer(monkeypatch, running):
    monkeypatch.setattr(Faulty, "wrong", {"update": {"n": 2.0, "m": 3, "f": np.bool_(True)}})
    simulation = running(Faulty())
    simulation.step(0.1)
    assert (simulation.get("n"), simulation.get("m"), simulation.get("f")) == (2, 3.0, True)
    assert [type(simulation.get(k)) for k in "nmf"] == [int, float, bool]


class OffTape(Component):
    trip = Input("1", 1, type=int)
    trip_time = Input("s")
    row = Tape("1", 0.0, shape=(3,))
    given: object = None

    def update(self):
        return {} if self.given is None else {"row": self.given}


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        (None, "OffTape.update returns no value of ['row']"),
        (np.zeros(1), "OffTape.update: 'row' has shape (1,), declared (3,)"),
        (1.0, "OffTape.update: 'row' has shape (), declared (3,)"),
        ([0.0, 0.0, np.nan], "OffTape.update: 'row' is [0.0, 0.0, nan] at t = 0.0 s"),
    ],
)
def test_a_tape_row_is_checked_too(monkeypatch, given, expected, running, refusal):
    monkeypatch.setattr(OffTape, "given", given)
    assert refusal(lambda: running(OffTape(sample_time=0.1)).step(0.1)).startswith(expected)


def test_the_step_is_known_in_update_only(running, refusal):
    class Nosy(Component):
        m = Memory("s", 0.0)
        y = Output("s")

        def outputs(self):
            return {"y": self.step}

        def update(self):
            return {"m": self.step}

    assert "Nosy: self.step is known only inside update()" in refusal(lambda: running(Nosy()).step(0.1))


def test_the_step_is_forgotten_after_update(samples, running, refusal):
    simulation = running(samples.Counter())
    simulation.step(0.1)
    assert refusal(lambda: simulation.component.step) == "Counter: self.step is known only inside update()"


def test_an_exception_in_an_equation_passes_with_its_own_line(running):
    class Divides(Component):
        u = Input("1", 0.0)
        y = Output("1")

        def outputs(self):
            return {"y": 1.0 / self.u}

    with pytest.raises(ZeroDivisionError) as caught:
        running(Divides()).get("y")
    assert caught.traceback[-1].path.name == Path(__file__).name


def test_equations_that_take_plain_numbers_hold_all_their_outputs():
    class PlainNumbers(Component):
        """Cannot be traced; held outputs are the safe reading."""

        u = Input("1", 0.0)
        m = Memory("1", 0.0, output=True)
        y = Output("1")

        def outputs(self):
            return {"y": math.sin(self.m)}

        def update(self):
            return {"m": self.m + 1.0 if self.u > 0.0 else self.m}

    result = simulate(PlainNumbers(), 0.2, 0.1, {"u": 1.0})
    assert result["m"].tolist() == [0.0, 1.0, 2.0]
    assert result["y"].tolist() == [0.0, 0.0, math.sin(1.0)]
