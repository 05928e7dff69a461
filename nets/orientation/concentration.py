"""Calibrates how sure an orientation net says it is, on frames that it has not learned from."""

import numpy as np
from numpy.typing import NDArray

from nets.orientation.angles import von_mises_log_density
from nets.orientation.model import Calibration

MOST_OUTLIERS = 0.5
_PRIOR = 2.0
"""Strength of the prior on slope and outliers, in frames."""


def negative_log_likelihood(
    calibration: Calibration, told: NDArray[np.floating], error: NDArray[np.floating]
) -> float:
    """Mean of minus the logarithm of the density of errors [1/rad].

    Args:
        calibration: How the told concentrations are read.
        told: (n,) logarithms that the net puts out.
        error: (n,) [rad].
    """
    inside = von_mises_log_density(error, calibration.concentration(told))
    share = calibration.outliers
    density = np.logaddexp(np.log1p(-share) + inside, np.log(max(share, 1e-12) / (2.0 * np.pi)))
    return float(-density.mean())


def calibrate(told: NDArray[np.floating], error: NDArray[np.floating]) -> Calibration:
    """The likeliest calibration; the net's own word where there are no frames.

    Args:
        told: (n,) logarithms that the net puts out.
        error: (n,) [rad].
    """
    if not len(told):
        return Calibration()
    from scipy.optimize import minimize

    def calibration_of(x: NDArray[np.float64]) -> Calibration:
        return Calibration(float(x[0]), float(np.exp(x[1])), float(MOST_OUTLIERS / (1.0 + np.exp(-x[2]))))

    def cost(x: NDArray[np.float64]) -> float:
        prior = _PRIOR / len(told) * (x[1] ** 2 + 0.05 * (x[2] + 3.0) ** 2)
        return negative_log_likelihood(calibration_of(x), told, error) + float(prior)

    found = minimize(cost, np.array([0.0, 0.0, -3.0]), method="Nelder-Mead", options={"maxiter": 2000})
    return calibration_of(found.x)
