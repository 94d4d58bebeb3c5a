"""Dense networks in ONNX files, against the reference implementation of the standard."""

import sys

import numpy as np
import pytest
from railcosim.components import Component, ComponentError, Data, Input, Network, Output
from railcosim.fmus.foreign import ForeignError, read_data
from railcosim.fmus.references import build_with

onnx = pytest.importorskip("onnx")
reference = pytest.importorskip("onnx.reference")
RANDOM = np.random.default_rng(2)
X = RANDOM.normal(size=(1, 3))
W, B, V, C = (RANDOM.normal(size=shape) for shape in ((4, 3), (4,), (4, 2), (1, 2)))


def node(operation, inputs, output, **attributes):
    return onnx.helper.make_node(operation, inputs, [output], **attributes)


def model(nodes, output="y", given=("x",), **constants):
    """A model as the bytes of its file; its numbers are of double precision."""
    double = onnx.TensorProto.DOUBLE
    values = [onnx.helper.make_tensor_value_info(name, double, None) for name in (*given, output)]
    tensors = [onnx.numpy_helper.from_array(value, name) for name, value in constants.items()]
    graph = onnx.helper.make_graph(nodes, "network", values[:-1], values[-1:], tensors)
    return onnx.helper.make_model(graph).SerializeToString()


def found(content):
    return Network.read(read_data("policy.onnx", content))(X[0])


def expected(content):
    return reference.ReferenceEvaluator(onnx.load_model_from_string(content)).run(None, {"x": X})[0][0]


ACTIVATIONS = ["Relu", "LeakyRelu", "Elu", "Softplus", "Sigmoid", "Tanh", "Identity", "Flatten"]


@pytest.mark.parametrize("activation", ACTIVATIONS)
def test_layers_of_every_form(activation):
    """As PyTorch writes them (Gemm, transposed) and as Keras does (MatMul and Add, a constant inside)."""
    nodes = [
        node("Gemm", ["x", "W", "B"], "h", transB=1),
        node(activation, ["h"], "a"),
        node("Constant", [], "V", value=onnx.numpy_helper.from_array(V)),
        node("MatMul", ["a", "V"], "m"),
        node("Add", ["C", "m"], "y"),
    ]
    content = model(nodes, W=W, B=B, C=C)
    nearness = 1e-8 if activation == "LeakyRelu" else 1e-12  # whose factor they round to single precision
    assert found(content) == pytest.approx(expected(content), rel=nearness)


def test_factors_of_gemm():
    nodes = [node("Gemm", ["x", "W", "B"], "h", alpha=0.5, beta=2.0), node("Gemm", ["h", "V"], "y")]
    content = model(nodes, W=W.T.copy(), B=np.array([0.25]), V=V)
    assert found(content) == pytest.approx(expected(content), rel=1e-12)


LAYER = node("MatMul", ["x", "W"], "h")


@pytest.mark.parametrize(
    ("nodes", "message"),
    [
        ([LAYER, node("Softmax", ["h"], "y")], "Softmax is not read here; dense layers in a row"),
        ([node("Tanh", ["x"], "y")], "Tanh is not read here"),
        ([node("Add", ["x", "C"], "y")], "Add is not read here"),
        ([LAYER, node("Tanh", ["h"], "t"), node("Relu", ["t"], "y")], "Relu is not read here"),
        ([LAYER, node("Add", ["h", "x"], "y")], "Add of 'h', 'x' is not in a row"),
        ([node("MatMul", ["W", "x"], "y")], "MatMul is not read here"),
        ([LAYER, node("Elu", ["h"], "y", alpha=0.5)], "Elu has alpha 0.5; only 1 is read"),
        ([node("Gemm", ["x", "W"], "y", transA=1)], "Gemm has transA"),
        ([LAYER, node("Tanh", ["h"], "z")], "its output is not that of its last layer"),
        ([node("Identity", ["x"], "y")], "its output is not that of its last layer"),
    ],
)
def test_other_networks_are_refused(nodes, message):
    with pytest.raises(ForeignError, match=message):
        read_data("policy.onnx", model(nodes, W=W.T.copy(), C=C))


def test_several_inputs_are_refused():
    with pytest.raises(ForeignError, match="one input and one output, not 2 and 1"):
        read_data("policy.onnx", model([LAYER], given=("x", "z"), W=W.T.copy()))


def test_what_is_no_model_is_told_with_its_file(tmp_path, monkeypatch):
    class Driven(Component):
        """Driven by a network."""

        policy = Data({"layers": [{"weights": [[1.0]]}]}, convert=Network.read)
        u = Input("1")
        y = Output("1")

        def outputs(self):
            return {"y": self.policy([self.u])[0]}

    monkeypatch.chdir(tmp_path)
    (tmp_path / "policy.onnx").write_bytes(b"\xff\xff not one")
    with pytest.raises(ComponentError, match=r"policy: policy\.onnx: it is no ONNX model"):
        build_with(Driven, {"policy": "policy.onnx"})
    monkeypatch.setitem(sys.modules, "onnx", None)
    with pytest.raises(ComponentError, match=r"needs onnx, which is not installed: pip install 'railcosim\[onnx\]'"):
        build_with(Driven, {"policy": "policy.onnx"})
