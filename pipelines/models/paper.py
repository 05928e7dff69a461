"""Figures of Rafi et al. 2015 that the page shows beside its own."""

from collections.abc import Mapping
from typing import NamedTuple


class DetectionAccuracy(NamedTuple):
    """A row of table 2: percent of joints found in the image.

    Attributes:
        occluded: Joints that an object hides.
        non_occluded: All others.
        all: Both.
    """

    occluded: float
    non_occluded: float
    all: float


TRAINED_ON_SYNTHETIC: Mapping[str, DetectionAccuracy] = {
    "baseline": DetectionAccuracy(22.17, 50.51, 44.54),
    "occluders": DetectionAccuracy(24.36, 52.57, 46.62),
    "semantic": DetectionAccuracy(25.42, 52.43, 46.73),
}
"""Table 2, synthetic training data, real test data."""
TRAINED_ON_BOTH: Mapping[str, DetectionAccuracy] = {
    "baseline": DetectionAccuracy(28.62, 55.02, 49.45),
    "occluders": DetectionAccuracy(32.60, 55.50, 50.66),
    "semantic": DetectionAccuracy(35.77, 56.01, 51.72),
}
"""Table 2, real and synthetic training data, real test data."""

N_TRAIN, N_TEST, N_TEST_SUBJECTS = 1110, 440, 2
N_TREES, MAX_DEPTH, N_PIXELS, N_CANDIDATES, BANDWIDTH_M = 3, 20, 1000, 2000, 0.05
"""Sections 4 and 5."""
