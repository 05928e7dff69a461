"""Orientation nets as graphs in the ONNX format."""

import json

import numpy as np

from forests.records import to_json
from nets.layers import LayerGraph
from nets.orientation.architectures import N_CHANNELS, TRUNKS
from nets.orientation.config import POSTURES
from nets.orientation.limits import LEAST_LOG_KAPPA, MOST_LOG_KAPPA, TINY
from nets.orientation.model import OrientationModel

INPUT = "images"


def to_onnx(model: OrientationModel) -> bytes:
    """The bytes of an .onnx file that puts out what the net does; the same model gives the same bytes.

    The input "images" is (n, 2, height, width) float32: depth minus the person's distance, divided by the reach,
    within -1..1 and 0 where nothing is; and 1 where something is. The outputs are "angle", "log_concentration" and
    "auxiliary", see docs/orientation.md. The file's metadata tell the settings.

    Args:
        model: A trained net.

    Raises:
        MissingLibraryError: onnx is not installed.
    """
    config, weights = model.config, model.weights
    trunk = TRUNKS[config.region, config.architecture]
    view, graph = config.view, LayerGraph()
    graph.input(INPUT, "n", N_CHANNELS, view.height, view.width)
    maps = graph.trunk(INPUT, trunk, weights, "features")
    flat = graph.add("Flatten", [maps], axis=1)
    hidden = graph.add("Relu", [graph.linear(flat, weights, "hidden.2")])
    if config.output.startswith("biternion"):
        raw = graph.linear(hidden, weights, "angle")
        axes = graph.constant("axes", np.array([1], np.int64))
        squares = graph.add("ReduceSum", [graph.add("Mul", [raw, raw]), axes], keepdims=1)
        tiny = graph.constant("tiny", np.array(TINY, np.float32))
        length = graph.add("Sqrt", [graph.add("Add", [squares, tiny])])
        graph.add("Div", [raw, length], "angle")
    else:
        graph.linear(hidden, weights, "angle", "angle")
    ends = [
        graph.constant(name, np.array(value, np.float32))
        for name, value in (("least", LEAST_LOG_KAPPA), ("most", MOST_LOG_KAPPA))
    ]
    told = graph.add("Clip", [graph.linear(hidden, weights, "concentration"), *ends])
    graph.add("Squeeze", [told, graph.constant("last", np.array([1], np.int64))], "log_concentration")
    graph.linear(hidden, weights, "auxiliary", "auxiliary")
    graph.output("angle", "n", config.n_angle)
    graph.output("log_concentration", "n")
    graph.output("auxiliary", "n", config.n_auxiliary)
    about = {
        "config": json.dumps(to_json(config), sort_keys=True),
        "calibration": json.dumps(model.calibration._asdict()),
        "postures": json.dumps(POSTURES),
        "view": json.dumps(view._asdict()),
    }
    return graph.finish(about)
