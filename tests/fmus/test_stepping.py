"""A step as one expression: the values that a simulation of the component has, and what cannot be had so."""

import casadi as ca
import numpy as np
import pytest
from railcosim.components import Input, Simulation
from railcosim.components.tracing import TracingError
from railcosim.fmus.native.stepping import Steps
from railcosim.fmus.references import resolve
from railcosim.fmus.variables import scalar_variables

from tests import toys

STEP = 0.1


class Scipy(toys.Lag):
    """One that needs more than C."""

    requires = ("scipy",)


def stepped(component, given):
    """Every real value after a step, of the expression and of a simulation."""
    steps, simulation = Steps(component()), Simulation(component())
    for name, value in given.items():
        simulation.set(name, value)
    point, variables = np.zeros(steps.size), scalar_variables(component())
    for v in variables:
        if v.is_parameter or isinstance(v.slot.declaration, Input):
            point[v.reference] = np.ravel(simulation.get(v.slot.name))[v.element or 0]
    values = ca.SX.sym("values", steps.size)
    start = ca.Function("start", [values], [steps.start(values, 0.0)])
    step = ca.Function("step", [values], [steps.step(values, 0.0, STEP, 2)])
    found = step(start(point)).full().ravel()
    simulation.initialize()
    simulation.start()
    simulation.step(STEP)
    shown = [v for v in variables if not v.is_start]
    wanted = {v.name: float(np.ravel(simulation.get(v.slot.name))[v.element or 0]) for v in shown}
    return {name: found[steps.places[name]] for name in wanted}, wanted


@pytest.mark.parametrize(
    ("component", "given"),
    [
        (toys.Lag, {"u": 3.0, "rate": 2.0, "max_step": STEP / 2}),
        (toys.Resting, {"u": 2.0, "max_step": STEP / 2}),
        (toys.LagWithSlope, {"u": 3.0, "max_step": STEP / 2}),
        (toys.Sampled, {"u": 3.0}),
        (toys.Sampler, {"u": 3.0}),
        (resolve("PointMassTrain"), {"force": 1e5, "speed": 10.0, "max_step": STEP / 2}),
        (toys.LagWithRow, {"max_step": STEP / 2}),
    ],
    ids=["lag", "resting", "slope", "sampled", "sampler", "train", "row"],
)
def test_a_step_gives_the_values_of_a_simulation(component, given):
    found, wanted = stepped(component, given)
    assert found == pytest.approx(wanted, rel=1e-12)


def test_a_train_that_comes_to_rest_within_a_sub_step_stands_at_its_end():
    braking = {"force": -2e5, "speed": 0.02, "starting_resistance": 1.0, "max_step": STEP / 2}
    found, wanted = stepped(resolve("PointMassTrain"), braking)
    assert found["speed"] == wanted["speed"] == 0.0
    assert found["position"] == pytest.approx(wanted["position"], abs=1e-4)
    assert found["position"] != pytest.approx(wanted["position"], abs=1e-9)


@pytest.mark.parametrize(
    ("component", "said"),
    [
        (toys.Noisy, "Noisy draws random numbers"),
        (toys.Repeater, "Repeater keeps a tape"),
        (Scipy, "Scipy imports scipy"),
    ],
    ids=["noise", "tape", "requires"],
)
def test_what_has_no_such_expression_says_why(component, said):
    with pytest.raises(TracingError, match=said):
        Steps(component())
