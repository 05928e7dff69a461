"""A trained heat map net: its settings, weights and calibration, as plain arrays."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nets.heatmap.config import CELL_MIDDLE, STATES, STRIDE, HeatmapConfig
from nets.heatmap.decode import Peaks
from nets.views import View

OUTCOMES = ("within", *STATES[1:])
"""What the calibrated probabilities are of: the first proposal is within 10 cm, and the states but the first."""
N_TERMS = 3 + len(STATES) - 1


@dataclass(frozen=True)
class HeatmapModel:
    """A trained net.

    Attributes:
        config: How it was trained.
        joints: Names of the joints that it finds.
        weights: Arrays by the name of the torch module's parameter or buffer.
        calibration: (n_outcomes, n_joints, N_TERMS) float32, weights of logistic regressions, in the order of
            `OUTCOMES`; NaN if not calibrated.
    """

    config: HeatmapConfig
    joints: tuple[str, ...]
    weights: dict[str, np.ndarray]
    calibration: NDArray[np.float32]


def terms_of(peaks: Peaks, state: NDArray[np.float32]) -> NDArray[np.float64]:
    """(n_joints, N_TERMS): what the calibrated probabilities are told of.

    Args:
        peaks: Of the maps.
        state: (4, n_joints) logits that the net puts out.
    """
    heat = np.log(np.maximum(peaks.heat[:, 0], 1e-6))
    spread = np.log(np.maximum(peaks.spread, 0.05))
    return np.stack([np.ones(len(heat)), heat, spread, *(state[1:] - state[:1])], axis=1).astype(np.float64)


def patch_places(peaks: Peaks, view: View) -> NDArray[np.float64]:
    """(n_joints, N_PEAKS, 3) rows and columns in the patch [px] and depths [m] of peaks in maps of the middle crop."""
    places = peaks.place.astype(np.float64)
    places[:, :, :2] = places[:, :, :2] * STRIDE + CELL_MIDDLE + view.margin
    return places
