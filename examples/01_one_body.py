"""Draws a person, poses them and writes the body as URDF with meshes, which any URDF tool opens.

python examples/01_one_body.py [FOLDER]
"""

import sys
from pathlib import Path

import numpy as np

from synth import (
    JOINT_NAMES,
    draw_arms,
    draw_base,
    joint_positions,
    make_body,
    posed_mesh,
    sample_body,
    write_urdf,
)

out = Path(sys.argv[1] if len(sys.argv) > 1 else "out/example_body")
rng = np.random.default_rng(7)

body = make_body(sample_body(rng))
pose = None
while pose is None:
    pose = draw_arms("hands_on_hips", body, draw_base("hands_on_hips", body, rng), rng)

skin = posed_mesh(body, pose)
print(
    f"{body.spec.stature:.2f} m, {body.spec.mass:.0f} kg: {len(skin.vertices)} vertices, {len(skin.faces)} faces"
)
for name, (x, y, z) in zip(JOINT_NAMES, joint_positions(body.skeleton, pose), strict=True):
    print(f"{name:12} {x:6.2f} {y:6.2f} {z:6.2f} m")
print(f"URDF: {write_urdf(body, out)}")
