"""What a forest answered about one image as the numbers that the learned proposal reads."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

N_MODES = 4
"""Proposals of a joint that are read."""
N_OF_JOINT = 4 * N_MODES + 4
N_OF_IMAGE = 9
TRUNK = ("head", "neck", "torso", "r_shoulder", "l_shoulder", "r_hip", "l_hip")
"""Joints whose middle all others are seen from."""
REACH_M = 1.5
"""Proposals farther than this from the middle, along an axis, are taken as this far [m]."""
_LEAST_CONFIDENCE = 1e-6


def trunk_of(names: tuple[str, ...]) -> NDArray[np.int32]:
    """Places of the trunk's joints, all joints if there are none."""
    places = [k for k, name in enumerate(names) if name in TRUNK] or list(range(len(names)))
    return np.array(places, np.int32)


def n_features(n_joints: int) -> int:
    """Length of a feature vector."""
    return n_joints * N_OF_JOINT + N_OF_IMAGE


@njit(cache=True, nogil=True)
def middle_of(proposals: np.ndarray, trunk: np.ndarray, middle: np.ndarray) -> int:
    """The median of the trunk's first proposals along each axis, of all joints' if the trunk has none.

    Args:
        proposals: (n_joints, n_proposals, 3) float32, camera frame [m]; NaN = none.
        trunk: Places of its joints.
        middle: (3,) float32 to fill.

    Returns:
        How many joints were found, 0 = none: the middle is then 0.
    """
    middle[:] = 0.0
    values = np.empty(len(proposals), np.float32)
    n = 0
    for is_trunk in (True, False):
        if n > 0:
            break
        for axis in range(3):
            n = 0
            for k in range(len(trunk) if is_trunk else len(proposals)):
                value = proposals[trunk[k] if is_trunk else k, 0, axis]
                if not np.isnan(value):
                    values[n] = value
                    n += 1
            if n > 0:
                middle[axis] = np.median(values[:n])
    return n


@njit(cache=True, nogil=True)
def write_features(
    proposals: np.ndarray, confidence: np.ndarray, within: np.ndarray, hidden: np.ndarray, spread: np.ndarray,
    edges: np.ndarray, facing: np.ndarray, middle: np.ndarray, out: np.ndarray,
) -> None:  # fmt: skip
    """Fills in the features of one image.

    Args:
        proposals: (n_joints, n_proposals, 3) float32, camera frame [m]; NaN = none.
        confidence: (n_joints, n_proposals) float32.
        within: (n_joints,) float32, probability that the first is near; NaN = not told.
        hidden: (n_joints,) float32, probability that an object hides the joint; NaN = not told.
        spread: (n_joints,) float32 [m]; NaN = not told.
        edges: (4,) float32, the image's left, top, right and bottom edge as slopes: x / z and y / z.
        facing: (2,) float32, cosine and sine of the heading that votes were weighed by; zeros = of none.
        middle: (3,) float32, where the person is [m].
        out: (n_joints * N_OF_JOINT + N_OF_IMAGE,) float32 to fill.
    """
    n_joints, n_proposals = confidence.shape
    n_modes = min(N_MODES, n_proposals)
    at = 0
    for joint in range(n_joints):
        total = np.float32(0.0)
        for k in range(n_proposals):
            total += confidence[joint, k]
        for k in range(N_MODES):
            source = k if k < n_modes and not np.isnan(proposals[joint, k, 0]) else 0
            for axis in range(3):
                gap = proposals[joint, source, axis] - middle[axis]
                gap = (
                    np.float32(0.0) if np.isnan(gap) else min(max(gap, np.float32(-REACH_M)), np.float32(REACH_M))
                )
                out[at] = np.float32(2.0) * gap
                at += 1
            share = confidence[joint, k] / total if k < n_modes and total > 0.0 else 0.0
            out[at] = 2.0 * share - 0.5
            at += 1
        out[at] = 1.0 + 0.2 * np.log(max(total, np.float32(_LEAST_CONFIDENCE)))
        out[at + 1] = 0.0 if np.isnan(within[joint]) else 2.0 * within[joint] - 1.0
        out[at + 2] = 0.0 if np.isnan(hidden[joint]) else 2.0 * hidden[joint]
        out[at + 3] = 0.0 if np.isnan(spread[joint]) or np.isinf(spread[joint]) else 5.0 * spread[joint]
        at += 4
    z = max(middle[2], np.float32(0.3))
    out[at], out[at + 1], out[at + 2] = middle[0] / z, middle[1] / z, z / 3.0 - 1.0
    for k in range(4):
        gap = edges[k] * z - middle[k % 2]
        out[at + 3 + k] = min(max(gap, np.float32(-REACH_M)), np.float32(REACH_M))
    out[at + 7], out[at + 8] = facing[0], facing[1]
