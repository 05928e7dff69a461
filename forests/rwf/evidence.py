"""What a walk saw of every joint: the terms that its probabilities are regressed on."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from forests.rwf.walk import NEAREST_M, pixel_of

TERMS = (
    "one",
    "log_share",
    "second_to_first",
    "spread",
    "log_weight",
    "behind",
    "no_surface",
    "inside",
    "outside_votes",
    "far_behind",
    "parent_log_share",
    "parent_spread",
    "parent_log_weight",
    "parent_behind",
    "parent_inside",
    "parent_outside_votes",
    "behind_log_share",
    "log_share_squared",
    "spread_squared",
    "log_share_spread",
)
"""What the probabilities are regressed on, in the order of the weights; see `write_terms`. Parents tell much: a joint
is rarely found from a parent that was not."""
OUTCOMES = ("within", "hidden", "outside")
"""What a joint's probabilities are of: within 10 cm, occluded by an object, not in the image."""

_LEAST = 1e-6
_MOST_BEHIND_M = 0.5
_FAR_BEHIND_M, _MIXED_BEHIND_M = (0.08, 0.2), (-0.1, 0.3)
_OF_PARENT = (1, 3, 4, 5, 7, 8)
_FROM_INSIDE_M = 0.5
"""Joints farther from the image's edge than this are taken as this far [m]."""


@njit(cache=True, nogil=True)
def write_terms(
    ends: np.ndarray, votes: np.ndarray, parent: np.ndarray, depth: np.ndarray, intrinsics: np.ndarray,
    edges: np.ndarray, out: np.ndarray,
) -> None:  # fmt: skip
    """Writes the terms of the logistic regressions.

    Args:
        ends: (n_joints, n_ends, 4) float32, of `walk_skeleton`.
        votes: (n_joints, 3) float32, what `walk_skeleton` says of the votes.
        parent: (n_joints,) int32, -1 = none.
        depth: (height, width) uint16 [mm], 0 = nothing.
        intrinsics: (4,) float32, (fx, fy, cx, cy) [px].
        edges: (4,) float32, the image's left, top, right and bottom edge as slopes: x / z and y / z.
        out: (n_joints, len(TERMS)) float64 to fill, finite: 1; logarithm of the first end's share; the second's
            share over it; the votes' spread [m]; logarithm of their mean weight; how far the first end lies behind
            the surface at its pixel, cut to half a metre, 0 where there is none [m]; whether there is none; how far
            it lies inside the image, cut to half a metre [m]; the share of the votes that lie outside; by how much
            it lies farther behind than 8 cm, cut to 20 cm [m]; six of these of the parent's walk, of its own without
            a parent; and products.
    """
    height, width = depth.shape
    fx, fy, cx, cy = intrinsics[0], intrinsics[1], intrinsics[2], intrinsics[3]
    for joint in range(len(ends)):
        x, y, z = ends[joint, 0, 0], ends[joint, 0, 1], max(ends[joint, 0, 2], np.float32(NEAREST_M))
        column, row = pixel_of(x, z, fx, cx), pixel_of(y, z, fy, cy)
        is_seen = column >= 0.0 and column < width and row >= 0.0 and row < height
        surface = depth[int(row), int(column)] * 1e-3 if is_seen else 0.0
        behind = min(max(z - surface, -_MOST_BEHIND_M), _MOST_BEHIND_M) if surface > 0.0 else 0.0
        first = max(float(ends[joint, 0, 3]), _LEAST)
        terms = out[joint]
        terms[0] = 1.0
        terms[1] = math.log(first)
        terms[2] = ends[joint, 1, 3] / first if ends.shape[1] > 1 else 0.0
        terms[3] = votes[joint, 0]
        terms[4] = math.log(max(float(votes[joint, 1]), _LEAST))
        terms[5] = behind
        terms[6] = 0.0 if surface > 0.0 else 1.0
        terms[7] = inside_by(ends[joint, 0], edges)
        terms[8] = votes[joint, 2]
        terms[9] = min(max(behind - _FAR_BEHIND_M[0], 0.0), _FAR_BEHIND_M[1])
    for joint in range(len(ends)):
        terms, above = out[joint], out[parent[joint] if parent[joint] >= 0 else joint]
        for k, term in enumerate(_OF_PARENT):
            terms[10 + k] = above[term]
        behind = min(max(terms[5], _MIXED_BEHIND_M[0]), _MIXED_BEHIND_M[1])
        terms[16], terms[17] = behind * terms[1], terms[1] ** 2
        terms[18], terms[19] = terms[3] ** 2, terms[1] * terms[3]


@njit(cache=True, nogil=True, inline="always")
def inside_by(place: np.ndarray, edges: np.ndarray) -> float:
    """How far a place lies inside the image, cut to half a metre on either side [m]."""
    x, y, z = place[0], place[1], max(place[2], np.float32(NEAREST_M))
    inside = min(x - edges[0] * z, y - edges[1] * z, edges[2] * z - x, edges[3] * z - y)
    return min(max(float(inside), -_FROM_INSIDE_M), _FROM_INSIDE_M)


def terms_of(
    ends: NDArray[np.float32],
    votes: NDArray[np.float32],
    parent: NDArray[np.int32],
    depth: NDArray[np.uint16],
    intrinsics: NDArray[np.float32],
    edges: NDArray[np.float32],
) -> NDArray[np.float64]:
    """(n_joints, len(TERMS)) float64, the terms that `write_terms` writes."""
    out = np.empty((len(ends), len(TERMS)), np.float64)
    write_terms(ends, votes, parent, depth, intrinsics, edges, out)
    return out
