"""Finds the joints of a person by an exported regression forest. It needs numpy and onnxruntime, and nothing else.

python run_forest.py FOREST.onnx DEPTH.npy FX FY CX CY [LEFT TOP RIGHT BOTTOM]

DEPTH.npy holds (height, width) uint16 [mm], 0 = nothing; walls and floor must be removed. In the box pixels may vote.
It prints each joint's place in the camera's frame [m], and the confidence, the area of the surface that agrees [m^2].
"""

import json
import sys

import numpy as np
import onnxruntime

forest, depth = onnxruntime.InferenceSession(sys.argv[1], providers=["CPUExecutionProvider"]), np.load(sys.argv[2])
height, width = depth.shape
inputs = {
    "depth": depth,
    "intrinsics": np.array(sys.argv[3:7], np.float32),
    "box": np.array(sys.argv[7:11] or [0, 0, width, height], np.float32),
}
proposals, confidence = forest.run(["proposals", "confidence"], inputs)
joints = json.loads(forest.get_modelmeta().custom_metadata_map["joints"])
for name, place, of_joint in zip(joints, proposals[:, 0], confidence[:, 0], strict=True):
    xyz = [round(float(value), 4) for value in place] if of_joint > 0 else None
    print(json.dumps({"joint": name, "xyz": xyz, "confidence": round(float(of_joint), 4)}))
