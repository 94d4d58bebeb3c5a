"""Dense networks: a trained policy as equations."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import nearest
from ..maths import exp, log, maximum, minimum, product, tanh, where

Array = NDArray[np.float64]

# Each branch of a choice is guarded on its own side, so that all of them have their derivative at 0.
ACTIVATIONS: Mapping[str, Callable[[Any], Any]] = {
    "linear": lambda x: x,
    "relu": lambda x: maximum(x, 0.0),
    "leaky_relu": lambda x: where(x >= 0.0, x, 0.01 * x),
    "elu": lambda x: where(x > 0.0, x, exp(minimum(x, 0.0)) - 1.0),
    "softplus": lambda x: where(x > 0.0, x + log(1.0 + exp(-maximum(x, 0.0))), log(1.0 + exp(minimum(x, 0.0)))),
    "sigmoid": lambda x: 0.5 + 0.5 * tanh(0.5 * x),
    "tanh": tanh,
}
"""By name; those with a factor with its usual one, 0.01 of leaky_relu and 1 of elu."""
_KEYS = ("weights", "bias", "activation")


class Layer(NamedTuple):
    """activation(weights x + bias) of weights (outputs, inputs), bias (outputs,) and the name of an activation."""

    weights: Array
    bias: Array
    activation: str


class Network:
    """Dense layers one after the other. In compiled C a layer is a loop over the table of its weights.

    Attributes:
        layers: from the first to the last.
        inputs: how many values the first takes. outputs: how many the last gives.
    """

    def __init__(self, layers: Sequence[Layer]) -> None:
        self.layers = tuple(layers)
        self.inputs, self.outputs = layers[0].weights.shape[1], len(layers[-1].weights)

    @classmethod
    def read(cls, data: Any) -> Network:
        """A network of JSON data, ``{"layers": [...]}``, each with ``weights``, ``bias``, ``activation``; for `Data`.

        Args:
            data: of a layer its weights as rows, one for each output; its bias, 0 if there is none; its activation,
                ``"linear"`` if there is none.

        Raises:
            ValueError: unusable data; the message names the layer and what is wanted.
        """
        layers = data.get("layers") if isinstance(data, Mapping) else None
        if not isinstance(layers, Sequence) or isinstance(layers, str) or not layers:
            raise ValueError(f"a network has 'layers', at least one, not {data!r}")
        found: list[Layer] = []
        for number, layer in enumerate(layers, 1):
            try:
                found.append(_layer(layer, len(found[-1].bias) if found else None))
            except ValueError as error:
                raise ValueError(f"layer {number}: {error}") from None
        return cls(found)

    def __call__(self, values: Any) -> Any:
        """What the network makes of values, shape (inputs,); shape (outputs,)."""
        for weights, bias, activation in self.layers:
            values = ACTIVATIONS[activation](product(weights, values) + bias)
        return values


def _layer(data: Any, inputs: int | None) -> Layer:
    if not isinstance(data, Mapping) or "weights" not in data:
        raise ValueError(f"a layer has 'weights', and may have a 'bias' and an 'activation', not {data!r}")
    for unknown in sorted(map(str, data.keys() - {*_KEYS})):
        raise ValueError(f"a layer has no {nearest(unknown, list(_KEYS))}")
    weights = _finite("weights", data["weights"])
    if weights.ndim != 2 or not weights.size:
        raise ValueError("'weights' are rows of numbers, one row for each output")
    if inputs not in (None, weights.shape[1]):
        raise ValueError(f"its 'weights' take {weights.shape[1]} values, but the layer before gives {inputs}")
    bias = _finite("bias", data.get("bias", [0.0] * len(weights)))
    if bias.shape != (len(weights),):
        raise ValueError(f"'bias' is a number for each of the {len(weights)} outputs, not of shape {bias.shape}")
    activation = str(data.get("activation", "linear"))
    if activation not in ACTIVATIONS:
        raise ValueError(f"there is no 'activation' {nearest(activation, list(ACTIVATIONS))}")
    return Layer(weights, bias, activation)


def _finite(key: str, given: Any) -> Array:
    try:
        array = np.array(given, dtype=float)
    except (TypeError, ValueError):
        raise ValueError(f"{key!r} are numbers in rows of one length, not {given!r}") from None
    if not np.isfinite(array).all():
        raise ValueError(f"{key!r} are finite numbers")
    return array
