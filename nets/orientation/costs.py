"""The costs that orientation nets are trained with."""

import math
from collections.abc import Callable, Mapping

import torch
from torch import Tensor
from torch.nn import functional

Cost = Callable[[Tensor, Tensor, Tensor, float], Tensor]
"""From what the net puts out (n, n_angle), the true angles (n,) [rad], their sectors (n,) and kappa to (n,) costs."""


def biternion_von_mises(raw: Tensor, angle: Tensor, sector: Tensor, kappa: float) -> Tensor:
    """Beyer et al. 2015, equation 6."""
    return 1.0 - torch.exp(kappa * (_dot(raw, angle) - 1.0))


def biternion_cosine(raw: Tensor, angle: Tensor, sector: Tensor, kappa: float) -> Tensor:
    """Beyer et al. 2015, equation 3, of unit vectors."""
    return 1.0 - _dot(raw, angle)


def von_mises(raw: Tensor, angle: Tensor, sector: Tensor, kappa: float) -> Tensor:
    """Beyer et al. 2015, equation 2."""
    return 1.0 - torch.exp(kappa * (torch.cos(raw[:, 0] - angle) - 1.0))


def regression(raw: Tensor, angle: Tensor, sector: Tensor, kappa: float) -> Tensor:
    """The absolute deviation of numbers that know of no circle (Beyer et al. 2015, section 3.2)."""
    return (raw[:, 0] - angle).abs()


def classes(raw: Tensor, angle: Tensor, sector: Tensor, kappa: float) -> Tensor:
    """The negative log-likelihood of the sector."""
    return functional.cross_entropy(raw, sector, reduction="none")


COSTS: Mapping[str, Cost] = {
    "biternion_von_mises": biternion_von_mises,
    "biternion_cosine": biternion_cosine,
    "von_mises": von_mises,
    "regression": regression,
    "softmax_interpolated": classes,
    "softmax_centres": classes,
}
"""By output."""


def _dot(raw: Tensor, angle: Tensor) -> Tensor:
    return raw[:, 0] * torch.cos(angle) + raw[:, 1] * torch.sin(angle)


def concentration_cost(log_kappa: Tensor, error: Tensor) -> Tensor:
    """(n,) negative log-likelihoods of errors (n,) [rad] under von Mises distributions."""
    kappa = torch.exp(log_kappa)
    return kappa * (1.0 - torch.cos(error)) + torch.log(2.0 * math.pi * torch.special.i0e(kappa))


def posture_cost(logits: Tensor, posture: Tensor) -> Tensor:
    """Mean negative log-likelihood of the postures (n,) that are known; 0 if none is."""
    is_known = posture >= 0
    if not bool(is_known.any()):
        return logits.sum() * 0.0
    return functional.cross_entropy(logits[is_known], posture[is_known])


def tilt_roll_cost(given: Tensor, true: Tensor) -> Tensor:
    """Mean absolute deviation of the tilts and rolls (n, 2) [rad] that are known; 0 if none is."""
    is_known = torch.isfinite(true)
    if not bool(is_known.any()):
        return given.sum() * 0.0
    return (given - torch.nan_to_num(true))[is_known].abs().mean()
