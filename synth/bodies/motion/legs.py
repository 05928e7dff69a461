"""Angles of a leg whose foot is given, in closed form: six hinges for the six numbers of the foot's pose.

The knee and the ankle's flexion turn about one axis n. It is normal to the line from hip to ankle, which lies in
the plane of thigh and shank, and to the foot's x axis, which ankle flexion alone turns within that plane; so n is
their cross product, the knee follows from the law of cosines, and the hip from thigh and n.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from synth.bodies.skeleton import DOF_IDX, LOWER, UPPER, Skeleton

LEG_HINGES = ("hip_flexion", "hip_abduction", "hip_rotation", "knee_flexion", "ankle_flexion", "ankle_inversion")
LEG_DOFS: dict[str, NDArray[np.int64]] = {
    side: np.array([DOF_IDX[f"{side}_{name}"] for name in LEG_HINGES]) for side in "lr"
}
"""Index of each hinge of a leg, by side."""
SIGN = {"l": 1.0, "r": -1.0}


def solve_legs(
    skeleton: Skeleton,
    side: str,
    T_world_root: NDArray[np.float64],
    T_world_foot: NDArray[np.float64],
    is_limited: bool = True,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Angles that put one foot where it shall be, sample by sample.

    Args:
        skeleton: The person's hinges.
        side: "l" or "r".
        T_world_root: (n, 4, 4).
        T_world_foot: (n, 4, 4) of the link behind the ankle (ankle_inversion).
        is_limited: Whether angles are cut to the limits of the hinges.

    Returns:
        (n, 6) angles in the order of `LEG_HINGES` [rad]; and (n,) how far the ankle stays from
        its place, because the leg is too short or a limit holds it [m], or 0.1 m a radian that the foot is turned
        wrong.
    """
    n = len(T_world_root)
    angles, missed = np.empty((n, len(LEG_HINGES))), np.empty(n)
    _solve(
        skeleton.offsets[LEG_DOFS[side][0]],
        -float(skeleton.offsets[LEG_DOFS[side][3]][2]),
        -float(skeleton.offsets[LEG_DOFS[side][4]][2]),
        SIGN[side],
        np.ascontiguousarray(T_world_root),
        np.ascontiguousarray(T_world_foot),
        LOWER[LEG_DOFS[side]] if is_limited else np.full(len(LEG_HINGES), -np.inf),
        UPPER[LEG_DOFS[side]] if is_limited else np.full(len(LEG_HINGES), np.inf),
        angles,
        missed,
    )
    return angles, missed


@njit(cache=True, nogil=True)
def _solve(
    hip: NDArray[np.float64],
    thigh: float,
    shank: float,
    sign: float,
    T_world_root: NDArray[np.float64],
    T_world_foot: NDArray[np.float64],
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
    angles: NDArray[np.float64],
    missed: NDArray[np.float64],
) -> None:
    """Kernel of `solve_legs`.

    Args:
        hip: (3,) hip joint centre, root frame [m].
        thigh: Its length [m].
        shank: Its length [m].
        sign: 1 on the left, -1 on the right.
        T_world_root: (n, 4, 4).
        T_world_foot: (n, 4, 4).
        lower: (6,) limits [rad].
        upper: (6,) limits [rad].
        angles: (n, 6), overwritten.
        missed: (n,), overwritten.
    """
    foot = np.empty((3, 3))
    d, n, x, z = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for i in range(angles.shape[0]):
        root, there = T_world_root[i], T_world_foot[i]
        for a in range(3):
            d[a] = -hip[a]
            for b in range(3):
                d[a] += root[b, a] * (there[b, 3] - root[b, 3])
                foot[a, b] = root[0, a] * there[0, b] + root[1, a] * there[1, b] + root[2, a] * there[2, b]
        reach = np.sqrt(d[0] ** 2 + d[1] ** 2 + d[2] ** 2)
        length = min(max(reach, abs(thigh - shank) + 1e-6), thigh + shank - 1e-9)
        d /= reach
        _cross(foot[:, 0], d, n)
        norm = np.sqrt(n[0] ** 2 + n[1] ** 2 + n[2] ** 2)
        n /= norm if n[1] > 0.0 else -norm  # within the hip's limits the knee's axis points to the left
        _cross(d, n, x)
        knee = np.pi - _corner(thigh, shank, length)
        ahead = _corner(thigh, length, shank)
        c, s = np.cos(ahead), np.sin(ahead)
        for a in range(3):
            z[a] = -(c * d[a] + s * x[a])
        _cross(n, z, x)
        angles[i, 0] = -np.arctan2(z[0], z[2])
        angles[i, 1] = -sign * np.arcsin(min(max(z[1], -1.0), 1.0))
        angles[i, 2] = -sign * np.arctan2(x[1], n[1])
        angles[i, 3] = knee
        # Ankle: the foot's axes along those of the shank, which are the thigh's turned about n by the knee.
        c, s = np.cos(knee), np.sin(knee)
        along_x = along_z = across_y = across_z = 0.0
        for a in range(3):
            along_x += (c * x[a] - s * z[a]) * foot[a, 0]
            along_z += (s * x[a] + c * z[a]) * foot[a, 0]
            across_y += n[a] * foot[a, 1]
            across_z += n[a] * foot[a, 2]
        angles[i, 4] = np.arctan2(along_z, along_x)
        angles[i, 5] = sign * np.arctan2(across_z, across_y)
        wrong = 0.0
        for k in range(6):
            kept = min(max(angles[i, k], lower[k]), upper[k])
            wrong += abs(kept - angles[i, k])
            angles[i, k] = kept
        missed[i] = max(reach - length, 0.0) + 0.1 * wrong


@njit(cache=True, nogil=True, inline="always")
def _cross(a: NDArray[np.float64], b: NDArray[np.float64], out: NDArray[np.float64]) -> None:
    """(3,) product of two vectors."""
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


@njit(cache=True, nogil=True)
def _corner(a: float, b: float, opposite: float) -> float:
    """Angle of a triangle between two of its sides [rad]."""
    return np.arccos(min(max((a * a + b * b - opposite * opposite) / (2.0 * a * b), -1.0), 1.0))
