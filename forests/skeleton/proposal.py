"""All joints at once out of all joints' modes: a network that has learned how forests err."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from forests.frames import is_known
from forests.skeleton.answers import Answers
from forests.skeleton.features import N_OF_IMAGE, N_OF_JOINT, middle_of, n_features, write_features
from forests.skeleton.heading import N_SECTORS, sectors_of
from forests.skeleton.network import Network, Trainer, ask_network, new_network

N_HIDDEN = 256
LEAST_STEPS, MOST_STEPS = 2000, 12000
"""Of training, one for each answer that is learned from, within these bounds."""
N_BATCH = 128
RATE = 1e-3
DROPOUT, DECAY = 0.2, 0.02
HUBER_M = 0.1
"""Errors below this one are squared in the loss; those above count by their size [m]."""
LEAST_SCALE_M, MOST_SCALE_M = 0.02, 0.5
"""Of the error that the network expects of its own answer [m]."""
TURN, SIZE, SHIFT_M, NOISE_M = 0.15, 0.05, 0.03, 0.01
"""Standard deviations of what training frames are turned about the vertical by [rad], made larger by, seen from
beside the middle by, and of noise on each proposal."""
HEADING_WEIGHT = 1.0
"""Of the heading's cross-entropy, beside losses of up to 1 a joint."""
_ACROSS = np.array([1.0, -1.0], np.float32)


class Batch:
    """Answers and truths as the network learns from them: around the trunk's middle, varied at random."""

    def __init__(
        self,
        answers: Answers,
        joints: NDArray[np.float32],
        facings: NDArray[np.float32],
        mirror: NDArray[np.int32],
        trunk: NDArray,
    ) -> None:
        self.answers, self.joints, self.facings, self.mirror, self.trunk = answers, joints, facings, mirror, trunk

    def draw(
        self, rng: np.random.Generator, n: int
    ) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
        """Answers of frames drawn at random, and what is true in them.

        Returns:
            Features (n, n_features), joints around the middle (n, n_joints, 3) [m], sectors (n, N_SECTORS).
        """
        rows = rng.integers(len(self.joints), size=n)
        answers = Answers(*(values[rows] for values in self.answers))
        joints, facings = self.joints[rows], self.facings[rows]
        if rng.random() < 0.5:
            answers, joints = mirrored_answers(answers, self.mirror), mirrored(joints, self.mirror)
            facings = facings * _ACROSS
        middle = np.empty((n, 3), np.float32)
        middles_of(answers.proposals, self.trunk, middle)
        size = np.exp(rng.normal(0.0, SIZE, n)).astype(np.float32)
        turn = rng.normal(0.0, TURN, n)
        noise = rng.normal(0.0, NOISE_M, answers.proposals.shape).astype(np.float32)
        proposals = turned(answers.proposals, middle, turn, size) + noise
        joints = turned(joints, middle, turn, size)
        seen_from = middle * size[:, None] + rng.normal(0.0, SHIFT_M, (n, 3)).astype(np.float32)
        features = np.empty((n, n_features(joints.shape[1])), np.float32)
        answers = answers._replace(proposals=proposals, facing=turned_facings(answers.facing, turn))
        features_of(answers, seen_from, features)
        return features, joints - seen_from[:, None], sectors_of(turned_facings(facings, turn))


def turned_facings(facings: NDArray[np.float32], turn: NDArray[np.float64]) -> NDArray[np.float32]:
    """Facings (n, 2) of people who have turned about the vertical as in `turned`."""
    cos, sin = np.cos(turn), np.sin(turn)
    x, y = facings.T
    return np.stack([cos * x + sin * y, cos * y - sin * x], axis=1).astype(np.float32)


def turned(
    places: NDArray[np.float32], middle: NDArray[np.float32], turn: NDArray[np.float64], size: NDArray[np.float32]
) -> NDArray[np.float32]:
    """Places (n, ..., 3) turned about the vertical through the middles (n, 3), and all made larger [m]."""
    shape = (len(places),) + (1,) * (places.ndim - 2)
    cos, sin = (f(turn).astype(np.float32).reshape(shape) for f in (np.cos, np.sin))
    base = middle.reshape(*shape, 3)
    gap = places - base
    out = np.stack([cos * gap[..., 0] + sin * gap[..., 2], gap[..., 1], cos * gap[..., 2] - sin * gap[..., 0]], -1)
    return (out + base) * size.reshape(*shape, 1)


def mirrored(places: NDArray[np.float32], mirror: NDArray[np.int32]) -> NDArray[np.float32]:
    """Places (n, n_joints, ..., 3) as a mirror across the camera's axis shows them, left for right."""
    return places[:, mirror] * np.array([-1.0, 1.0, 1.0], np.float32)


def mirrored_answers(answers: Answers, mirror: NDArray[np.int32]) -> Answers:
    """Answers about the mirrored frames, of a forest that does not tell a body from its mirror image."""
    sides = answers.edges[:, [2, 1, 0, 3]] * np.array([-1, 1, -1, 1], np.float32)
    confidence, within, hidden, spread = (values[:, mirror] for values in answers[1:5])
    proposals = mirrored(answers.proposals, mirror)
    facing = answers.facing * _ACROSS
    return Answers(proposals, confidence, within, hidden, spread, sides, facing, answers.body_share)


@njit(cache=True, nogil=True)
def middles_of(proposals: np.ndarray, trunk: np.ndarray, middle: np.ndarray) -> None:
    """Fills (n, 3) middles of (n, n_joints, n_proposals, 3) proposals."""
    for i in range(len(proposals)):
        middle_of(proposals[i], trunk, middle[i])


@njit(cache=True, nogil=True)
def features_of(answers: Answers, middle: np.ndarray, features: np.ndarray) -> None:
    """Fills (n, n_features) of many answers seen from their middles (n, 3)."""
    for i in range(len(middle)):
        write_features(
            answers.proposals[i], answers.confidence[i], answers.within[i], answers.hidden[i], answers.spread[i],
            answers.edges[i], answers.facing[i], middle[i], features[i],
        )  # fmt: skip


def n_outputs(n_joints: int) -> int:
    """Answers of a network: a place and the logarithm of its scale for each joint, and logits of the sectors."""
    return 4 * n_joints + N_SECTORS


def train_proposal(
    answers: Answers,
    joints: NDArray[np.float32],
    facings: NDArray[np.float32],
    mirror: NDArray[np.int32],
    trunk: NDArray[np.int32],
    seed: int,
) -> Network:
    """Learns where joints are, how far off that will be, and headings, from a forest's answers on frames new to it.

    The loss of a joint with error e [m] and scale s: e / s + 3 log s for the scale, with a Huber loss for the place.
    Headings are classified into sectors, with cross-entropy.

    Args:
        answers: On the frames.
        joints: (n, n_joints, 3) float32, true joints, camera frame [m]; NaN = unknown.
        facings: (n, 2) float32, cosines and sines of true headings; zeros = unknown.
        mirror: The joint on the other side of each.
        trunk: Places of the trunk's joints.
        seed: Of weights, drops and variations.
    """
    rng = np.random.default_rng(seed)
    n_joints = joints.shape[1]
    batch = Batch(answers, joints, facings, mirror, trunk)
    network = new_network(n_features(n_joints), N_HIDDEN, n_outputs(n_joints), rng)
    trainer = Trainer(network, rng, DROPOUT, DECAY)
    n_steps = min(max(len(joints), LEAST_STEPS), MOST_STEPS)
    for step in range(n_steps):
        features, wanted, sectors = batch.draw(rng, N_BATCH)
        answer = trainer.forward(features)
        gradient = np.empty_like(answer)
        of_joints = answer[:, : 4 * n_joints].reshape(N_BATCH, n_joints, 4)
        gradient[:, : 4 * n_joints] = _slopes(of_joints, wanted).reshape(N_BATCH, -1)
        gradient[:, 4 * n_joints :] = HEADING_WEIGHT * _sector_slopes(answer[:, 4 * n_joints :], sectors)
        trainer.step(gradient / np.float32(N_BATCH), RATE * 0.5 * (1.0 + np.cos(np.pi * step / n_steps)))
    return network


def _sector_slopes(logits: NDArray[np.float32], wanted: NDArray[np.float32]) -> NDArray[np.float32]:
    """Gradient of the cross-entropy by logits (n, N_SECTORS); zeros where nothing is wanted."""
    share = np.exp(logits - logits.max(axis=1, keepdims=True))
    share /= share.sum(axis=1, keepdims=True)
    return np.where(wanted.any(axis=1, keepdims=True), share - wanted, np.float32(0.0))


def _slopes(answer: NDArray[np.float32], wanted: NDArray[np.float32]) -> NDArray[np.float32]:
    """Gradient of the joints' loss by the network's answers (n, n_joints, 4)."""
    out = np.zeros_like(answer)
    known = is_known(wanted)
    gap = np.where(known[..., None], answer[..., :3] - wanted, np.float32(0.0))
    error = np.sqrt((gap * gap).sum(axis=2))
    out[..., :3] = gap / np.maximum(error, np.float32(HUBER_M))[..., None]
    scale = np.exp(answer[..., 3])
    out[..., 3] = np.where(known, np.float32(0.1) * (3.0 - (error + 0.005) / (0.1 * scale)), np.float32(0.0))
    return out


@njit(cache=True, nogil=True)
def propose(
    network: Network, answers: Answers, at: int, mirror: np.ndarray, trunk: np.ndarray, places: np.ndarray,
    scale: np.ndarray, sectors: np.ndarray,
) -> int:  # fmt: skip
    """Asks a network about one image and its mirror image, so that left and right are treated alike.

    Args:
        network: The network.
        answers: A forest's.
        at: Which of them.
        mirror: The joint on the other side of each.
        trunk: Places of the trunk's joints.
        places: (n_joints, 3) float32 to fill, camera frame [m].
        scale: (n_joints,) float32 to fill: the error that is expected [m].
        sectors: (N_SECTORS,) float32 to fill: probabilities of headings.

    Returns:
        How many joints had a first proposal to start from; with 0 nothing is filled in.
    """
    n_joints = len(mirror)
    middle = np.empty(3, np.float32)
    n = middle_of(answers.proposals[at], trunk, middle)
    if n == 0:
        return 0
    features = np.empty((2, n_joints * N_OF_JOINT + N_OF_IMAGE), np.float32)
    write_features(
        answers.proposals[at], answers.confidence[at], answers.within[at], answers.hidden[at], answers.spread[at],
        answers.edges[at], answers.facing[at], middle, features[0],
    )  # fmt: skip
    _mirror_features(features[0], mirror, features[1])
    out = np.empty((2, 4 * n_joints + N_SECTORS), np.float32)
    ask_network(network, features, out)
    for joint in range(n_joints):
        other = mirror[joint]
        for axis in range(3):
            sign = np.float32(-1.0 if axis == 0 else 1.0)
            both = out[0, 4 * joint + axis] + sign * out[1, 4 * other + axis]
            places[joint, axis] = middle[axis] + np.float32(0.5) * both
        log_scale = np.float32(0.5) * (out[0, 4 * joint + 3] + out[1, 4 * other + 3])
        expected = np.float32(0.1) * np.exp(log_scale)
        scale[joint] = min(max(expected, np.float32(LEAST_SCALE_M)), np.float32(MOST_SCALE_M))
    total = np.float32(0.0)
    for k in range(N_SECTORS):
        logit = out[0, 4 * n_joints + k] + out[1, 4 * n_joints + (N_SECTORS - k) % N_SECTORS]
        sectors[k] = np.exp(min(max(np.float32(0.5) * logit, np.float32(-30.0)), np.float32(30.0)))
        total += sectors[k]
    sectors /= total
    return n


@njit(cache=True, nogil=True)
def _mirror_features(features: np.ndarray, mirror: np.ndarray, out: np.ndarray) -> None:
    """The features of the mirror image."""
    n_joints = len(mirror)
    for joint in range(n_joints):
        own, other = joint * N_OF_JOINT, mirror[joint] * N_OF_JOINT
        for k in range(N_OF_JOINT):
            is_across = k < N_OF_JOINT - 4 and k % 4 == 0
            out[own + k] = -features[other + k] if is_across else features[other + k]
    at = n_joints * N_OF_JOINT
    out[at : at + N_OF_IMAGE] = features[at : at + N_OF_IMAGE]
    out[at] = -features[at]
    out[at + 3], out[at + 5] = -features[at + 5], -features[at + 3]
    out[at + 8] = -features[at + 8]
