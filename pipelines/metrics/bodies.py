"""What is right or wrong of a whole skeleton: which way it faces, and joints that lie on the other side's."""

import numpy as np
from numpy.typing import NDArray

from forests.skeleton.heading import facings_of
from forests.skeleton.kinematics import mirrored_joints
from pipelines.metrics.measures import Measure
from pipelines.metrics.resampling import FrameWeights, Median, Ratio, Statistic, every_frame_once, interval
from pipelines.metrics.results import Results

SWAPPED_M = 0.15
"""A joint nearer to the other side's true joint than this, and farther from its own, is swapped [m]."""

BODY_MEASURES = ("heading_flipped", "heading_error_deg", "swapped")
"""Share of frames whose heading is off by more than 90 degrees, median error of headings, share of joints that lie on
the other side's joint; of the joints that have another side."""


def measure_bodies(results: Results, weights: FrameWeights) -> dict[str, Measure]:
    """Measures of the first proposals as skeletons, by name, with 95 % intervals.

    Args:
        results: What a method answered.
        weights: (n_resamples, n_frames) int16, resamples of the frames.
    """
    once = every_frame_once(len(results.truths))
    measures = {}
    for name, statistic in _statistics(results).items():
        estimate = float(statistic(once)[0])
        measures[name] = Measure(estimate, *interval(estimate, statistic(weights)))
    return measures


def _statistics(results: Results) -> dict[str, Statistic]:
    joints, truths = results.proposals[:, :, 0], results.truths
    apart = _degrees_between(facings_of(joints, truths.joints), facings_of(truths.xyz, truths.joints))
    is_told = np.isfinite(apart)
    swapped, is_paired = _swapped(joints, truths.xyz, mirrored_joints(truths.joints))
    return {
        "heading_flipped": Ratio((is_told & (apart > 90.0)).astype(float), is_told.astype(float)),
        "heading_error_deg": Median.of(apart[is_told], np.flatnonzero(is_told)),
        "swapped": Ratio(swapped.sum(axis=1, dtype=float), is_paired.sum(axis=1, dtype=float)),
    }


def _degrees_between(facings: NDArray[np.float32], others: NDArray[np.float32]) -> NDArray[np.float64]:
    """(n,) float64, angles between cosines and sines (n, 2) [degrees]; NaN where one is not known."""
    cosine = np.clip((facings.astype(np.float64) * others).sum(axis=1), -1.0, 1.0)
    is_known = facings.any(axis=1) & others.any(axis=1)
    return np.where(is_known, np.degrees(np.arccos(cosine)), np.nan)


def _swapped(
    joints: NDArray[np.float32], truth: NDArray[np.float32], mirror: NDArray[np.int32]
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """(n, n_joints) bool, which joints lie on the other side's, and which can: both places are known."""
    own = np.linalg.norm(joints - truth, axis=2)
    other = np.linalg.norm(joints - truth[:, mirror], axis=2)
    is_paired = np.isfinite(truth).all(axis=2) & np.isfinite(truth[:, mirror]).all(axis=2)
    is_paired &= (mirror != np.arange(len(mirror)))[None]
    return is_paired & (other < SWAPPED_M) & ~(own < SWAPPED_M), is_paired
