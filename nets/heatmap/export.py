"""Heat map nets as graphs in the ONNX format."""

import json

import numpy as np

from forests.records import to_json
from nets.graph import Graph
from nets.heatmap.config import STRIDE
from nets.heatmap.model import HeatmapModel

INPUT = "images"
N_CHANNELS = 2
_DOWN = {"down1": 2, "down2": 2, "down3": 2, "down4": 3}
"""Convolutions at each scale; the first of each has a stride of 2."""


def to_onnx(model: HeatmapModel) -> bytes:
    """The bytes of an .onnx file that puts out what the net does; the same model gives the same bytes.

    The input "images" is (n, 2, height, width) float32 as of orientation nets. The outputs are "heat" and "depth",
    (n, n_joints, height / 2, width / 2), and "state", (n, 2, n_joints); see docs/heatmaps.md. The file's metadata tell
    the settings, the joints and the calibration.

    Args:
        model: A trained net.

    Raises:
        MissingLibraryError: onnx is not installed.
    """
    weights, n_joints, view = model.weights, len(model.joints), model.config.view
    graph = Graph()
    source, scales = INPUT, []
    for name, n_convolutions in _DOWN.items():
        for k in range(n_convolutions):
            source = graph.convolution(source, weights, f"{name}.{k}.0", 1, STRIDE if k == 0 else 1)
        scales.append(source)
    maps = source
    for k, beside in zip((3, 2, 1), reversed(scales[:-1]), strict=True):
        wide = graph.twice(graph.pointwise(maps, weights, f"narrow{k}"))
        maps = graph.convolution(graph.add("Add", [beside, wide]), weights, f"up{k}.0", 1)
    graph.pointwise(maps, weights, "heat", "heat")
    graph.pointwise(maps, weights, "depth", "depth")
    mean = graph.add("ReduceMean", [source], axes=[2, 3], keepdims=0)
    shape = graph.constant("state_shape", np.array([-1, 2, n_joints], np.int64))
    graph.add("Reshape", [graph.linear(mean, weights, "state"), shape], "state")
    for name in ("heat", "depth"):
        graph.output(name, n_joints, view.height // STRIDE, view.width // STRIDE)
    graph.output("state", 2, n_joints)
    calibration = np.where(np.isfinite(model.calibration), model.calibration, 0.0)
    about = {
        "config": json.dumps(to_json(model.config), sort_keys=True),
        "joints": json.dumps(model.joints),
        "calibration": json.dumps(calibration.tolist()),
        "view": json.dumps(view._asdict()),
    }
    return graph.finish(INPUT, (N_CHANNELS, view.height, view.width), about)
