"""Slow twins of the kernels for motion capture."""

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from synth.bodies.rig.kinematics import link_transforms
from synth.bodies.skeleton import LINK_IDX, LOWER, UPPER, Skeleton


def unlike_poses_slow(places: NDArray[np.float64], is_open: NDArray[np.bool_], distance: float) -> list[int]:
    """Keeps a pose if every kept one has a joint farther off than the distance."""
    kept: list[int] = []
    for i in np.flatnonzero(is_open):
        ways = [np.linalg.norm(places[i] - places[k], axis=1).max() for k in kept]
        if all(way > distance for way in ways):
            kept.append(int(i))
    return kept


def best_directions(
    skeleton: Skeleton,
    dofs: NDArray[np.int64],
    angles: NDArray[np.float64],
    wanted: list[tuple[str, NDArray[np.float64], NDArray[np.float64], float]],
    rng: np.random.Generator,
) -> float:
    """Least weighted squared distance of link axes to directions that scipy finds within the limits.

    Args:
        skeleton: The hinges.
        dofs: Those that may turn.
        angles: (n_dofs,) where the others are [rad].
        wanted: Link, axis in its frame, direction in the root's frame, weight.
        rng: Draws starts.
    """

    def off(theta: NDArray[np.float64]) -> NDArray[np.float64]:
        whole = angles.copy()
        whole[dofs] = theta
        return misses(skeleton, whole, wanted)

    low, high = LOWER[dofs], UPPER[dofs]
    starts = [rng.uniform(0.9 * low + 0.1 * high, 0.1 * low + 0.9 * high) for _ in range(8)]
    return min(2.0 * least_squares(off, start, bounds=(low, high)).cost for start in starts)


def misses(
    skeleton: Skeleton, angles: NDArray[np.float64], wanted: list[tuple[str, NDArray, NDArray, float]]
) -> NDArray[np.float64]:
    """Weighted differences of link axes and directions, one after another."""
    T = link_transforms(skeleton, angles, np.eye(4))
    return np.concatenate([w * (T[LINK_IDX[link], :3, :3] @ axis - way) for link, axis, way, w in wanted])
