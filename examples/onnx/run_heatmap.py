"""Finds the joints of the person in a box, by an exported net. It needs numpy and onnxruntime, and nothing else.

python run_heatmap.py NET.onnx DEPTH.npy FX FY CX CY LEFT TOP RIGHT BOTTOM

DEPTH.npy holds (height, width) uint16 [mm], 0 = nothing. It prints each joint's place in the camera's frame [m].
"""

import json
import math
import sys

import numpy as np
import onnxruntime

net, depth = onnxruntime.InferenceSession(sys.argv[1], providers=["CPUExecutionProvider"]), np.load(sys.argv[2])
fx, fy, cx, cy, left, top, right, bottom = map(float, sys.argv[3:11])
told = net.get_modelmeta().custom_metadata_map
view, config, joints = (json.loads(told[name]) for name in ("view", "config", "joints"))


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
ats = [np.floor(at * f + middle + 0.5).astype(int) for at, f, middle in zip(steps, (fy, fx), (v, u), strict=True)]
is_inside = ((ats[0] >= 0) & (ats[0] < len(depth)))[:, None] & (ats[1] >= 0) & (ats[1] < depth.shape[1])
patch = depth[ats[0].clip(0, len(depth) - 1)][:, ats[1].clip(0, depth.shape[1] - 1)] * is_inside
value = ((patch.astype(float) - round(1e3 * z)) / 1e3 / view["reach_m"]).clip(-1, 1) * (patch > 0)
heat, offset, _ = net.run(
    ["heat", "depth", "state"], {"images": np.stack([value, patch > 0])[None].astype(np.float32)}
)
share = (
    np.maximum(heat[0], 1e-9)
    if config["heat_cost"] == "mse"
    else np.exp(heat[0] - heat[0].max(axis=(1, 2), keepdims=True))
)
share /= share.sum(axis=(1, 2), keepdims=True)
rows, columns = np.mgrid[: share.shape[1], : share.shape[2]]
around = np.pad(share, ((0, 0), (1, 1), (1, 1)))  # the neighbourhood of 3x3 cells that holds most heat
held = sum(around[:, r : r + share.shape[1], c : c + share.shape[2]] for r in range(3) for c in range(3))
for name, of_joint, far, best in zip(
    joints, share, offset[0], held.reshape(len(held), -1).argmax(axis=1), strict=True
):
    row, column = row_0, column_0 = divmod(int(best), share.shape[2])
    near = (abs(rows - row_0) <= 2) & (abs(columns - column_0) <= 2)
    for _ in range(3):  # the mean under a bell about itself
        weight = of_joint * near * np.exp(-0.5 * ((rows - row) ** 2 + (columns - column) ** 2) / 0.9**2)
        row, column, depth_m = ((weight * of).sum() / weight.sum() for of in (rows, columns, far))
    y, x = ((4 * at + 1.5 - (n - 1) / 2) * view["pixel_m"] / z for at, n in zip((row, column), size, strict=True))
    there = z + depth_m
    place = (u - cx + x * fx) / fx * there, (v - cy + y * fy) / fy * there, there
    print(json.dumps({"joint": name, "xyz": [round(float(value), 4) for value in place]}))
