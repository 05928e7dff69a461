"""What a walk saw of every joint: the terms that its probabilities are regressed on."""

import numpy as np
from numpy.typing import NDArray

from forests.frames import Pinhole

TERMS = ("one", "log_share", "second_to_first", "spread", "log_weight", "behind", "no_surface")
"""What the probabilities are regressed on, in the order of the weights; see `terms`."""

_LEAST = 1e-6
_NEAREST_M = 0.2
"""Nearer places are projected as from here; walkers come no nearer [m]."""
_MOST_BEHIND_M = 0.5


def terms(
    ends: NDArray[np.float32],
    spread: NDArray[np.float32],
    weight: NDArray[np.float32],
    depth: NDArray[np.uint16],
    camera: Pinhole,
) -> NDArray[np.float64]:
    """The terms of the logistic regressions.

    Args:
        ends: (n_joints, n_ends, 4) float32, of `walk_skeleton`.
        spread: (n_joints,) float32 [m].
        weight: (n_joints,) float32, the votes' mean weights.
        depth: (height, width) uint16 [mm], 0 = nothing.
        camera: Intrinsics.

    Returns:
        (n_joints, len(TERMS)) float64, finite: 1; logarithm of the first end's share; the second's share over it;
        the votes' spread [m]; logarithm of their mean weight; how far the first end lies behind the surface at its
        pixel, cut to half a metre, 0 where there is none [m]; whether there is none.
    """
    first = np.maximum(ends[:, 0, 3].astype(np.float64), _LEAST)
    second = ends[:, 1, 3] / first if ends.shape[1] > 1 else np.zeros_like(first)
    x, y, z = ends[:, 0, :3].T.astype(np.float64)
    z = np.maximum(z, _NEAREST_M)
    column = np.floor(camera.fx * x / z + camera.cx + 0.5)
    row = np.floor(camera.fy * y / z + camera.cy + 0.5)
    height, width = depth.shape
    is_inside = (column >= 0) & (column < width) & (row >= 0) & (row < height)
    surface = np.zeros(len(first))
    surface[is_inside] = depth[row[is_inside].astype(np.int64), column[is_inside].astype(np.int64)] * 1e-3
    is_open = surface == 0
    behind = np.where(is_open, 0.0, np.clip(z - surface, -_MOST_BEHIND_M, _MOST_BEHIND_M))
    columns = [
        np.ones_like(first),
        np.log(first),
        second,
        spread,
        np.log(np.maximum(weight, _LEAST)),
        behind,
        is_open,
    ]
    return np.stack([np.asarray(column, np.float64) for column in columns], axis=1)
