"""Draws docs/bodies.png: sampled people, shaded, by part and as depth.

python tools/show_bodies.py [--seed 77] [--out docs/bodies.png]
"""

import argparse
from pathlib import Path

import cv2
import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from synth.bodies.body import Pose
from synth.bodies.rig.skinning import posed_mesh
from synth.bodies.shape.make import make_body
from synth.bodies.skeleton import DOF_IDX, N_DOFS
from synth.bodies.spec import sample_body
from synth.camera import Camera
from synth.geometry import LabelledMesh, look_at
from synth.vocabulary import N_PARTS

POSES: tuple[dict[str, float], ...] = (
    {"shoulder_abduction": 8, "elbow_flexion": 12, "hip_abduction": 3},
    {"shoulder_abduction": 20, "elbow_flexion": 95, "shoulder_flexion": 25, "hip_flexion": 90, "knee_flexion": 90},
    {"l_hip_flexion": 30, "r_hip_flexion": -15, "r_knee_flexion": 25, "elbow_flexion": 25, "shoulder_abduction": 6,
     "r_shoulder_flexion": 25, "l_shoulder_flexion": -20},
)  # fmt: skip


def pose_of(degrees: dict[str, float]) -> Pose:
    """A pose by hinge name; names without a side set both."""
    angles = np.zeros(N_DOFS)
    for name, value in degrees.items():
        for full in [name] if name in DOF_IDX else [f"l_{name}", f"r_{name}"]:
            angles[DOF_IDX[full]] = np.radians(value)
    return Pose(angles, np.eye(4))


def pictures(mesh: LabelledMesh, camera: Camera, azimuth: float) -> list[NDArray[np.uint8]]:
    """Shaded, by part, and depth: three (height, width, 3) images."""
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(o3d.core.Tensor(mesh.vertices), o3d.core.Tensor(mesh.faces.astype(np.uint32)))
    target = np.array([0.0, 0.0, -0.05])
    eye = target + 2.6 * np.array([np.cos(azimuth), np.sin(azimuth), 0.12])
    T = look_at(eye, target)
    u, v = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
    d = camera.backproject(np.stack([u, v], axis=-1), np.ones(u.shape)) @ T[:3, :3].T
    rays = np.concatenate([np.broadcast_to(eye, d.shape), d], axis=-1).astype(np.float32)
    answer = scene.cast_rays(o3d.core.Tensor(rays))
    depth = answer["t_hit"].numpy()
    is_hit = np.isfinite(depth)
    light = T[:3, :3] @ np.array([-0.5, -0.6, -0.6])
    shade = 0.25 + 0.75 * np.clip(answer["primitive_normals"].numpy() @ light, 0.0, 1.0)
    colours = np.random.default_rng(3).integers(60, 255, (N_PARTS + 1, 3))
    part = mesh.face_label[np.where(is_hit, answer["primitive_ids"].numpy(), 0)]
    grey = np.interp(depth, (2.0, 3.2), (255.0, 60.0))
    layers = (shade[..., None] * 230.0, shade[..., None] * colours[part], np.repeat(grey[..., None], 3, axis=-1))
    return [np.where(is_hit[..., None], layer, 25.0).astype(np.uint8) * np.ones(3, np.uint8) for layer in layers]


def main() -> None:
    """Writes the picture."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=77)
    parser.add_argument("--n", type=int, default=12)
    parser.add_argument("--out", type=Path, default=Path("docs/bodies.png"))
    args = parser.parse_args()
    rng = np.random.default_rng(args.seed)
    camera = Camera(130, 290, 365.0, 365.0, 64.5, 144.5)
    columns = []
    for i in range(args.n):
        mesh = posed_mesh(make_body(sample_body(rng, 0.2)), pose_of(POSES[i % len(POSES)]))
        columns.append(np.vstack(pictures(mesh, camera, np.radians(25.0 + 40.0 * (i % 5)))))
    cv2.imwrite(str(args.out), np.hstack(columns))


if __name__ == "__main__":
    main()
