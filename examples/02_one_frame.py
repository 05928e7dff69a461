"""Draws one labelled frame, applies a sensor's noise and writes both depth images as 16-bit PNG (mm).

python examples/02_one_frame.py [FOLDER]
"""

import sys
from pathlib import Path

import cv2
import numpy as np

from synth import JOINT_NAMES, FrameSource, JointState, SceneConfig, apply_sensor

out = Path(sys.argv[1] if len(sys.argv) > 1 else "out/example_frame")
out.mkdir(parents=True, exist_ok=True)

frame = FrameSource(SceneConfig(camera="kinect_v1_qvga"), seed=3, n_frames=20).frame(4)
noisy = apply_sensor("kinect_v1", frame.depth, frame.camera, np.random.default_rng(0))
cv2.imwrite(str(out / "clean.png"), frame.depth)
cv2.imwrite(str(out / "kinect_v1.png"), noisy)

print(
    f"{frame.info.scene_family} / {frame.info.pose_family}, {frame.info.visible_fraction:.0%} of the person seen"
)
for name, (u, v), state in zip(JOINT_NAMES, frame.joints_2d, frame.joint_state, strict=True):
    print(f"{name:12} u {u:6.1f}  v {v:6.1f}  {JointState(state).name.lower()}")
