"""Draws a person, poses them and writes the body as URDF with meshes, which any URDF tool opens.

python examples/01_one_body.py [FOLDER]
"""

import sys
from pathlib import Path

import numpy as np

from synth.bodies.poses.draw import draw_arms, draw_base
from synth.bodies.rig.kinematics import joint_positions
from synth.bodies.rig.skinning import posed_mesh
from synth.bodies.rig.urdf import write_urdf
from synth.bodies.shape.make import make_body
from synth.bodies.spec import sample_body
from synth.vocabulary import JOINT_NAMES

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
