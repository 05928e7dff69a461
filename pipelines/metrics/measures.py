"""The measures of one method on some joints of some frames."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from forests.calibration import WITHIN_M
from pipelines.metrics.precision import MeanAveragePrecision, rank_proposals
from pipelines.metrics.resampling import FrameWeights, Median, Ratio, Statistic, every_frame_once, interval
from pipelines.metrics.results import Results

WITHIN_UPPER_BODY = 0.1
"""Rafi et al. 2015, table 2: the same in the image, as a share of the upper body's size."""
CURVE_END_M = 0.20
CURVE_CM = tuple(range(21))
"""Thresholds of the accuracy curve [cm]."""

MEASURES = (
    "map_10cm",
    "accuracy_10cm",
    "accuracy_2d",
    "auc_20cm",
    "mean_error_cm",
    "median_error_cm",
    "missing",
)
"""Names of the measures, in the order in which they are told."""


@dataclass(frozen=True)
class Measure:
    """A measure with its confidence interval; NaN where there is nothing to count.

    Attributes:
        estimate: Its value on the frames.
        low: Lower end.
        high: Upper end.
    """

    estimate: float
    low: float
    high: float


@dataclass(frozen=True)
class Summary:
    """All measures of one group of joints.

    Attributes:
        n_frames: Frames that hold a joint of the group.
        n_joints: Joints of the group, over all frames.
        measures: By name, see `MEASURES`.
    """

    n_frames: int
    n_joints: int
    measures: Mapping[str, Measure]


def distances(results: Results) -> NDArray[np.float64]:
    """(n, n_joints, n_proposals) float64, from proposals to truths [m]; NaN where one is missing."""
    gap = results.proposals.astype(np.float64) - results.truths.xyz[:, :, None].astype(np.float64)
    return np.sqrt((gap * gap).sum(axis=3))


def errors(results: Results) -> NDArray[np.float64]:
    """(n, n_joints) float64, of the first proposals [m]; infinite if there is none, NaN if there is no truth."""
    error = distances(results)[:, :, 0]
    is_missed = np.isnan(error) & np.isfinite(results.truths.xyz).all(axis=2)
    return np.where(is_missed, np.inf, error)


def errors_2d(results: Results) -> NDArray[np.float64]:
    """(n, n_joints) float64, of the first proposals in the image, as shares of the upper body's size.

    Infinite where there is no proposal before the camera, NaN where the truth has no place in the image.
    """
    truths = results.truths
    place, truth = (_pixels(xyz, truths.intrinsics) for xyz in (results.proposals[:, :, 0], truths.xyz))
    gap = place - truth
    share = np.sqrt((gap * gap).sum(axis=2)) / truths.upper_body_px[:, None]
    has_truth = np.isfinite(truth).all(axis=2) & np.isfinite(truths.upper_body_px)[:, None]
    return np.where(has_truth & np.isnan(share), np.inf, share)


def _pixels(xyz: NDArray[np.float32], intrinsics: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n, n_joints, 2) float64 [px] of (n, n_joints, 3) points; NaN if not before the camera."""
    z = np.where(xyz[..., 2] > 0, xyz[..., 2], np.nan).astype(np.float64)
    focal, centre = intrinsics[:, None, :2], intrinsics[:, None, 2:]
    return focal * xyz[..., :2] / z[..., None] + centre


def statistics_of(results: Results, is_counted: NDArray[np.bool_]) -> dict[str, Statistic]:
    """The measures as functions of how often each frame counts.

    Args:
        results: What a method answered.
        is_counted: (n, n_joints) bool, the group; joints without a truth are left out of it.

    Returns:
        By name, see `MEASURES`.
    """
    error, share = errors(results), errors_2d(results)
    is_counted = is_counted & ~np.isnan(error)
    is_found = is_counted & np.isfinite(error)
    # Of these alone: elsewhere the sums would meet infinities.
    found_cm = np.where(is_found, 100.0 * np.where(is_found, error, 0.0), 0.0)
    near = np.where(is_found, 1.0 - np.minimum(np.where(is_found, error, 0.0) / CURVE_END_M, 1.0), 0.0)
    has_share = is_counted & ~np.isnan(share)
    n, n_found = _per_frame(is_counted), _per_frame(is_found)
    return {
        "map_10cm": _average_precision(results, is_counted),
        "accuracy_10cm": Ratio(_per_frame(is_counted & (error <= WITHIN_M)), n),
        "accuracy_2d": Ratio(_per_frame(has_share & (share <= WITHIN_UPPER_BODY)), _per_frame(has_share)),
        "auc_20cm": Ratio(_per_frame(near), n),
        "mean_error_cm": Ratio(_per_frame(found_cm), n_found),
        "median_error_cm": Median.of(100.0 * error[is_counted], np.nonzero(is_counted)[0]),
        "missing": Ratio(_per_frame(is_counted & ~is_found), n),
    }


def _per_frame(values: NDArray) -> NDArray[np.float64]:
    return values.sum(axis=1, dtype=np.float64)


def _average_precision(results: Results, is_counted: NDArray[np.bool_]) -> MeanAveragePrecision:
    distance, confidence = distances(results), results.proposal_confidence
    joints = []
    for joint in range(len(results.truths.joints)):
        rows = np.flatnonzero(is_counted[:, joint])
        if len(rows):
            joints.append(rank_proposals(confidence[rows, joint], distance[rows, joint], rows, WITHIN_M))
    return MeanAveragePrecision(tuple(joints))


def summarise(results: Results, is_counted: NDArray[np.bool_], weights: FrameWeights) -> Summary:
    """All measures of a group with 95 % intervals.

    Args:
        results: What a method answered.
        is_counted: (n, n_joints) bool, the group.
        weights: (n_resamples, n) int16, resamples of the frames.
    """
    once = every_frame_once(len(results.truths))
    measures = {}
    for name, statistic in statistics_of(results, is_counted).items():
        estimate = float(statistic(once)[0])
        measures[name] = Measure(estimate, *interval(estimate, statistic(weights)))
    is_there = is_counted & ~np.isnan(errors(results))
    return Summary(int(is_there.any(axis=1).sum()), int(is_there.sum()), measures)


def accuracy_curve(results: Results, is_counted: NDArray[np.bool_]) -> NDArray[np.float64]:
    """(len(CURVE_CM),) float64, share of a group's joints within each distance; NaN for an empty group."""
    error = errors(results)
    error = error[is_counted & ~np.isnan(error)]
    if not len(error):
        return np.full(len(CURVE_CM), np.nan)
    return np.array([(100.0 * error <= cm).mean() for cm in CURVE_CM])
