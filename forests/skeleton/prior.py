"""What a training corpus knows of bodies: how long limbs are, and how much of that a person's size explains."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from forests.skeleton.kinematics import mirrored_joints, parents_first, parents_of

N_SIZES = 5
"""Sizes of a person that decoding tries."""
LEAST_DEVIATION = 0.03
"""Of a limb's logarithmic length: estimates of its ends are not exact, however rigid the limb is."""
SHORTEST_M = 0.01
"""Lengths below this one are taken as this one before their logarithm [m]."""


class BodyPrior(NamedTuple):
    """What is known of bodies before an image is seen.

    Attributes:
        parent: (n_joints,) int32, -1 = none.
        order: (n_joints,) int32, parents before children.
        mirror: (n_joints,) int32, the joint on the other side.
        log_length: (n_joints,) float32, mean of the logarithm of the distance to the parent [log m]; 0 where unknown.
        deviation: (n_joints,) float32, its standard deviation in people of one size; infinite where unknown.
        log_size: (n_sizes,) float32, logarithms of sizes that are tried, 0 = the mean person.
        length_m: (n_joints, 2) float32, shortest and longest distance to the parent that was seen [m].
    """

    parent: NDArray[np.int32]
    order: NDArray[np.int32]
    mirror: NDArray[np.int32]
    log_length: NDArray[np.float32]
    deviation: NDArray[np.float32]
    log_size: NDArray[np.float32]
    length_m: NDArray[np.float32]


def measure_bodies(joints: NDArray[np.float32], names: tuple[str, ...]) -> BodyPrior:
    """Measures the bodies of training frames.

    Left and right limbs are measured together, so that a body and its mirror image are equally likely. A limb that
    no frame knows may have any length.

    Args:
        joints: (n_frames, n_joints, 3) float32, camera frame [m]; NaN = unknown.
        names: Of the joints.
    """
    parent, mirror = parents_of(names), mirrored_joints(names)
    length = np.linalg.norm(joints - joints[:, parent], axis=2)
    length[:, parent < 0] = np.nan
    both = np.stack([length, length[:, mirror]])
    is_known = np.isfinite(both)
    n = np.maximum(is_known.sum(axis=(0, 1)), 1)
    has_limb = is_known.any(axis=(0, 1))
    logs = np.where(is_known, np.log(np.maximum(np.nan_to_num(both), SHORTEST_M)), 0.0)
    mean = logs.sum(axis=(0, 1)) / n
    apart = np.where(is_known, logs - mean, 0.0)
    per_frame = apart.sum(axis=(0, 2)) / np.maximum(is_known.sum(axis=(0, 2)), 1)
    rest = np.where(is_known, apart - per_frame[None, :, None], 0.0)
    deviation = np.maximum(np.sqrt((rest**2).sum(axis=(0, 1)) / n), LEAST_DEVIATION)
    limits = np.full((len(names), 2), (0.0, np.inf))
    limits[has_limb, 0] = np.where(is_known, both, np.inf).min(axis=(0, 1))[has_limb]
    limits[has_limb, 1] = np.where(is_known, both, -np.inf).max(axis=(0, 1))[has_limb]
    shares = (np.arange(N_SIZES) + 0.5) / N_SIZES
    sizes = np.quantile(per_frame, shares) if len(per_frame) else np.zeros(1)
    return BodyPrior(
        parent,
        parents_first(parent),
        mirror,
        np.where(has_limb, mean, 0.0).astype(np.float32),
        np.where(has_limb, deviation, np.inf).astype(np.float32),
        sizes.astype(np.float32),
        limits.astype(np.float32),
    )
