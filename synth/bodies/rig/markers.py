"""Named points of the skin that touch things: palms, fingertips, elbows, forearms, heels, balls, seat, back."""

import numpy as np
from numpy.typing import NDArray

from synth.bodies.body import Body
from synth.bodies.rig.kinematics import link_transforms
from synth.bodies.skeleton import DOF_IDX, LINK_IDX
from synth.geometry import LabelledMesh

Vector = tuple[float, float, float]


def _rays(body: Body) -> dict[str, tuple[str, Vector, Vector]]:
    """Link, start and direction in the link's frame of each left-side or midline marker."""
    offsets = body.skeleton.offsets
    forearm = float(-offsets[DOF_IDX["l_wrist_flexion"], 2])
    palm = float(-offsets[DOF_IDX["l_fingers_flexion"], 2])
    thigh = float(-offsets[DOF_IDX["l_knee_flexion"], 2])
    trunk = float(offsets[DOF_IDX["neck_flexion"], 2])
    hip = float(offsets[DOF_IDX["l_hip_flexion"], 1])
    elbow = _vector(offsets[DOF_IDX["l_elbow_flexion"]])
    return {
        "l_palm": ("l_wrist_deviation", (0.0, 0.0, -0.6 * palm), (0.0, -1.0, 0.0)),
        "l_fingertip": ("l_fingertips_flexion", (-0.002, -0.012, -0.02), (-0.07, -0.55, -1.0)),
        "l_elbow": ("l_shoulder_rotation", elbow, (-1.0, 0.0, -0.5)),
        "l_forearm": ("l_elbow_flexion", (0.0, 0.0, -0.5 * forearm), (-1.0, 0.0, 0.0)),
        "l_heel": ("l_ankle_inversion", (-0.02, 0.0, 0.0), (0.0, 0.0, -1.0)),
        "l_ball": ("l_ankle_inversion", _vector(offsets[DOF_IDX["l_toes_extension"]]), (0.0, 0.0, -1.0)),
        "l_buttock": ("root", (-0.01, hip, 0.0), (-0.6, 0.0, -0.8)),
        "l_thigh": ("l_hip_rotation", (0.0, 0.0, -0.5 * thigh), (-1.0, 0.0, 0.0)),
        "lower_back": ("lumbar_rotation", (0.0, 0.0, 0.0), (-1.0, 0.0, 0.0)),
        "upper_back": ("thorax_rotation", (0.0, 0.02, 0.6 * trunk), (-1.0, 0.0, 0.0)),
    }


def _vector(values: NDArray[np.float64]) -> Vector:
    return (float(values[0]), float(values[1]), float(values[2]))


def _mirrored(name: str) -> str:
    return "r_" + name[2:] if name.startswith("l_") else name


def last_hit(
    mesh: LabelledMesh, start: NDArray[np.float64], direction: NDArray[np.float64], reach: float
) -> float:
    """Distance along a ray to the last skin it leaves within reach; 0 if there is none (Moeller & Trumbore 1997).

    Args:
        mesh: Closed skin.
        start: (3,) [m].
        direction: (3,) unit vector.
        reach: [m].
    """
    a, b, c = (mesh.vertices[mesh.faces[:, k]].astype(np.float64) for k in range(3))
    e1, e2 = b - a, c - a
    p = np.cross(direction, e2)
    det = (e1 * p).sum(axis=1)
    safe = np.where(np.abs(det) > 1e-14, det, 1.0)
    s = start - a
    u = (s * p).sum(axis=1) / safe
    q = np.cross(s, e1)
    v = (q @ direction) / safe
    t = (e2 * q).sum(axis=1) / safe
    hit = (np.abs(det) > 1e-14) & (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0) & (t < reach)
    return float(t[hit].max()) if hit.any() else 0.0


def markers(body: Body) -> dict[str, tuple[int, NDArray[np.float64]]]:
    """Contact points of a body's dressed skin.

    Args:
        body: The person.

    Returns:
        By name ("l_palm", "r_heel", "lower_back", ...) the link index and the (3,) offset in its frame [m].
    """
    T = link_transforms(body.skeleton, body.bind_angles, np.eye(4))
    out: dict[str, tuple[int, NDArray[np.float64]]] = {}
    for name, (link, start, direction) in _rays(body).items():
        T_link = T[LINK_IDX[link]]
        unit = np.array(direction) / np.linalg.norm(direction)
        origin = T_link[:3, :3] @ np.array(start) + T_link[:3, 3]
        offset = np.array(start) + last_hit(body.mesh, origin, T_link[:3, :3] @ unit, 0.25) * unit
        if name.startswith("l_"):
            out[name] = (LINK_IDX[link], offset)
            out[_mirrored(name)] = (LINK_IDX[_mirrored(link)], offset * (1.0, -1.0, 1.0))
        else:
            out[name] = (LINK_IDX[link], offset * (1.0, 0.0, 1.0))
    return out
