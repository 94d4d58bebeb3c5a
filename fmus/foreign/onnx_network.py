"""Networks in ONNX files: dense layers in a row, read without anything that runs them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .quantities import ForeignError

_ACTIVATIONS: Mapping[str, tuple[str, float | None]] = {
    "Relu": ("relu", None),
    "LeakyRelu": ("leaky_relu", 0.01),
    "Elu": ("elu", 1.0),
    "Softplus": ("softplus", None),
    "Sigmoid": ("sigmoid", None),
    "Tanh": ("tanh", None),
}
"""What ONNX calls them, the names here, and the only factor ``alpha`` that is known."""
_SAME = ("Identity", "Dropout", "Flatten")
"""Operations that leave a row of values as it is, when a network is used."""
_READ = "dense layers in a row are read: Gemm, MatMul, Add, and " + ", ".join(_ACTIVATIONS)

Array = NDArray[np.float64]


def read(content: bytes) -> dict[str, Any]:
    """The layers of a model, for `Network.read`.

    Args:
        content: of the file.

    Raises:
        ForeignError: it is no ONNX model, or more than dense layers in a row; or ``onnx`` is not installed.
    """
    try:
        import onnx
        from google.protobuf.message import DecodeError  # noqa: PLC0415
    except ImportError:
        raise ForeignError("an ONNX model needs onnx, which is not installed: pip install 'railcosim[onnx]'") from None
    try:
        graph = onnx.load_model_from_string(content).graph
    except DecodeError:
        raise ForeignError("it is no ONNX model") from None
    constants = {tensor.name: onnx.numpy_helper.to_array(tensor) for tensor in graph.initializer}
    inputs = [value.name for value in graph.input if value.name not in constants]
    if len(inputs) != 1 or len(graph.output) != 1:
        raise ForeignError(f"a network has one input and one output, not {len(inputs)} and {len(graph.output)}")
    chain = _Chain(inputs[0], constants)
    for node in graph.node:
        given = {each.name: onnx.helper.get_attribute_value(each) for each in node.attribute}
        if node.op_type == "Constant" and "value" in given:
            constants[node.output[0]] = onnx.numpy_helper.to_array(given["value"])
        else:
            chain.take(node.op_type, list(node.input), node.output[0], given)
    if graph.output[0].name != chain.value or not chain.layers:
        raise ForeignError(f"its output is not that of its last layer; {_READ}")
    return {"layers": [{**layer, **{k: layer[k].tolist() for k in ("weights", "bias")}} for layer in chain.layers]}


class _Chain:
    """Layers so far, and the name of the value that the last one gives."""

    def __init__(self, value: str, constants: Mapping[str, NDArray[Any]]) -> None:
        self.value = value
        self.layers: list[dict[str, Any]] = []
        self._constants = constants

    def take(self, operation: str, inputs: list[str], output: str, given: Mapping[str, Any]) -> None:
        """Go on by an operation."""
        variable = [name for name in inputs if name and name not in self._constants]
        constant = [np.array(self._constants[name], dtype=float) for name in inputs if name in self._constants]
        if variable != [self.value]:
            raise ForeignError(f"{operation} of {', '.join(map(repr, inputs))} is not in a row; {_READ}")
        last = self.layers[-1] if self.layers else None
        linear = last is not None and last["activation"] == "linear"
        if operation == "Gemm" and constant and inputs[0] == self.value:
            self._dense(*_gemm(constant, given))
        elif operation == "MatMul" and constant and inputs[0] == self.value:
            self._dense(constant[0].T, None)
        elif operation == "Add" and last and linear:
            last["bias"] = last["bias"] + constant[0].ravel()
        elif operation in _ACTIVATIONS and last and linear:
            name, alpha = _ACTIVATIONS[operation]
            if alpha is not None and abs(given.get("alpha", alpha) - alpha) > 1e-7:
                raise ForeignError(f"{operation} has alpha {given['alpha']:g}; only {alpha:g} is read")
            last["activation"] = name
        elif operation not in _SAME:
            raise ForeignError(f"{operation} is not read here; {_READ}")
        self.value = output

    def _dense(self, weights: Array, bias: Array | None) -> None:
        bias = np.zeros(len(weights)) if bias is None else bias
        self.layers.append({"weights": weights, "bias": bias, "activation": "linear"})


def _gemm(constant: list[Array], given: Mapping[str, Any]) -> tuple[Array, Array | None]:
    """Weights and bias of alpha x W + beta b."""
    if given.get("transA", 0):
        raise ForeignError(f"Gemm has transA; {_READ}")
    weights = constant[0] if given.get("transB", 0) else constant[0].T
    bias = constant[1] * given.get("beta", 1.0) if len(constant) > 1 else None
    weights = weights * given.get("alpha", 1.0)
    return weights, None if bias is None else np.broadcast_to(bias.ravel(), len(weights)).copy()
