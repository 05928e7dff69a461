"""Graphs in the ONNX format, built layer by layer out of plain arrays; needs onnx, but not torch."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nets.runtime import MissingLibraryError
from nets.stages import Trunk

OPSET = 17
IR_VERSION = 8
"""Old enough for runtimes of 2022."""
BATCH_NORM_EPS = 1e-5
"""torch's default."""


def load_onnx() -> Any:
    """The module onnx.

    Raises:
        MissingLibraryError: It is not installed; says how to get it.
    """
    try:
        import onnx
    except ImportError:
        raise MissingLibraryError(
            "the export needs onnx, which is not installed; install it with: pip install 'undergrowth[nets]'"
        ) from None
    return onnx


class Graph:
    """A graph that grows.

    Attributes:
        outputs: Names and shapes of its outputs.
    """

    def __init__(self) -> None:
        self._onnx = load_onnx()
        self._nodes: list[Any] = []
        self._arrays: dict[str, NDArray[Any]] = {}
        self.outputs: list[tuple[str, tuple[int | str, ...]]] = []

    def add(self, operator: str, inputs: list[str], name: str = "", /, **attributes: Any) -> str:
        """Adds a node with one output and gives the output's name."""
        name = name or f"{operator.lower()}_{len(self._nodes)}"
        self._nodes.append(self._onnx.helper.make_node(operator, inputs, [name], name=name, **attributes))
        return name

    def constant(self, name: str, values: NDArray[Any]) -> str:
        """Adds an array and gives its name."""
        self._arrays[name] = np.ascontiguousarray(values)
        return name

    def convolution(
        self, source: str, weights: Mapping[str, np.ndarray], name: str, padding: int, stride: int = 1
    ) -> str:
        """Adds a convolution, its batch normalisation and ReLU.

        Args:
            source: The input.
            weights: By name; the normalisation's layer has the number after that of the convolution.
            name: Of the convolution, such as "features.0".
            padding: Zeros on each side.
            stride: Pixels from one place to the next.
        """
        stem, _, number = name.rpartition(".")
        after = f"{stem}.{int(number) + 1}"
        # A normalisation with fixed statistics is part of the convolution before it.
        scale = weights[f"{after}.weight"] / np.sqrt(weights[f"{after}.running_var"] + BATCH_NORM_EPS)
        kernel = self.constant(f"{name}.weight", weights[f"{name}.weight"] * scale[:, None, None, None])
        bias = weights[f"{after}.bias"] - weights[f"{after}.running_mean"] * scale
        inputs = [source, kernel, self.constant(f"{name}.bias", bias)]
        size = weights[f"{name}.weight"].shape[2:]
        sides = {"kernel_shape": list(size), "pads": [padding] * 4, "strides": [stride] * 2}
        return self.add("Relu", [self.add("Conv", inputs, **sides)])

    def pointwise(self, source: str, weights: Mapping[str, np.ndarray], name: str, output: str = "") -> str:
        """Adds a convolution of 1x1."""
        return self.add("Conv", [source, *self._constants(weights, name)], output, kernel_shape=[1, 1])

    def twice(self, source: str) -> str:
        """Adds maps of twice the size, each cell repeated."""
        scales = self.constant("twice", np.array([1.0, 1.0, 2.0, 2.0], np.float32))
        how = {"mode": "nearest", "coordinate_transformation_mode": "asymmetric", "nearest_mode": "floor"}
        return self.add("Resize", [source, "", scales], **how)

    def _constants(self, weights: Mapping[str, np.ndarray], name: str) -> list[str]:
        return [self.constant(f"{name}.{part}", weights[f"{name}.{part}"]) for part in ("weight", "bias")]

    def trunk(self, source: str, trunk: Trunk, weights: Mapping[str, np.ndarray], name: str) -> str:
        """Adds the stages of a trunk, whose layers are numbered as `nets.modules.convolutions` numbers them."""
        layer = 0
        for stage in trunk.stages:
            for _ in stage.channels:
                source = self.convolution(source, weights, f"{name}.{layer}", stage.padding)
                layer += 3
            if stage.pool is not None:
                sides = {"kernel_shape": list(stage.pool), "strides": list(stage.pool)}
                source = self.add("MaxPool", [source], ceil_mode=1, **sides)
                layer += 1
        return source

    def linear(self, source: str, weights: Mapping[str, np.ndarray], name: str, output: str = "") -> str:
        """Adds a linear layer."""
        return self.add("Gemm", [source, *self._constants(weights, name)], output, transB=1)

    def output(self, name: str, *shape: int) -> None:
        """Makes a node's output one of the graph, with the shape of one image's."""
        self.outputs.append((name, ("n", *shape)))

    def finish(self, source: str, shape: tuple[int, ...], about: Mapping[str, str]) -> bytes:
        """The file's bytes.

        Args:
            source: Name of the graph's input.
            shape: Of one image.
            about: Texts that the file tells.
        """
        onnx = self._onnx
        helper, float32 = onnx.helper, onnx.TensorProto.FLOAT
        values = [onnx.numpy_helper.from_array(array, name) for name, array in self._arrays.items()]
        graph = helper.make_graph(
            self._nodes,
            "undergrowth",
            [helper.make_tensor_value_info(source, float32, ["n", *shape])],
            [helper.make_tensor_value_info(name, float32, list(of_output)) for name, of_output in self.outputs],
            values,
        )
        model = helper.make_model(
            graph,
            opset_imports=[helper.make_opsetid("", OPSET)],
            producer_name="undergrowth",
            ir_version=IR_VERSION,
        )
        helper.set_model_props(model, dict(about))
        onnx.checker.check_model(model, full_check=True)
        return bytes(model.SerializeToString(deterministic=True))
