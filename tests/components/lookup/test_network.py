"""Dense networks against NumPy's own matrices."""

import math

import numpy as np
import pytest
from railcosim.components import Network
from railcosim.components.lookup.network import ACTIVATIONS

PLACES = [-40.0, -1.5, -1e-9, 0.0, 1e-9, 0.7, 40.0]
FORMULAS = {
    "linear": lambda x: x,
    "relu": lambda x: max(x, 0.0),
    "leaky_relu": lambda x: x if x > 0.0 else 0.01 * x,
    "elu": lambda x: x if x > 0.0 else math.expm1(x),
    "softplus": lambda x: math.log1p(math.exp(x)),
    "sigmoid": lambda x: 1.0 / (1.0 + math.exp(-x)),
    "tanh": math.tanh,
}


def layer(weights, bias=None, **rest):
    return {"weights": weights} | ({} if bias is None else {"bias": bias}) | rest


@pytest.mark.parametrize("name", ACTIVATIONS)
def test_an_activation_is_its_formula(name):
    found = ACTIVATIONS[name](np.array(PLACES))
    assert found.tolist() == pytest.approx([FORMULAS[name](x) for x in PLACES], rel=1e-14, abs=2e-16)
    assert math.isfinite(ACTIVATIONS[name](-1e4))


def test_layers_follow_each_other():
    random = np.random.default_rng(3)
    first, bias, last = random.normal(size=(5, 3)), random.normal(size=5), random.normal(size=(2, 5))
    network = Network.read({"layers": [layer(first.tolist(), bias.tolist(), activation="tanh"), layer(last)]})
    x = random.normal(size=3)
    assert network(x) == pytest.approx(last @ np.tanh(first @ x + bias), rel=1e-13)
    assert (network.inputs, network.outputs) == (3, 2)


def test_a_sum_goes_from_first_to_last():
    """1 + 1e16 - 1e16 is 0 in that order."""
    network = Network.read({"layers": [layer([[1.0, 1e16, -1e16]])]})
    assert network([1.0, 1.0, 1.0]).tolist() == [0.0]


@pytest.mark.parametrize(
    ("data", "message"),
    [
        ([], "a network has 'layers'"),
        ({"layers": "all"}, "a network has 'layers'"),
        ({"layers": []}, "a network has 'layers'"),
        ({"layers": [3]}, "layer 1: a layer has 'weights'"),
        ({"layers": [{"bias": [1]}]}, "layer 1: a layer has 'weights'"),
        ({"layers": [layer([[1.0]], biass=[1])]}, "did you mean 'bias'"),
        ({"layers": [layer([1.0])]}, "one row for each output"),
        ({"layers": [layer([[]])]}, "one row for each output"),
        ({"layers": [layer([[1.0], [1.0, 2.0]])]}, "'weights' are numbers in rows of one length"),
        ({"layers": [layer([[float("inf")]])]}, "'weights' are finite"),
        ({"layers": [layer([[1.0]], [1.0, 2.0])]}, "'bias' is a number for each of the 1 outputs"),
        ({"layers": [layer([[1.0]], activation="rellu")]}, "did you mean 'relu'"),
        ({"layers": [layer([[1.0]], activation=["tanh"])]}, "there is no 'activation'"),
        ({"layers": [layer([[1.0]]), layer([[1.0, 2.0]])]}, "layer 2: its 'weights' take 2 values, but"),
    ],
)
def test_unusable_data_are_refused(data, message):
    with pytest.raises(ValueError, match=message):
        Network.read(data)
