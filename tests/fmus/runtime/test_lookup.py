"""lookup.c: what is found in tables, and its derivatives."""

import math
from pathlib import Path

import numpy as np
import pytest
from railcosim.components.lookup.network import ACTIVATIONS
from railcosim.fmus.references import resolve
from scipy.interpolate import PchipInterpolator

TABLES = f"{Path(__file__).parents[1] / 'native_samples.py'}:Tables"
TABLE, ACTIVATED = [f"tables[{k}]" for k in range(1, 11)], [f"activations[{k}]" for k in range(1, len(ACTIVATIONS) + 1)]
BREAKPOINTS = [-1.0, 0.0, 0.5, 1.0, 1.5, 2.0, 3.0]


@pytest.fixture
def tables(load):
    return load(TABLES).initialize()


@pytest.mark.parametrize("u", [*BREAKPOINTS, *(math.nextafter(x, -9.0) for x in BREAKPOINTS), -7.0, 0.2, 7.0])
def test_values_are_those_of_python_to_the_bit(tables, u):
    place = {"u": u, "w[1]": 0.7 - u, "w[2]": 0.5 * u}
    for name, value in place.items():
        tables.set(name, value)
    expected = resolve(TABLES)(u=u, w=np.array([0.7 - u, 0.5 * u])).outputs()
    assert [tables.get(name) for name in TABLE] == [float(x) for x in expected["tables"]]
    assert [tables.get(name) for name in ACTIVATED] == [float(x) for x in expected["activations"]]


@pytest.mark.parametrize("u", [-2.0, -0.5, 0.25, 1.25, 2.5, 3.5])
def test_slopes_are_those_of_the_tables(tables, u):
    """Straight: of its interval; smooth: SciPy's; steps: none."""
    tables.set("u", u)
    found = tables.directional(TABLE, ["u"], [2.0])
    inside = -1.0 <= u <= 3.0
    assert found[0] == pytest.approx(2.0 * (2.0 if -1.0 <= u < 0.0 else -2.5 if 0.0 <= u <= 2.0 else 0.0))
    smooth = PchipInterpolator([-1, 0, 2, 3], [1, 3, 3.5, 0]).derivative()(u) if inside else 0.0
    assert found[1] == pytest.approx(2.0 * float(smooth), abs=1e-13)
    assert found[5] == 0.0


def test_the_slope_of_a_surface_is_the_difference_of_its_values(tables):
    def at(u, w):
        return float(resolve(TABLES)(u=u, w=np.array([w, w])).outputs()["tables"][2])

    tables.set("u", 1.1)
    tables.set("w[1]", 0.3)
    (found,) = tables.directional([TABLE[2]], ["u", "w[1]"], [1.0, -2.0])
    assert found == pytest.approx((at(1.1 + 1e-6, 0.3 - 2e-6) - at(1.1 - 1e-6, 0.3 + 2e-6)) / 2e-6, abs=1e-7)


def test_the_slope_of_a_network_is_the_product_of_its_layers_slopes(tables):
    """By the chain rule on NumPy's matrices, and activations by differences."""
    first, last = resolve(TABLES)().network.layers
    w, direction = np.array([0.4, -1.1]), np.array([1.0, 0.5])
    for k in (0, 1):
        tables.set(f"w[{k + 1}]", w[k])
    hidden = np.tanh(first.weights @ w + first.bias)
    slopes = last.weights @ ((1.0 - hidden**2) * (first.weights @ direction))
    rows = last.weights @ hidden
    by_difference = [(f(x + 1e-6) - f(x - 1e-6)) / 2e-6 for f, x in zip(ACTIVATIONS.values(), rows, strict=True)]
    found = tables.directional(ACTIVATED, ["w[1]", "w[2]"], direction.tolist())
    assert found == pytest.approx(np.array(by_difference) * slopes, rel=1e-6, abs=1e-9)
