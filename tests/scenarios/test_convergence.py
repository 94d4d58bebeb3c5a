"""The co-simulation converges to the monolithic SciPy solution of the closed loop as the step shrinks, first order.

A force that is held over a step acts, on average, half a step late; with Jacobi it comes one step later still: one and
a half steps, three times the error. Reference: `reference.py` (DOP853, paper's kilometres, by hand).
"""

import runpy
from pathlib import Path

import numpy as np
import pytest

case = runpy.run_path(str(Path(__file__).with_name("comfort_system.py")))
STEPS = (1.0, 0.5, 0.25)
CASES = pytest.mark.parametrize(
    "law",
    [pytest.param({"comfort": True, "gust": 0.5}, marks=pytest.mark.long), {"comfort": False, "gust": 0.0}],
    ids=["tanh with gust", "bottom layer"],
)


@CASES
@pytest.mark.long
def test_first_order_and_jacobi_three_times_gauss_seidel(deviation, law):
    found = {
        algorithm: [deviation(step=h, algorithm=algorithm, **law) for h in STEPS]
        for algorithm in ("gauss-seidel", "jacobi")
    }
    for quantity in (0, 1):  # speeds, gaps
        errors = {algorithm: [row[quantity] for row in rows] for algorithm, rows in found.items()}
        for coarse, fine in [(rows[k], rows[k + 1]) for rows in errors.values() for k in (0, 1)]:
            assert coarse / fine == pytest.approx(2.0, abs=0.15)
        for gauss_seidel, jacobi in zip(errors["gauss-seidel"], errors["jacobi"], strict=True):
            assert 2.8 < jacobi / gauss_seidel < 3.2


@pytest.mark.long
def test_it_is_the_reference_that_it_converges_to(reference):
    """Twice the fine run less the coarse one (Richardson) leaves an error of second order, far below either's."""
    ends = {}
    for h in (0.5, 0.25):
        result = case["run"](case["comfort_system"](reference, step=h, stop=60.0), kind="plain")
        ends[h] = np.array([result[f"train[{i}].position"][-1] for i in range(1, 5)])
    exact = reference.closed_loop(stop=60.0, interval=0.5).x[-1]
    assert np.abs(ends[0.25] - exact).max() > 1.0
    assert np.abs(2.0 * ends[0.25] - ends[0.5] - exact).max() < 0.02


@pytest.mark.long
def test_python_fmus_converge_alike(deviation):
    """Bit-equal to the components in this process, so one pair of steps is enough."""
    stop = 120.0
    errors = [deviation(step=h, stop=stop, kind="python") for h in (0.5, 0.25)]
    assert errors == [deviation(step=h, stop=stop, kind="plain") for h in (0.5, 0.25)]
    assert errors[0][0] / errors[1][0] == pytest.approx(2.0, abs=0.1)
    assert errors[0][1] / errors[1][1] == pytest.approx(2.0, abs=0.1)
