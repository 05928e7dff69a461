"""Tells which way the person in a box faces, by an exported net. It needs numpy and onnxruntime, and nothing else.

python run_orientation.py NET.onnx DEPTH.npy FX FY LEFT TOP RIGHT BOTTOM

DEPTH.npy holds (height, width) uint16 [mm], 0 = nothing. NET.onnx is a net for bodies with a biternion output.
"""

import json
import math
import sys

import numpy as np
import onnxruntime

net, depth = onnxruntime.InferenceSession(sys.argv[1], providers=["CPUExecutionProvider"]), np.load(sys.argv[2])
fx, fy, left, top, right, bottom = map(float, sys.argv[3:9])
told = net.get_modelmeta().custom_metadata_map
view, calibration, postures = (json.loads(told[name]) for name in ("view", "calibration", "postures"))


def median_in(left, top, right, bottom):
    """Of what lies in a box [m]."""
    ends = zip((top, left), (bottom, right), depth.shape, strict=True)
    rows, columns = (range(max(0, math.ceil(low)), max(0, min(n, math.ceil(high)))) for low, high, n in ends)
    step = max(1, math.isqrt(len(rows) * len(columns) // 1024))
    inside = depth[rows.start : rows.stop : step, columns.start : columns.stop : step]
    return np.median(inside[inside > 0]) / 1e3


u, z = (left + right) / 2, median_in(left, top, right, bottom)
for _ in range(2):  # the distance is that of the trunk
    z = median_in(u - 0.15 * fx / z, top, u + 0.15 * fx / z + 1, top + 0.6 * fy / z)
v = top + (view["height"] * view["pixel_m"] / 2 - 0.1) * fy / z
size = view["height"], view["width"]
steps = ((np.arange(n) - (n - 1) / 2) * view["pixel_m"] / z for n in size)
rows, columns = (
    np.floor(at * f + middle + 0.5).astype(int) for at, f, middle in zip(steps, (fy, fx), (v, u), strict=True)
)
is_inside = ((rows >= 0) & (rows < len(depth)))[:, None] & (columns >= 0) & (columns < depth.shape[1])
patch = depth[rows.clip(0, len(depth) - 1)][:, columns.clip(0, depth.shape[1] - 1)] * is_inside
value = ((patch.astype(float) - round(1e3 * z)) / 1e3 / view["reach_m"]).clip(-1, 1) * (patch > 0)
images = np.stack([value, patch > 0])[None].astype(np.float32)
angle, log_kappa, logits = net.run(["angle", "log_concentration", "auxiliary"], {"images": images})
heading = np.degrees(np.arctan2(angle[0, 1], angle[0, 0]))
kappa = np.exp(calibration["offset"] + calibration["slope"] * log_kappa[0])
print(json.dumps({"heading": float(heading), "kappa": float(kappa), "posture": postures[int(logits[0].argmax())]}))
