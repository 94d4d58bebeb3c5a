"""Outputs that may show their FMU's inputs: states are watched whatever a list of dependencies says."""

import numpy as np
import pytest
from railcosim.orchestrator.errors import CouplingError, ScenarioError
from railcosim.orchestrator.run.checking import check
from railcosim.orchestrator.run.execution import run
from railcosim.orchestrator.system import System
from scipy.integrate import solve_ivp


def couple(fmu, prey, predator, **how):
    """Two in a loop, each with what a, b, c, d and start are."""
    it = System(**{"stop_time": 10.0, "step": 10.0, "algorithm": "adaptive", "tolerance": 1e-6} | how)
    it.add("prey", fmu, **prey)
    it.add("predator", fmu, **predator)
    it.connect("predator.y", "prey.u")
    it.connect("prey.y", "predator.u")
    return it


PREY, PREDATOR = {"a": 1.0, "b": -0.1, "start": 20.0}, {"a": -0.4, "b": 0.02, "start": 5.0}


@pytest.fixture(scope="module")
def exact():
    """Lotka and Volterra's equations, to 1e-10."""

    def rates(_, z):
        return [z[0] * (1.0 - 0.1 * z[1]), z[1] * (-0.4 + 0.02 * z[0])]

    return solve_ivp(rates, (0.0, 10.0), [20.0, 5.0], rtol=1e-11, atol=1e-11, dense_output=True).sol


@pytest.mark.parametrize(("on", "options"), [(["u"], ()), (None, ("-DHELD",)), ([], ())])
def test_states_are_watched_whatever_is_listed(species, exact, on, options):
    """Step by step the same for a list that is true, for one that names what there is not, and for none."""
    result = run(couple(species(on, *options), PREY, PREDATOR, tolerance=1e-5))
    assert result["prey.y"] == pytest.approx(exact(result.time)[0], rel=3e-3)
    assert result["predator.y"] == pytest.approx(exact(result.time)[1], rel=3e-3)
    assert 500 < result.coupling["adaptive"]["accepted"] < 1500
    assert result.coupling["adaptive"]["jumps"] == 0


def test_the_error_follows_the_tolerance(species, exact):
    errors = []
    for tolerance in (1e-3, 1e-4, 1e-5):
        result = run(couple(species(["u"]), PREY, PREDATOR, tolerance=tolerance))
        errors.append(np.abs(result["prey.y"] - exact(result.time)[0]).max())
    assert errors[0] < 3.0
    assert 1.5 < errors[0] / errors[1] < 8.0  # the square root of ten
    assert 1.5 < errors[1] / errors[2] < 8.0


def test_what_shows_an_input_beside_a_state_is_watched(species):
    """y = x + d u at both ends."""
    p, q = {"a": -1.0, "c": 1.0, "d": 0.2, "start": 1.0}, {"a": -2.0, "c": -3.0, "d": 0.3, "start": 0.0}
    result = run(couple(species(["u"]), p, q, tolerance=1e-5))

    def rates(_, z):
        y, w = np.linalg.solve([[1.0, -0.2], [-0.3, 1.0]], z)  # y = x + 0.2 w, w = x' + 0.3 y
        return [-z[0] + w, -2.0 * z[1] - 3.0 * y]

    true = solve_ivp(rates, (0.0, 10.0), [1.0, 0.0], rtol=1e-10, atol=1e-10, t_eval=result.time).y
    y, w = np.linalg.solve([[1.0, -0.2], [-0.3, 1.0]], true)
    assert result["prey.y"] == pytest.approx(y, abs=0.02)
    assert result["predator.y"] == pytest.approx(w, abs=0.02)
    assert result.coupling["adaptive"]["accepted"] > 100
    assert result.coupling["adaptive"]["jumps"] == 0


def test_where_nothing_shows_a_state_it_is_refused(species, mine):
    """Two amplifiers behind a sine: no step would be too long for them."""
    it = System(stop_time=4.0, step=1.0, algorithm="adaptive")
    it.add("wave", mine("Wave"))
    it.add("a", species(["u"]), d=2.0)
    it.add("b", species(None), d=3.0)
    it.connect("wave.y", "a.u")
    it.connect("a.y", "b.u")
    with pytest.raises(CouplingError) as caught:
        run(it)
    assert "adaptive has nothing to watch: a.y, b.y show the inputs of their FMUs and no state" in str(caught.value)
    it.instances["b"].start.update(a=-1.0, c=1.0)
    assert run(it).coupling["adaptive"]["accepted"] > 4


def test_where_no_output_is_a_continuous_number_it_is_refused_before(species, workspace):
    with pytest.raises(ScenarioError) as caught:
        check(couple(species(["u"], variability="discrete"), {}, {}), workspace)
    told = "predator, prey: adaptive has nothing to watch: they have no continuous Real output; choose gauss-seidel"
    assert told in str(caught.value)


@pytest.mark.long
def test_a_list_that_leaves_an_input_out_is_suspected(species):
    """y shows u at once, and its FMU says that it depends on nothing: no step is short enough."""
    with pytest.raises(CouplingError) as caught:
        run(couple(species([]), PREY | {"d": 1.0}, PREDATOR))
    assert "cannot be kept within its tolerance" in str(caught.value)
    assert str(caught.value).endswith("; or let its FMU list the input, if this output passes one on at once")
