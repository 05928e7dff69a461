"""Which poses of a captured motion are worth keeping: no two nearly alike."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from synth.bodies.body import Pose
from synth.bodies.mocap.retarget import Retargeted
from synth.bodies.rig.kinematics import joint_positions
from synth.bodies.skeleton import Lengths, make_skeleton


def joint_places(poses: Retargeted) -> NDArray[np.float64]:
    """(n, 15, 3) joints of an average body around its root, facing x [m].

    Args:
        poses: From `retarget`.
    """
    skeleton = make_skeleton(Lengths.of_stature(1.7))
    out = np.empty((len(poses.angles), 15, 3))
    T = np.eye(4)
    for k, (angles, root) in enumerate(zip(poses.angles, poses.root, strict=True)):
        T[:3, :3] = root
        out[k] = joint_positions(skeleton, Pose(angles, T))
    return out


@njit(cache=True, nogil=True)
def _thin(
    places: NDArray[np.float64], is_open: NDArray[np.bool_], distance: float, kept: NDArray[np.int64]
) -> int:
    n_kept = 0
    limit = distance * distance
    for i in range(places.shape[0]):
        if not is_open[i]:
            continue
        is_new = True
        for k in range(n_kept):
            is_far = False
            for j in range(places.shape[1]):
                total = 0.0
                for c in range(3):
                    total += (places[i, j, c] - places[kept[k], j, c]) ** 2
                if total > limit:
                    is_far = True
                    break
            if not is_far:
                is_new = False
                break
        if is_new:
            kept[n_kept] = i
            n_kept += 1
    return n_kept


def unlike_poses(places: NDArray[np.float64], is_open: NDArray[np.bool_], distance: float) -> NDArray[np.int64]:
    """Goes through poses in order and keeps each that differs from all kept ones.

    Args:
        places: (n, n_joints, 3) joints [m].
        is_open: (n,) whether a pose may be kept at all.
        distance: Two poses differ if any joint does by more than this [m].

    Returns:
        (m,) indices, ascending.
    """
    if not distance >= 0.0:
        raise ValueError(f"distance={distance} must not be negative")
    kept = np.empty(len(places), dtype=np.int64)
    n_kept = _thin(np.ascontiguousarray(places, dtype=np.float64), is_open, distance, kept)
    return kept[:n_kept].copy()
