"""From measured lengths to a skeleton, its bind pose and the points that the segments' axes run through."""

import numpy as np
from numpy.typing import NDArray

from synth.bodies.rig.kinematics import link_transforms
from synth.bodies.shape.measures import LENGTH_NAMES, MEASURE_IDX
from synth.bodies.shape.segments import FINGERS, POINT_NAMES
from synth.bodies.skeleton import DOF_IDX, LINK_IDX, N_DOFS, Lengths, Skeleton, make_skeleton

BIND_DEGREES: dict[str, float] = {
    "shoulder_abduction": 42.0,
    "elbow_flexion": 44.0,
    "hip_abduction": 7.0,
    "ankle_inversion": 7.0,
}
"""The bind pose, both sides; the soles are level in it."""


def _bind_angles() -> NDArray[np.float64]:
    angles = np.zeros(N_DOFS)
    for name, degrees in BIND_DEGREES.items():
        for side in "lr":
            angles[DOF_IDX[f"{side}_{name}"]] = np.radians(degrees)
    return angles


BIND_ANGLES: NDArray[np.float64] = _bind_angles()
"""(n_dofs,) [rad]."""
_FORWARD = ("neck_forward", "head_forward", "shoulder_forward", "skull_forward")


def skeleton_of(measures: NDArray[np.float64]) -> Skeleton:
    """The hinges of a body.

    Args:
        measures: (n_measures,) in the order of `MEASURES` [m].
    """
    values = {name: float(measures[MEASURE_IDX[name]]) for name in LENGTH_NAMES + _FORWARD}
    x, y, z = (float(measures[MEASURE_IDX[f"thumb_0_{c}"]]) for c in "xyz")
    return make_skeleton(Lengths(**values, thumb=(x, y, z)))


def bind_points(
    skeleton: Skeleton, measures: NDArray[np.float64], stature: float, hem: float = 1.0
) -> NDArray[np.float64]:
    """Axis points in the bind pose.

    Args:
        skeleton: From `skeleton_of`.
        measures: (n_measures,) [m].
        stature: [m].
        hem: Where a skirt ends: 0 at the hip, 1 at the knee, 2 at the ankle.

    Returns:
        (n_points, 3) in the order of `POINT_NAMES`, root frame [m].
    """
    T = link_transforms(skeleton, BIND_ANGLES, np.eye(4))
    at = {name: T[LINK_IDX[f"l_{name}_flexion"], :3, 3] for name in ("shoulder", "elbow", "wrist", "hip", "knee")}
    at["ankle"] = T[LINK_IDX["l_ankle_flexion"], :3, 3]
    at["knuckle"] = T[LINK_IDX["l_fingers_flexion"], :3, 3]
    at["neck"] = T[LINK_IDX["neck_flexion"], :3, 3]
    skull = (measures[MEASURE_IDX["skull_forward"]], 0.0, measures[MEASURE_IDX["head_up"]])
    at["head"] = T[LINK_IDX["head_flexion"], :3, 3] + skull
    heights = {
        "low": -measures[MEASURE_IDX["crotch_down"]],
        "hip": 0.0,
        "lumbar": T[LINK_IDX["lumbar_flexion"], 2, 3],
        "thorax": T[LINK_IDX["thorax_flexion"], 2, 3],
        "shoulder": at["shoulder"][2],
        "top": at["neck"][2] + 0.01 * stature,
    }
    at |= {f"trunk_{name}": np.array([0.0, 0.0, z]) for name, z in heights.items()}
    at |= shoulder_points(at["shoulder"], at["elbow"], stature)
    hand = T[LINK_IDX["l_wrist_deviation"]]
    for name in (f"{finger}_{k}" for finger in FINGERS for k in range(4)):
        at[name] = hand[:3, 3] + hand[:3, :3] @ measures[[MEASURE_IDX[f"{name}_{c}"] for c in "xyz"]]
    for name in ("heel", "ball", "toe"):
        at[name] = at["ankle"] + measures[[MEASURE_IDX[f"{name}_{c}"] for c in "xyz"]]
    at |= overlap_points(at, stature)
    at["hem"] = np.array([0.0, 0.0, np.interp(hem, (0, 1, 2), [at[n][2] for n in ("hip", "knee", "ankle")])])
    return np.stack([at[name] for name in POINT_NAMES])


def overlap_points(at: dict[str, NDArray[np.float64]], stature: float) -> dict[str, NDArray[np.float64]]:
    """Ends of the axes past the joints, where two segments overlap, and the height of a skirt's hem.

    Args:
        at: The joints by name [m].
        stature: [m].
    """

    def past(start: str, end: str, length: float) -> NDArray[np.float64]:
        along = at[end] - at[start]
        return at[end] + length * stature * along / np.linalg.norm(along)

    return {
        "elbow_past": past("shoulder", "elbow", 0.018),
        "elbow_before": past("wrist", "elbow", 0.018),
        "wrist_before": past("knuckle", "wrist", 0.012),
        "hip_before": past("knee", "hip", 0.045),
        "knee_past": past("hip", "knee", 0.022),
        "knee_before": past("ankle", "knee", 0.022),
        "ankle_past": past("knee", "ankle", 0.012),
        "hem": np.array([at["trunk_hip"][0], 0.0, at["knee"][2]]),
    }


def shoulder_points(
    shoulder: NDArray[np.float64], elbow: NDArray[np.float64], stature: float
) -> dict[str, NDArray[np.float64]]:
    """Ends of the shoulder girdle's axis: near the midline, and past the joint toward the deltoid.

    Args:
        shoulder: (3,) joint centre [m].
        elbow: (3,) [m].
        stature: [m].
    """
    arm = (elbow - shoulder) / np.linalg.norm(elbow - shoulder) * (1.0, 1.0, 0.4)
    inner = shoulder * (1.0, 0.12, 1.0) + (0.0, 0.0, 0.012 * stature)
    return {"inner": inner, "deltoid": shoulder + 0.026 * stature * arm / np.linalg.norm(arm)}
