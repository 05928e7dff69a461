"""What a forest saw of a joint: the terms that its probabilities are regressed on."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from forests.frames import Pinhole

TERMS = (
    "one",
    "log_confidence",
    "second_to_first",
    "spread",
    "occluder_share",
    "behind",
    "behind_occluder",
    "no_surface",
)
"""What the probabilities are regressed on, in the order of the weights; see `terms`."""

_LEAST_CONFIDENCE = 1e-6
_MOST_BEHIND_M = 0.5


class Evidence(NamedTuple):
    """What a forest saw of every joint of one image.

    Attributes:
        confidence: (n_joints, n_proposals) float, falling, 0 where missing [m^2].
        spread: (n_joints,) float, of the votes around the first proposal [m]; NaN without votes.
        occluder_share: (n_joints,) float, share of their weight that occluder modes cast; NaN without votes.
        behind: (n_joints,) float, how far the joint lies behind the surface seen at its pixel [m]; NaN where there
            is none.
        occluder_probability: (n_joints,) float, that this surface is an occluder; NaN where there is none.
    """

    confidence: NDArray[np.float32]
    spread: NDArray[np.float32]
    occluder_share: NDArray[np.float32]
    behind: NDArray[np.float32]
    occluder_probability: NDArray[np.float32]


def terms(evidence: Evidence) -> NDArray[np.float64]:
    """(n_joints, len(TERMS)) float64, finite: the terms of the logistic regressions."""
    first = np.maximum(evidence.confidence[:, 0].astype(np.float64), _LEAST_CONFIDENCE)
    second = evidence.confidence[:, 1] / first if evidence.confidence.shape[1] > 1 else np.zeros_like(first)
    behind = np.clip(np.nan_to_num(evidence.behind), -_MOST_BEHIND_M, _MOST_BEHIND_M)
    return np.stack(
        [
            np.ones_like(first),
            np.log(first),
            second,
            np.nan_to_num(evidence.spread),
            np.nan_to_num(evidence.occluder_share),
            behind,
            behind * np.nan_to_num(evidence.occluder_probability),
            np.isnan(evidence.behind).astype(np.float64),
        ],
        axis=1,
    )


def pixels_of(joints: NDArray[np.float32], camera: Pinhole, shape: tuple[int, ...]) -> NDArray[np.int64]:
    """(n,) int64: number of the pixel that each joint falls on, row-major; -1 outside the image or if NaN."""
    place = np.full(len(joints), -1, np.int64)
    ahead = np.flatnonzero(joints[:, 2] > 0)
    x, y, z = joints[ahead].T.astype(np.float64)
    u = np.floor(camera.fx * x / z + camera.cx + 0.5)
    v = np.floor(camera.fy * y / z + camera.cy + 0.5)
    is_inside = (u >= 0) & (u < shape[1]) & (v >= 0) & (v < shape[0])
    place[ahead[is_inside]] = (v * shape[1] + u)[is_inside].astype(np.int64)
    return place
