"""The face of an algorithm: a class in one file is all that a new one takes."""

import math

import numpy as np
import pytest
from railcosim.orchestrator import ScenarioError, System, run
from railcosim.orchestrator.cli.app import call
from railcosim.orchestrator.master import ALGORITHMS
from railcosim.orchestrator.master.algorithms import Batch, Explicit, Fit, Operation, VariableStep
from railcosim.orchestrator.scenario.loading import loads

LAG = """
class Lag(Base):
    u = Input("1", 0.0)
    rate = Parameter("1/s", 1.0)
    x = State("1", 0.0, output=True)

    def derivatives(self):
        return {"x": self.rate * (self.u - self.x)}
"""


@pytest.fixture
def backwards():
    """Gauss-Seidel against the order, as somebody would add it; it is forgotten afterwards."""

    class Backwards(Explicit):
        """Instances step one after the other, the last one first."""

        name = "backwards"
        in_order = True

        @classmethod
        def fit(cls, system, interfaces, wiring):
            notes = ["it goes backwards"]
            problems = ["it is for two"] if len(interfaces) != 2 else []
            return Fit(problems, notes)

        def batches(self):
            whole = (Operation.SET, Operation.STEP, Operation.GET)
            return [Batch(whole, (slave.name,)) for slave in reversed(self.coupling.sequence)]

    yield Backwards
    del ALGORITHMS["backwards"]


@pytest.fixture
def pair(components):
    lag = components(LAG)("Lag")

    def make(algorithm, count=2):
        system = System(stop_time=1.0, step=0.1, algorithm=algorithm)
        for k in range(count):
            system.add(f"lag{k}", lag, x=float(k))
            system.connect(f"lag{(k - 1) % count}.x", f"lag{k}.u")
        return system

    return make


def exact(first):
    """x0' = x1 - x0, x1' = x0 - x1 with inputs held over a step of 0.1 s, the first one stepping on old values."""
    x = [0.0, 1.0]
    rows = [list(x)]
    for _ in range(10):
        for k in (first, 1 - first):
            x[k] = x[1 - k] + (x[k] - x[1 - k]) * math.exp(-0.1)
        rows.append(list(x))
    return np.array(rows)


@pytest.mark.parametrize("kind", ["native", "plain"])
def test_a_fifth_algorithm_runs_in_both_loops(pair, backwards, kind):
    """Against the recursion by hand: the compiled loop (native) and the one in Python (plain) take its operations."""
    forwards, back = run(pair("gauss-seidel"), kind=kind), run(pair("backwards"), kind=kind)
    assert forwards["lag0.x"].tolist() != back["lag0.x"].tolist()
    order = forwards.checked.order.sequence
    for outcome, first in ((forwards, order[0]), (back, order[1])):
        found = np.column_stack([outcome["lag0.x"], outcome["lag1.x"]])
        assert found == pytest.approx(exact(int(first[-1])), abs=1e-6)  # ten steps of 0.1**5 / 120, Runge-Kutta


def test_what_it_says_of_itself_is_heard(pair, backwards, tmp_path, capsys):
    path = tmp_path / "it.toml"
    model = next(iter(pair("jacobi").instances.values())).model
    path.write_text(
        f"[simulation]\nstop_time = 1.0\nstep = 0.1\nalgorithm = 'backwards'\n"
        f"[instances.lag]\ncomponent = '{model}'\ncount = 2\n"
        f"[connections]\n'lag[1].u' = 'lag[2].x'\n'lag[2].u' = 'lag[1].x'\n"
    )
    assert call(["check", str(path)]) == 0
    said = capsys.readouterr().out
    assert "it goes backwards" in said
    assert "backwards steps in the order" in said
    assert call(["list"]) == 0
    assert "  backwards: Instances step one after the other, the last one first." in capsys.readouterr().out
    assert loads(path.read_text(), str(path)).stepping.algorithm == "backwards"
    with pytest.raises(ScenarioError, match="it is for two"):
        run(pair("backwards", 3), kind="plain")


def test_every_algorithm_says_what_it_is():
    for name, algorithm in ALGORITHMS.items():
        assert algorithm.name == name
        assert algorithm.summary().endswith(".")
        assert not getattr(algorithm, "__abstractmethods__", None), f"{name} is abstract"
        assert not algorithm.__subclasses__(), f"{name} is not final"
        assert algorithm.varies_step == issubclass(algorithm, VariableStep)


def test_an_unknown_algorithm_is_an_error_of_the_system(pair):
    with pytest.raises(ScenarioError, match="algorithm 'gaus-seidel' is unknown; did you mean 'gauss-seidel'"):
        run(pair("gaus-seidel"), kind="plain")
