"""Policies as ONNX models."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

try:
    import onnx
except ModuleNotFoundError as error:
    MESSAGE = "onnx is not installed, which to_onnx() needs: pip install onnx"
    raise ModuleNotFoundError(MESSAGE, name="onnx") from error

from .spaces import PARTS

if TYPE_CHECKING:
    import os

    from .weights import Weights

#: Versions of 2020, which all runtimes read.
OPSET, IR_VERSION = 13, 7


def write(weights: Weights, lengths: dict[str, int], path: str | os.PathLike[str]) -> None:
    """Write a model that takes the parts of observations, which have these lengths."""
    nodes: list[Any] = []
    constants: list[Any] = []

    def node(kind: str, *inputs: Any, **attributes: Any) -> str:
        """Add an operation on results by their names, or on arrays."""
        names = list(inputs)
        for at, value in enumerate(inputs):
            if not isinstance(value, str):
                names[at] = f"constant_{len(constants)}"
                constants.append(onnx.numpy_helper.from_array(value, names[at]))
        name = f"{kind.lower()}_{len(nodes)}"
        nodes.append(onnx.helper.make_node(kind, names, [name], **attributes))
        return name

    relative = "relative_goal" in weights["inputs"]
    given = {"relative_goal": node("Sub", "desired_goal", "achieved_goal")} if relative else {}
    values = node("Concat", *(given.get(name, name) for name in weights["inputs"]), axis=-1)
    values = node("Div", node("Sub", values, weights["mean"]), weights["std"])
    values = node("Min", node("Max", values, -weights["clip"]), weights["clip"])
    values = node("Cast", values, to=onnx.TensorProto.FLOAT)
    for number, (weight, bias) in enumerate(weights["layers"]):
        values = node("Relu", values) if number else values
        values = node("Gemm", values, weight, bias)
    nodes.append(onnx.helper.make_node("Tanh", [values], ["action"]))

    def rows(name: str, kind: int, length: int) -> Any:
        return onnx.helper.make_tensor_value_info(name, kind, ["rows", length])

    inputs = [rows(name, onnx.TensorProto.DOUBLE, lengths[name]) for name in PARTS]
    outputs = [rows("action", onnx.TensorProto.FLOAT, len(bias))]
    graph = onnx.helper.make_graph(nodes, "policy", inputs, outputs, constants)
    operators = [onnx.helper.make_opsetid("", OPSET)]
    model = onnx.helper.make_model(graph, opset_imports=operators, ir_version=IR_VERSION)
    onnx.checker.check_model(model)
    onnx.save(model, path)
