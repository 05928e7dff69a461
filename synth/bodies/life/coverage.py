"""Coverage: how many poses of one set have a pose of another set near them."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from synth.bodies.body import Pose
from synth.bodies.rig.kinematics import joint_positions
from synth.bodies.skeleton import Lengths, make_skeleton

STATURE = 1.7
"""Of the body that poses are compared on [m]."""


def places_of(angles: NDArray[np.floating], root: NDArray[np.floating]) -> NDArray[np.float64]:
    """Joints of one average body in many poses, around its root and facing x.

    Args:
        angles: (n, n_dofs) [rad].
        root: (n, 3, 3) rotation of the root; its heading is removed.

    Returns:
        (n, 15, 3) [m].
    """
    skeleton = make_skeleton(Lengths.of_stature(STATURE))
    out = np.empty((len(angles), 15, 3))
    T = np.eye(4)
    for k in range(len(angles)):
        R = np.asarray(root[k], dtype=np.float64)
        yaw = np.arctan2(R[1, 0], R[0, 0])
        c, s = np.cos(yaw), np.sin(yaw)
        T[:3, :3] = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]) @ R
        out[k] = joint_positions(skeleton, Pose(np.asarray(angles[k], dtype=np.float64), T))
    return out


@njit(cache=True, nogil=True)
def _nearest(asked: NDArray[np.float32], known: NDArray[np.float32], out: NDArray[np.float32]) -> None:
    n_joints = asked.shape[1]
    for i in range(asked.shape[0]):
        best = np.float32(np.inf)
        for k in range(known.shape[0]):
            total = np.float32(0.0)
            for j in range(n_joints):
                x = asked[i, j, 0] - known[k, j, 0]
                y = asked[i, j, 1] - known[k, j, 1]
                z = asked[i, j, 2] - known[k, j, 2]
                total += np.sqrt(x * x + y * y + z * z)
                if total >= best:
                    break
            best = min(best, total)
        out[i] = best / n_joints


def nearest_distances(asked: NDArray[np.floating], known: NDArray[np.floating]) -> NDArray[np.float32]:
    """Distance of each pose to the nearest of others: the mean over the joints.

    Args:
        asked: (n, n_joints, 3), as `places_of` gives them [m].
        known: (m, n_joints, 3) others, m > 0 [m].

    Returns:
        (n,) [m].

    Raises:
        ValueError: The shapes do not fit, or there are no others.
    """
    if asked.ndim != 3 or asked.shape[1:] != known.shape[1:] or asked.shape[2] != 3 or not len(known):
        raise ValueError(f"poses of shapes {asked.shape} and {known.shape} must be (n, n_joints, 3), with others")
    out = np.empty(len(asked), dtype=np.float32)
    _nearest(np.ascontiguousarray(asked, np.float32), np.ascontiguousarray(known, np.float32), out)
    return out
