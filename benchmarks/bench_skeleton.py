"""Time of making one skeleton out of a forest's proposals, by its steps; the target is 0.1 ms a frame on one core.

Usage: python benchmarks/bench_skeleton.py
"""

import time
from collections.abc import Callable

import numpy as np

from forests.estimate import JointEstimate
from forests.frames import Intrinsics
from forests.skeleton.answers import N_CANDIDATES, Answers, edges_of
from forests.skeleton.decode import choose_candidates, limit_limbs
from forests.skeleton.decoded import decoded, headings_of
from forests.skeleton.features import n_features, trunk_of
from forests.skeleton.kinematics import SKELETON
from forests.skeleton.learn import BESIDE_NETWORK, decode_all
from forests.skeleton.model import OUTCOMES, PERSON_TERMS, TERMS, SkeletonModel
from forests.skeleton.network import ask_network, new_network
from forests.skeleton.prior import measure_bodies
from forests.skeleton.proposal import N_HIDDEN, n_outputs

NAMES = tuple(name for name, _ in SKELETON)
CAMERA, SHAPE = Intrinsics(365.0, 365.0, 255.5, 211.5), (424, 512)
N_FRAMES = 200


def cpu_us(work: Callable[[], object], n: int) -> float:
    """Best of seven: CPU time of one of n things [us]; compiled before."""
    work()
    best = np.inf
    for _ in range(7):
        begun = time.process_time()
        work()
        best = min(best, time.process_time() - begun)
    return 1e6 * best / n


def main() -> None:
    rng = np.random.default_rng(0)
    n = len(NAMES)
    joints = rng.normal((0, 0, 3), 0.3, (N_FRAMES, n, 3)).astype(np.float32)
    proposals = joints[:, :, None] + rng.normal(0, 0.1, (N_FRAMES, n, N_CANDIDATES, 3))
    confidence = -np.sort(-rng.random((N_FRAMES, n, N_CANDIDATES)), axis=2)
    within, hidden, spread = rng.random((3, N_FRAMES, n))
    edges = np.tile(edges_of(SHAPE, CAMERA), (N_FRAMES, 1))
    told = (proposals, confidence, within, hidden, spread, edges, np.zeros((N_FRAMES, 2)), np.ones(N_FRAMES))
    answers = Answers(*(values.astype(np.float32) for values in told))
    prior, network = measure_bodies(joints, NAMES), new_network(n_features(n), N_HIDDEN, n_outputs(n), rng)
    weights = rng.normal(0, 0.1, (len(OUTCOMES), n, len(TERMS))).astype(np.float32)
    of_person = rng.normal(0, 0.1, len(PERSON_TERMS)).astype(np.float32)
    model = SkeletonModel(prior, trunk_of(NAMES), network, BESIDE_NETWORK, weights, of_person)
    estimates = [
        JointEstimate(*(values[k] for values in answers[:5]), CAMERA)  # type: ignore[arg-type]
        for k in range(N_FRAMES)
    ]
    features, out = (
        rng.normal(0, 1, (2, n_features(n))).astype(np.float32),
        np.empty((2, n_outputs(n)), np.float32),
    )
    score, choice = rng.normal(0, 1, (n, N_CANDIDATES + 1)), np.empty(n, np.int64)
    candidates = rng.normal(0, 0.3, (n, N_CANDIDATES + 1, 3)).astype(np.float32)
    steps = {
        "network": lambda: [ask_network(network, features, out) for _ in range(N_FRAMES)],
        "dynamic programming": lambda: [
            choose_candidates(candidates, score, prior, 0.1, choice) for _ in range(N_FRAMES)
        ],
        "limits of limbs": lambda: [
            limit_limbs(candidates[:, 0].copy(), np.ones(n), prior) for _ in range(N_FRAMES)
        ],
        "headings, from estimate to headings": lambda: [headings_of(model, each, SHAPE) for each in estimates],
        "all of it, in a kernel": lambda: decode_all(model, answers),
        "all of it, from estimate to estimate": lambda: [decoded(model, each, SHAPE, 3) for each in estimates],
    }
    for name, work in steps.items():
        print(f"{name:<40}{cpu_us(work, N_FRAMES):7.1f} us a frame")


if __name__ == "__main__":
    main()
