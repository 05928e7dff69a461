"""Average precision of joint proposals (Shotton et al. 2011, section 4), of many resamples at once."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipelines.metrics.resampling import FrameWeights


class RankedProposals(NamedTuple):
    """All proposals of one joint, most confident first.

    Attributes:
        frame: (n,) int32, frame that each was made in.
        is_true: (n,) bool, the first of its frame within the distance.
        is_last: (n,) bool, the last of a run of equal confidences: proposals that no threshold can tell apart.
        truth_frame: (n_truths,) int32, frames in which the joint exists.
    """

    frame: NDArray[np.int32]
    is_true: NDArray[np.bool_]
    is_last: NDArray[np.bool_]
    truth_frame: NDArray[np.int32]


def rank_proposals(
    confidence: NDArray[np.floating], distance: NDArray[np.floating], frame: NDArray[np.integer], within: float
) -> RankedProposals:
    """Sorts the proposals of one joint and says which are true.

    Args:
        confidence: (n_truths, n_proposals), falling in each row.
        distance: (n_truths, n_proposals) from the truth [m]; NaN where there is no proposal.
        frame: (n_truths,) frame of each row.
        within: Largest distance of a true proposal [m].
    """
    is_near = distance <= within
    is_true = is_near & (is_near.cumsum(axis=1) == 1)
    is_made = np.isfinite(distance)
    rows = np.broadcast_to(frame[:, None], distance.shape)[is_made].astype(np.int32)
    values, hits = confidence[is_made], is_true[is_made]
    order = np.argsort(-values, kind="stable")
    values = values[order]
    is_last = np.ones(len(values), np.bool_)
    is_last[:-1] = values[:-1] != values[1:]
    return RankedProposals(rows[order], hits[order], is_last, frame.astype(np.int32))


@dataclass(frozen=True)
class MeanAveragePrecision:
    """Mean over joints of the area under the precision-recall curve.

    Attributes:
        joints: The proposals, joint by joint.
    """

    joints: tuple[RankedProposals, ...]

    def __call__(self, weights: FrameWeights) -> NDArray[np.float64]:
        """(n_resamples,) by resample; joints that exist in none of its frames are left out, NaN if all are."""
        areas = np.full((len(self.joints), len(weights)), np.nan)
        for ranked, area in zip(self.joints, areas, strict=True):
            _fill_areas(ranked, weights, area)
        n_known = np.isfinite(areas).sum(axis=0)
        return np.where(n_known > 0, np.nansum(areas, axis=0) / np.maximum(n_known, 1), np.nan)


@njit(cache=True, nogil=True, error_model="numpy")
def _fill_areas(ranked: RankedProposals, weights: FrameWeights, area: NDArray[np.float64]) -> None:
    """Area under each resample's curve: sum over thresholds of the step in recall times the precision there.

    Args:
        ranked: The proposals.
        weights: (n_resamples, n_frames) int16, how often a frame was drawn.
        area: (n_resamples,) float64 to fill; left as it is where the joint does not exist.
    """
    frame, is_true, is_last, truth_frame = ranked
    for resample in range(len(weights)):
        weight = weights[resample]
        n_truths = 0
        for i in range(len(truth_frame)):
            n_truths += weight[truth_frame[i]]
        if n_truths == 0:
            continue
        n_made, n_true, n_new, total = 0, 0, 0, 0.0
        for i in range(len(frame)):
            n_made += weight[frame[i]]
            if is_true[i]:
                n_new += weight[frame[i]]
            if is_last[i] and n_new > 0:
                n_true += n_new
                total += n_new * (n_true / n_made)
                n_new = 0
        area[resample] = total / n_truths
