"""Which joint a limb hangs on, how long limbs are, and estimates moved so that theirs are possible."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from forests.frames import is_known
from forests.rwf.model import Limbs


def chosen_joints(names: tuple[str, ...], wanted: tuple[str, ...]) -> NDArray[np.int32]:
    """(n_joints,) places of the wanted joints among all; all if none is wanted in particular.

    Raises:
        ValueError: A joint that the frames do not have.
    """
    unknown = [name for name in wanted if name not in names]
    if unknown:
        raise ValueError(f"joints {unknown} are unknown; the frames have {', '.join(names)}")
    return np.array([i for i, name in enumerate(names) if not wanted or name in wanted], np.int32)


def measure_limbs(joints: NDArray[np.float32], parents: NDArray[np.int32], share: float) -> Limbs:
    """Ranges of the limbs' lengths, in the frames that know both ends; without such frames any length is possible.

    Args:
        joints: (n_frames, n_joints, 3) float32 [m]; NaN = unknown.
        parents: (n_joints,) int32, -1 = none.
        share: Share of the frames below, and above, the range.
    """
    length = np.linalg.norm(joints - joints[:, parents], axis=2)
    limits = np.full((len(parents), 2), (0.0, np.inf), np.float32)
    for joint in np.flatnonzero((parents >= 0) & np.isfinite(length).any(axis=0)):
        known = length[np.isfinite(length[:, joint]), joint]
        limits[joint] = np.quantile(known, [share, 1.0 - share])
    return Limbs(parents, limits)


def starts_of(
    joints: NDArray[np.float32], parents: NDArray[np.int32], joint: int, starts: NDArray[np.float32]
) -> NDArray[np.float32]:
    """Where the ways to a joint start: at its nearest ancestor that the frame knows, else where walks start.

    Args:
        joints: (n_frames, n_joints, 3) float32, camera frame [m]; NaN = unknown.
        parents: (n_joints,) int32, -1 = none.
        joint: Which.
        starts: (n_frames, 3) float32, where walks start, camera frame [m].

    Returns:
        (n_frames, 3) float32, camera frame [m].
    """
    places: NDArray[np.float32] = np.full_like(starts, np.nan)
    above = int(parents[joint])
    while above >= 0:
        places = np.where(is_known(places)[:, None], places, joints[:, above])
        above = int(parents[above])
    return np.where(is_known(places)[:, None], places, starts)


@njit(cache=True, nogil=True)
def fit_limbs(joints: np.ndarray, order: np.ndarray, parent: np.ndarray, length_m: np.ndarray) -> None:
    """Moves each joint along its limb until the limb's length is possible, parents first.

    Args:
        joints: (n_joints, 3) float32 [m], changed.
        order: (n_joints,) int32, parents before children.
        parent: (n_joints,) int32, -1 = none.
        length_m: (n_joints, 2) float32, shortest and longest distance to the parent [m].
    """
    for joint in order:
        above = parent[joint]
        if above < 0:
            continue
        dx = joints[joint, 0] - joints[above, 0]
        dy = joints[joint, 1] - joints[above, 1]
        dz = joints[joint, 2] - joints[above, 2]
        length = math.sqrt(dx * dx + dy * dy + dz * dz)
        if length < 1e-6:
            continue
        scale = min(max(length, length_m[joint, 0]), length_m[joint, 1]) / length
        joints[joint, 0] = joints[above, 0] + dx * scale
        joints[joint, 1] = joints[above, 1] + dy * scale
        joints[joint, 2] = joints[above, 2] + dz * scale
