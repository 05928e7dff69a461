"""What is chosen on validation frames: where walks start, how long steps are, what counts, and probabilities."""

import itertools
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from forests.boxes import BOX_MARGIN_M, upper_body_box
from forests.calibration import WITHIN_M, fit_logistic
from forests.frames import FrameSequence, is_known
from forests.rwf.model import RWFModel, walk_tables
from forests.rwf.skeleton import chosen_joints
from forests.rwf.start import start_point
from forests.rwf.walk import WalkPlan, WalkTables, walk_joint

STEP_COUNTS = (7, 10, 14, 20)
"""Beside the config's own number of steps."""
WORTH = 0.002
"""Fewer steps in all are taken if they lose no more than this share of the joints."""
DECAYS = (0.95, 1.0)
ARRIVING_SHARES = (0.25, 0.5, 0.75)
CLUSTERS = (2, 4, 8)
"""With one alone, walks side by side would be the same walk."""
_START_STREAM = 0x57A7


class View(NamedTuple):
    """One frame to walk in.

    Attributes:
        depth: (height, width) uint16 [mm].
        intrinsics: (4,) float32, (fx, fy, cx, cy) [px].
        start: (3,) float32, camera frame [m].
        joints: (n_joints, 3) float32, the experts' joints, camera frame [m]; NaN = unknown.
    """

    depth: NDArray[np.uint16]
    intrinsics: NDArray[np.float32]
    start: NDArray[np.float32]
    joints: NDArray[np.float32]


def views_of(
    frames: FrameSequence,
    joints: tuple[str, ...],
    box_joints: tuple[str, ...],
    margin_m: float = BOX_MARGIN_M,
    noise_m: float = 0.0,
) -> list[View]:
    """Frames with their walks' starts; frames that show nothing are left out.

    Args:
        frames: The frames.
        joints: Names of the experts' joints.
        box_joints: Joints in the upper-body box, in the middle of which walks start; those that a frame knows.
        margin_m: Of the box [m].
        noise_m: Standard deviation of the starts across the line of sight, along each axis [m].
    """
    places = chosen_joints(frames.labels.joints, joints)
    inside = chosen_joints(frames.labels.joints, box_joints)
    views = []
    for index in range(len(frames)):
        frame = frames[index]
        box = upper_body_box(frame.joints[inside], frame.camera, margin_m)
        start = start_point(frame.depth, frame.camera, box=box)
        if start is not None:
            camera = frame.camera
            intrinsics = np.array([camera.fx, camera.fy, camera.cx, camera.cy], np.float32)
            start[:2] += np.random.default_rng([_START_STREAM, index]).normal(0.0, noise_m, 2)
            views.append(View(frame.depth, intrinsics, start, frame.joints[places]))
    return views


def tune(model: RWFModel, frames: FrameSequence) -> RWFModel:
    """Learns on frames that a forest was not trained on how its experts walk and how probable their answers are.

    Walks start in the middle of the true upper-body box, as far off as the config's `box_noise_m` says; frames
    that show nothing are left out.

    Args:
        model: A forest, tuned or not.
        frames: Validation frames.
    """
    config = model.config
    return choose_walks(model, views_of(frames, model.joints, config.box_joints, noise_m=config.box_noise_m))


def choose_walks(model: RWFModel, views: list[View]) -> RWFModel:
    """Chooses how the experts walk, joint by joint from the parents on, and how probable their answers are.

    What a joint's walks are judged by are the frames that know it; where none does, they go on as the config has
    them, without a probability.

    Args:
        model: A trained forest.
        views: Validation frames.
    """
    if not views:
        return model
    most = model.config.n_clusters
    tried = [
        _choose(model, views, model.plan._replace(n_walks=n_walks, n_steps=n_steps, n_clusters=most))
        for n_walks, n_steps in step_budgets(model.config.n_walks, model.config.n_steps)
    ]
    best = least_worth([choice.score for choice in tried], WORTH * len(model.joints))
    tried = tried[best : best + 1]
    tried += [_choose(model, views, tried[0].plan._replace(n_clusters=n)) for n in CLUSTERS if n < most]
    plan, points, spread = max(tried, key=lambda choice: choice.score)[1:]
    truth = np.stack([view.joints for view in views])
    is_within = np.linalg.norm(points - truth, axis=2) <= WITHIN_M
    weights = np.full((len(model.joints), 2), np.nan, np.float32)
    has_truth = is_known(truth)
    for joint in np.flatnonzero(has_truth.any(axis=0)):
        rows = has_truth[:, joint]
        terms = np.stack([np.ones(rows.sum()), spread[rows, joint].astype(np.float64)], axis=1)
        weights[joint] = fit_logistic(terms, is_within[rows, joint])
    return replace(model, plan=plan, within_weights=weights)


def step_budgets(n_walks: int, n_steps: int) -> list[tuple[int, int]]:
    """Pairs (walks, steps) to choose from, those that cost least first.

    None makes more than `n_walks * n_steps` steps in all, or has more than `n_walks` walks.
    """
    most = n_walks * n_steps
    numbers = {n for n in STEP_COUNTS if n <= most} | {n_steps}
    return sorted(((min(n_walks, most // n), n) for n in numbers), key=lambda pair: (pair[0] * pair[1], pair[1]))


def least_worth(scores: list[float], loss: float) -> int:
    """The first of the scores that is no more than `loss` below the best."""
    return next(i for i, score in enumerate(scores) if score >= max(scores) - loss)


class _Choice(NamedTuple):
    score: float
    plan: WalkPlan
    points: NDArray[np.float32]
    spread: NDArray[np.float32]


def _choose(model: RWFModel, views: list[View], counts: WalkPlan) -> _Choice:
    """The best plan with the walks, steps and clusters of `counts`, and where its walks end."""
    plan = counts._replace(**{name: getattr(counts, name).copy() for name in _CHOSEN})
    tables = walk_tables(model.experts, plan.n_clusters)
    points = np.zeros((len(views), len(model.joints), 3), np.float32)
    spread = np.zeros((len(views), len(model.joints)), np.float32)
    total = 0.0
    for joint in plan.order:
        best = -1.0
        for choice in _choices(model, views, int(joint), plan.n_steps):
            for name, value in zip(_CHOSEN, choice, strict=True):
                getattr(plan, name)[joint] = value
            ends, spreads = walk_views(tables, plan, int(joint), model.config.seed, views, points)
            score = _score(ends, views, int(joint))
            if score > best:
                best, kept = score, (choice, ends, spreads)
        for name, value in zip(_CHOSEN, kept[0], strict=True):
            getattr(plan, name)[joint] = value
        points[:, joint], spread[:, joint] = kept[1:]
        total += best
    return _Choice(total, plan, points, spread)


_CHOSEN = ("start_from", "step_m", "decay", "n_arriving")


def _choices(model: RWFModel, views: list[View], joint: int, n_steps: int) -> list[tuple[int, float, float, int]]:
    parent, config = int(model.limbs.parent[joint]), model.config
    if not any(np.isfinite(view.joints[joint]).all() for view in views):
        return [(parent, config.step_m, config.decay, min(config.n_arriving, n_steps - 1))]
    starts = (-1, parent) if parent >= 0 else (-1,)
    arriving = sorted({int(share * n_steps) for share in ARRIVING_SHARES})
    steps = [way / n_steps for way in config.ways_m]
    return list(itertools.product(starts, steps, DECAYS, arriving))


def walk_views(
    tables: WalkTables, plan: WalkPlan, joint: int, seed: int, views: list[View], points: NDArray[np.float32]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Walks to one joint in every view.

    Args:
        tables: The experts.
        plan: How to walk.
        joint: Which expert.
        seed: Of the walks.
        views: The frames.
        points: (n_views, n_joints, 3) float32, the joints that were walked to before [m].

    Returns:
        (n_views, 3) float32 expectations [m] and (n_views,) float32 standard deviations of the walks [m].
    """
    ends, spreads = np.empty((len(views), 3), np.float32), np.empty(len(views), np.float32)
    parent = plan.start_from[joint]
    for i, view in enumerate(views):
        start = view.start if parent < 0 else points[i, parent]
        spreads[i] = _walk(view.depth, view.intrinsics, tables, plan, joint, seed, start, ends[i])
    return ends, spreads


@njit(cache=True, nogil=True)
def _walk(
    depth: np.ndarray, intrinsics: np.ndarray, tables: WalkTables, plan: WalkPlan, joint: int, seed: int,
    start: np.ndarray, end: np.ndarray,
) -> float:  # fmt: skip
    """Fills the expectation and returns the spread of one joint's walks [m]."""
    points = np.empty((plan.n_walks, 3), np.float32)
    points[:] = start
    moments = np.empty(6, np.float64)
    walk_joint(depth, intrinsics, tables, plan, joint, seed, points, moments)
    end[:] = moments[:3]
    return np.sqrt(np.maximum(moments[3:] - moments[:3] ** 2, 0.0).sum())


def _score(ends: NDArray[np.float32], views: list[View], joint: int) -> float:
    """Share of the joints that are found, with a soft limit: from 1 at half of it to 0 at one and a half.

    Frames that do not know the joint are left out; 0 if none does.
    """
    error = np.linalg.norm(ends - np.stack([view.joints[joint] for view in views]), axis=1)
    error = error[np.isfinite(error)]
    return float(np.clip(1.5 - error / WITHIN_M, 0.0, 1.0).mean()) if len(error) else 0.0
