"""One skeleton out of what several cameras say of the same person at the same time."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class FusionConfig:
    """How joints of several cameras are put together.

    Attributes:
        across_m: Standard deviation of a good answer along each axis across the viewing ray [m].
        along_m: Likewise along the ray, where the surface hides how deep in the body a joint lies [m]. Both are of a
            regression forest's answers within 15 cm, see docs/metrics.md.
        reach_m: Answers farther apart than about this are answers to different questions: the more probable ones
            are believed, and no mean is taken [m].
        n_steps: Of the search for the place that most is in favour of.
    """

    across_m: float = 0.037
    along_m: float = 0.041
    reach_m: float = 0.1
    n_steps: int = 20

    def __post_init__(self) -> None:
        for name in ("across_m", "along_m", "reach_m", "n_steps"):
            if not getattr(self, name) > 0:
                raise ValueError(f"{name}={getattr(self, name)} must be above 0")


def fuse(
    joints: Array, probability: Array, eyes: Array, config: FusionConfig = FusionConfig()
) -> tuple[Array, Array]:
    """Puts the joints of several cameras together.

    An answer counts as much as its probability times its information, the inverse of a covariance that is longer
    along the camera's ray. The fused place is the mode that mean shift reaches from the answer that most of the others,
    by probability, lie near; so an answer far off has no say, and the mean of two that contradict one another is never
    taken. The order of the cameras does not matter, the same answer several times is as good as once, and an answer of
    probability 0 is as good as none.

    Args:
        joints: (n_views, n_joints, 3) world frame [m]; NaN = not found.
        probability: (n_views, n_joints) in 0..1, that each is right.
        eyes: (n_views, 3) where the cameras are, world frame [m].
        config: How.

    Returns:
        (n_joints, 3) world frame [m], NaN where no camera has an answer; and (n_joints,) how probable it is: the mean
        of the probabilities, weighted by themselves and by how near each answer is.

    Raises:
        ValueError: Other shapes, or a probability that is none.
    """
    joints, probability, eyes = (np.asarray(values, dtype=np.float64) for values in (joints, probability, eyes))
    if joints.ndim != 3 or joints.shape[2] != 3 or probability.shape != joints.shape[:2]:
        raise ValueError(
            f"joints {joints.shape} and probability {probability.shape} must be (n_views, n_joints, 3) and "
            "(n_views, n_joints)"
        )
    if eyes.shape != (len(joints), 3):
        raise ValueError(f"eyes {eyes.shape} must be ({len(joints)}, 3)")
    is_told = np.isfinite(joints.sum(axis=2))
    weight = np.where(is_told, probability, 0.0)
    if not np.logical_and(weight >= 0.0, weight <= 1.0).all():
        raise ValueError(f"probabilities {weight.min():.3g}..{weight.max():.3g} must be in 0..1")
    places = np.where(is_told[..., None], joints, 0.0)
    information = _information(places - eyes[:, None], config)
    return _mode(places, weight, information, config)


def _information(rays: Array, config: FusionConfig) -> Array:
    """(n_views, n_joints, 3, 3) inverse covariances of answers at the ends of rays from the cameras [1/m^2]."""
    unit = rays / np.maximum(np.linalg.norm(rays, axis=-1, keepdims=True), 1e-9)
    along = unit[..., :, None] * unit[..., None, :]
    return (np.eye(3) - along) / config.across_m**2 + along / config.along_m**2


def _mode(places: Array, weight: Array, information: Array, config: FusionConfig) -> tuple[Array, Array]:
    """Mean shift from the best answer of each joint."""
    # How near answers are counts in metres, like the reach, and not in standard deviations: the errors that tell a
    # wrong answer from a right one are not those of good answers.
    apart = ((places[:, None] - places[None]) ** 2).sum(axis=-1)
    votes = (weight[None] * _near(apart, config)).sum(axis=1) * (weight > 0.0)
    at = np.take_along_axis(places, votes.argmax(axis=0)[None, :, None], axis=0)[0]
    is_known = weight.max(axis=0, initial=0.0) > 0.0
    share = weight
    for _ in range(config.n_steps):
        share = weight * _near(((places - at) ** 2).sum(axis=-1), config)
        total = (share[..., None, None] * information).sum(axis=0)
        pull = (share[..., None] * (information @ places[..., None])[..., 0]).sum(axis=0)
        at[is_known] = np.linalg.solve(total[is_known], pull[is_known][..., None])[..., 0]
    told = (share * weight).sum(axis=0) / np.where(is_known, share.sum(axis=0), 1.0)
    return np.where(is_known[:, None], at, np.nan), np.where(is_known, told, 0.0)


def _near(square: Array, config: FusionConfig) -> Array:
    """0..1, how much an answer so far away counts; by the square of the distance [m^2]."""
    return np.exp(-square / (2.0 * config.reach_m**2))
