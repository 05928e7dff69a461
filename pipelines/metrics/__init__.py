"""Scores of joints and pixels: measures, groups, intervals, paired tests; docs/metrics.md defines them."""

from pipelines.metrics.comparing import Difference, compare, compare_seeds
from pipelines.metrics.groups import (
    Groups,
    by_family,
    by_hiding_class,
    by_joint,
    by_object_in_frame,
    by_state,
    by_visible_fraction,
)
from pipelines.metrics.measures import (
    CURVE_CM,
    MEASURES,
    Measure,
    Summary,
    accuracy_curve,
    distances,
    errors,
    errors_2d,
    statistics_of,
    summarise,
)
from pipelines.metrics.pixels import Confusion, count_pixels
from pipelines.metrics.precision import MeanAveragePrecision, rank_proposals
from pipelines.metrics.resampling import N_RESAMPLES, draw_frames, every_frame_once, interval
from pipelines.metrics.truths import read_truths

__all__ = [
    "CURVE_CM",
    "MEASURES",
    "N_RESAMPLES",
    "Confusion",
    "Difference",
    "Groups",
    "MeanAveragePrecision",
    "Measure",
    "Summary",
    "accuracy_curve",
    "by_family",
    "by_hiding_class",
    "by_joint",
    "by_object_in_frame",
    "by_state",
    "by_visible_fraction",
    "compare",
    "compare_seeds",
    "count_pixels",
    "distances",
    "draw_frames",
    "errors",
    "errors_2d",
    "every_frame_once",
    "interval",
    "rank_proposals",
    "read_truths",
    "statistics_of",
    "summarise",
]
