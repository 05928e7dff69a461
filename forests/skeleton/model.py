"""What is learned about skeletons: bodies, a network that proposes all joints at once, rules, probabilities."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from forests.skeleton.heading import N_SECTORS
from forests.skeleton.network import Network
from forests.skeleton.prior import BodyPrior

TERMS = (
    "one",
    "within",
    "hidden",
    "is_filled",
    "gap",
    "log_scale",
    "share",
    "inside",
)
"""What the probabilities of a decoded joint are regressed on, in the order of the weights; see `decode_frame`."""
PERSON_TERMS = ("one", "within", "log_confidence", "body_share", "log_scale")
"""What the probability of a person is regressed on, in the order of the weights; see `decode_frame`."""
OUTCOMES = ("within", "hidden", "outside")
"""What a decoded joint's probabilities are of: within 10 cm, hidden by an object, not in the image."""


class Rules(NamedTuple):
    """How candidates are weighed against one another.

    Attributes:
        share: Weight of the logarithm of a candidate's share of its joint's confidence.
        trust: Weight of the logit of the forest's probability that its first proposal is near, against the place
            that the network proposes.
        limb: Weight of the limbs' lengths.
        gap: Weight of the distance from what the network proposes, in units of `reach_m`.
        reach_m: A candidate farther than this from what the network proposes is no better than that place [m].
    """

    share: float
    trust: float
    limb: float
    gap: float
    reach_m: float


@dataclass(frozen=True)
class SkeletonModel:
    """What makes one skeleton out of a forest's proposals.

    Attributes:
        prior: What bodies are like.
        trunk: Places of the joints that all others are seen from.
        network: Proposes all joints at once; one without weights proposes nothing, so that decoding goes by the
            forest's modes and the prior alone.
        rules: How candidates are weighed.
        weights: (n_outcomes, n_joints, n_terms) float32, logistic regressions of what is in `OUTCOMES`; NaN = not
            calibrated.
        person_weights: (n_person_terms,) float32, of whether a person is in the image; NaN = not calibrated.
    """

    prior: BodyPrior
    trunk: NDArray[np.int32]
    network: Network
    rules: Rules
    weights: NDArray[np.float32]
    person_weights: NDArray[np.float32]


class Decoded(NamedTuple):
    """What was made of one frame, or of n frames with a leading axis.

    Attributes:
        joints: (n_joints, 3) float32, camera frame [m]; NaN = nowhere.
        choice: (n_joints,) int64, the proposal that was taken, -1 = what the network proposed or nothing.
        terms: (n_joints, n_terms) float64, see `TERMS`.
        sectors: (n_sectors,) float32, probabilities of headings, alike if there is no network.
        person: (n_person_terms,) float64, see `PERSON_TERMS`; NaN if nothing is proposed.
    """

    joints: NDArray[np.float32]
    choice: NDArray[np.int64]
    terms: NDArray[np.float64]
    sectors: NDArray[np.float32]
    person: NDArray[np.float64]


def room_for(*shape: int) -> Decoded:
    """Arrays to fill.

    Args:
        shape: (n_joints,), or (n, n_joints) for n frames.
    """
    return Decoded(
        np.empty((*shape, 3), np.float32),
        np.empty(shape, np.int64),
        np.empty((*shape, len(TERMS)), np.float64),
        np.empty((*shape[:-1], N_SECTORS), np.float32),
        np.empty((*shape[:-1], len(PERSON_TERMS)), np.float64),
    )
