"""The layers of nets as parts of ONNX graphs."""

from collections.abc import Mapping

import numpy as np

from nets.graph import Graph
from nets.stages import Trunk

BATCH_NORM_EPS = 1e-5
"""torch's default."""


class LayerGraph(Graph):
    """A graph that grows layer by layer."""

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

    def _constants(self, weights: Mapping[str, np.ndarray], name: str) -> list[str]:
        return [self.constant(f"{name}.{part}", weights[f"{name}.{part}"]) for part in ("weight", "bias")]
