"""Which way a person faces: of the trunk, about the vertical, relative to the ray from the camera to the person."""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

PAIRS = (("r_shoulder", "l_shoulder"), ("r_hip", "l_hip"))
"""The joints whose line a person faces across."""
N_SECTORS = 12
"""Headings are told in sectors of 30 degrees; the first is that of people who face the camera."""
N_BESIDE = 2
"""Sectors on either side of the likeliest that belong to the same hypothesis."""
SHORTEST_M = 0.02
"""Lines across the body that are seen shorter than this from above tell no heading [m]."""


class Heading(NamedTuple):
    """A hypothesis of which way a person faces.

    Attributes:
        angle: 0 = towards the camera, pi / 2 = towards the image's right, -pi..pi [rad]; NaN = not known.
        probability: That it is nearer to the true heading than 75 degrees.
    """

    angle: float
    probability: float


def facings_of(joints: NDArray[np.float32], names: tuple[str, ...]) -> NDArray[np.float32]:
    """Which way people face, by the lines from left to right through shoulders and hips.

    The camera's y axis is taken for the vertical. Left and right joints at the same place, a person who lies on a
    side, or joints that are not known, tell nothing.

    Args:
        joints: (n, n_joints, 3) float32, camera frame [m]; NaN = unknown.
        names: Of the joints.

    Returns:
        (n, 2) float32: cosine and sine of the heading; zeros where it is not known.
    """
    across = np.zeros((len(joints), 2))
    middle, n_known = np.zeros((len(joints), 2)), np.zeros(len(joints))
    for right, left in PAIRS:
        if right in names and left in names:
            ends = joints[:, [names.index(right), names.index(left)]].astype(np.float64)[..., ::2]
            is_pair = np.isfinite(ends).all(axis=(1, 2))
            across[is_pair] += ends[is_pair, 0] - ends[is_pair, 1]
            middle[is_pair] += ends[is_pair].mean(axis=1)
            n_known += is_pair
    away = middle / np.maximum(np.linalg.norm(middle, axis=1, keepdims=True), 1e-9)
    length = np.linalg.norm(across, axis=1)
    x, z = -across[:, 1], across[:, 0]
    cos, sin = -(x * away[:, 0] + z * away[:, 1]), x * away[:, 1] - z * away[:, 0]
    is_told: NDArray[np.bool_] = (length > SHORTEST_M * np.maximum(n_known, 1)) & (n_known > 0)
    facing = np.stack([cos, sin], axis=1) / np.maximum(length, 1e-9)[:, None]
    return np.where(is_told[:, None], facing, 0.0).astype(np.float32)


def facing_towards(angle: float) -> NDArray[np.float32]:
    """(2,) float32: cosine and sine of a heading [rad]; zeros of NaN."""
    if math.isnan(angle):
        return np.zeros(2, np.float32)
    return np.array([math.cos(angle), math.sin(angle)], np.float32)


def sectors_of(facings: NDArray[np.float32]) -> NDArray[np.float32]:
    """(n, N_SECTORS) float32: shares of the two sectors whose middles a heading lies between; zeros of none.

    Args:
        facings: (n, 2) float32, cosines and sines; zeros = not known.
    """
    is_known: NDArray[np.bool_] = np.any(facings, axis=1)
    place = np.arctan2(facings[:, 1], facings[:, 0]) / (2.0 * np.pi) * N_SECTORS
    first = np.floor(place).astype(np.int64)
    share = (place - first).astype(np.float32)
    out = np.zeros((len(facings), N_SECTORS), np.float32)
    rows = np.arange(len(facings))
    out[rows, first % N_SECTORS] = 1.0 - share
    out[rows, (first + 1) % N_SECTORS] += share
    out[~is_known] = 0.0
    return out


@njit(cache=True, nogil=True)
def hypotheses_of(sectors: np.ndarray, angle: np.ndarray, probability: np.ndarray) -> None:
    """The two likeliest headings, the second of which lies more than 75 degrees from the first.

    Args:
        sectors: (N_SECTORS,) float32, probabilities.
        angle: (2,) float32 to fill [rad].
        probability: (2,) float32 to fill, the first at least the second.
    """
    is_free = np.ones(N_SECTORS, np.bool_)
    for k in range(2):
        best, most = 0, -1.0
        for sector in range(N_SECTORS):
            if is_free[sector] and sectors[sector] > most:
                best, most = sector, sectors[sector]
        cos, sin, total = 0.0, 0.0, 0.0
        for beside in range(-N_BESIDE, N_BESIDE + 1):
            sector = (best + beside) % N_SECTORS
            if is_free[sector]:
                total += sectors[sector]
                if abs(beside) <= 1:
                    turn = 2.0 * math.pi * sector / N_SECTORS
                    cos += sectors[sector] * math.cos(turn)
                    sin += sectors[sector] * math.sin(turn)
        for beside in range(-N_BESIDE, N_BESIDE + 1):
            is_free[(best + beside) % N_SECTORS] = False
        angle[k], probability[k] = math.atan2(sin, cos), total
    if probability[1] > probability[0]:
        angle[0], angle[1] = angle[1], angle[0]
        probability[0], probability[1] = probability[1], probability[0]
