"""Answers of invented methods on invented frames."""

from dataclasses import replace

import numpy as np

from pipelines.metrics import every_frame_once, statistics_of
from pipelines.metrics.results import Results, Truths

JOINTS = ("head", "neck", "torso")


def truths_of(n=60, seed=0, joints=JOINTS):
    rng = np.random.default_rng(seed)
    state = rng.choice(4, (n, len(joints)), p=(0.6, 0.25, 0.1, 0.05)).astype(np.uint8)
    return Truths(
        joints=joints,
        occluders=("none", "table", "laptop"),
        families=("desk", "free"),
        frame=np.arange(n) * 3,
        intrinsics=np.tile([365.0, 365.0, 255.5, 211.5], (n, 1)),
        upper_body_px=rng.uniform(50, 100, n).astype(np.float32),
        visible_fraction=rng.choice([0.2, 0.6, 1.0], n).astype(np.float32),
        family=rng.integers(0, 2, n).astype(np.uint8),
        object_classes=rng.choice([0, 2, 4, 6], n).astype(np.uint16),
        xyz=(rng.normal(size=(n, len(joints), 3)) * 0.3 + [0, 0, 2.5]).astype(np.float32),
        state=state,
        hiding_class=np.where(state == 1, rng.integers(1, 3, state.shape), 0).astype(np.uint8),
    )


def results_of(truths, error=0.05, seed=1, k=3, missing=0.05, ties=False, method="forest"):
    rng = np.random.default_rng(seed)
    shape = truths.state.shape
    proposals = truths.xyz[:, :, None] + rng.normal(size=(*shape, k, 3)).astype(np.float32) * error
    confidence = -np.sort(-rng.random((*shape, k)), axis=2)
    confidence = (np.ceil(confidence * 5) / 5 if ties else confidence).astype(np.float32)
    n_made = np.where(rng.random(shape) < missing, 0, rng.integers(1, k + 1, shape))
    is_missing = np.arange(k) >= n_made[..., None]
    proposals[is_missing], confidence[is_missing] = np.nan, 0
    unknown = np.full(shape, np.nan, np.float32)
    seconds = np.full(len(truths), 0.001, np.float32)
    return Results(method, truths, proposals.astype(np.float32), confidence, unknown, unknown, seconds)


def perfect(truths):
    return replace(results_of(truths, k=1, missing=0), proposals=truths.xyz[:, :, None].copy())


def all_joints(truths):
    return np.ones(truths.state.shape, bool)


def measured(results, is_counted=None):
    is_counted = all_joints(results.truths) if is_counted is None else is_counted
    once = every_frame_once(len(results.truths))
    return {name: float(f(once)[0]) for name, f in statistics_of(results, is_counted).items()}
