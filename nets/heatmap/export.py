"""Heat map nets as graphs in the ONNX format."""

import json

import numpy as np

from forests.records import to_json
from nets.heatmap.config import STATES, STRIDE
from nets.heatmap.model import HeatmapModel
from nets.layers import LayerGraph

INPUT = "images"
N_CHANNELS = 2


def to_onnx(model: HeatmapModel) -> bytes:
    """The bytes of an .onnx file that puts out what the net does; the same model gives the same bytes.

    The input "images" is (n, 2, height, width) float32 as of orientation nets. The outputs are "heat" and "depth",
    (n, n_joints, height / 4, width / 4), and "state", (n, 4, n_joints); see docs/heatmaps.md. The file's metadata tell
    the settings, the joints and the calibration.

    Args:
        model: A trained net.

    Raises:
        MissingLibraryError: onnx is not installed.
    """
    config, n_joints, view = model.config, len(model.joints), model.config.view
    writer = _Writer(model)
    graph, weights = writer.graph, model.weights
    graph.input(INPUT, "n", N_CHANNELS, view.height, view.width)
    one = writer.residuals(writer.block(writer.pieces(INPUT), "stem"), "down1", 0, config.blocks[0])
    scales = [one]
    for k in (2, 3):
        source = writer.block(scales[-1], f"down{k}.0", stride=2)
        scales.append(writer.residuals(source, f"down{k}", 1, config.blocks[k - 1]))
    maps = scales[2]
    for k in (2, 1):
        wide = graph.twice(graph.pointwise(maps, weights, f"narrow{k}"))
        maps = writer.block(graph.add("Add", [scales[k - 1], wide]), f"up{k}")
    graph.pointwise(maps, weights, "heat", "heat")
    graph.pointwise(maps, weights, "depth", "depth")
    mean = graph.add("ReduceMean", [scales[2]], axes=[2, 3], keepdims=0)
    shape = graph.constant("state_shape", np.array([-1, len(STATES), n_joints], np.int64))
    graph.add("Reshape", [graph.linear(mean, weights, "state"), shape], "state")
    for name in ("heat", "depth"):
        graph.output(name, "n", n_joints, view.height // STRIDE, view.width // STRIDE)
    graph.output("state", "n", len(STATES), n_joints)
    calibration = np.where(np.isfinite(model.calibration), model.calibration, 0.0)
    about = {
        "config": json.dumps(to_json(config), sort_keys=True),
        "joints": json.dumps(model.joints),
        "states": json.dumps(STATES),
        "calibration": json.dumps(calibration.tolist()),
        "view": json.dumps(view._asdict()),
    }
    return graph.finish(about)


class _Writer:
    """Writes the parts of `nets.heatmap.network.HeatmapNet`."""

    def __init__(self, model: HeatmapModel) -> None:
        self.graph, self._model = LayerGraph(), model

    def pieces(self, source: str) -> str:
        """Squares of STRIDE x STRIDE pixels as channels, in torch's order: channel, row, column."""
        view, graph = self._model.config.view, self.graph
        rows, columns = view.height // STRIDE, view.width // STRIDE
        parted = np.array([-1, N_CHANNELS, rows, STRIDE, columns, STRIDE], np.int64)
        joined = np.array([-1, N_CHANNELS * STRIDE**2, rows, columns], np.int64)
        cut = graph.add("Reshape", [source, graph.constant("parted", parted)])
        turned = graph.add("Transpose", [cut], perm=[0, 1, 3, 5, 2, 4])
        return graph.add("Reshape", [turned, graph.constant("joined", joined)])

    def block(self, source: str, name: str, stride: int = 1) -> str:
        """A convolution with normalisation and ReLU."""
        size = self._model.weights[f"{name}.0.weight"].shape[2]
        return self.graph.convolution(source, self._model.weights, f"{name}.0", size // 2, stride)

    def residuals(self, source: str, name: str, first: int, count: int) -> str:
        """Residual blocks that are numbered from `first` on."""
        for number in range(first, first + count):
            path, step = source, 0
            while f"{name}.{number}.path.{step}.0.weight" in self._model.weights:
                path = self.block(path, f"{name}.{number}.path.{step}")
                step += 1
            source = self.graph.add("Add", [source, path])
        return source
