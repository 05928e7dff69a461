"""What is chosen on validation frames: where walks start, how far walkers scatter, and probabilities."""

import itertools
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from forests.boxes import BOX_MARGIN_M, upper_body_box
from forests.calibration import WITHIN_M, fit_logistic_alike
from forests.frames import FrameSequence, Pinhole, is_known
from forests.rwf.evidence import OUTCOMES, TERMS
from forests.rwf.model import RWFModel, WalkPlan
from forests.rwf.predict import Predictor
from forests.rwf.skeleton import chosen_joints
from forests.rwf.start import seen_box, start_point
from forests.rwf.tables import WalkTables, walk_tables
from forests.rwf.walk import walk_joint
from forests.skeleton.answers import cut_frame, edges_of
from forests.skeleton.learn import is_outside

SCATTERS_M = (0.05, 0.1)
"""Standard deviations of the walkers that are tried, beside the config's own [m]."""
BANDWIDTHS_M = (0.07, 0.1, 0.15)
"""b of the votes' kernel that are tried, likewise [m]."""
ARRIVING = (0, 1, 2)
"""Numbers of first steps whose votes do not count, likewise."""
_START_STREAM = 0x57A7
_CUT_STREAM = 0xC075


class View(NamedTuple):
    """One frame to walk in.

    Attributes:
        depth: (height, width) uint16 [mm].
        intrinsics: (4,) float32, (fx, fy, cx, cy) [px].
        start: (3,) float32, camera frame [m].
        joints: (n_joints, 3) float32, the experts' joints, camera frame [m]; NaN = unknown.
        camera: Intrinsics.
        is_occluded: (n_joints,) bool, an object hides the joint.
        edges: (4,) float32, the image's left, top, right and bottom edge as slopes: x / z and y / z.
    """

    depth: NDArray[np.uint16]
    intrinsics: NDArray[np.float32]
    start: NDArray[np.float32]
    joints: NDArray[np.float32]
    camera: Pinhole
    is_occluded: NDArray[np.bool_]
    edges: NDArray[np.float32]


def views_of(
    frames: FrameSequence,
    joints: tuple[str, ...],
    box_joints: tuple[str, ...],
    margin_m: float = BOX_MARGIN_M,
    noise_m: float = 0.0,
    is_cut: bool = False,
) -> list[View]:
    """Frames with their walks' starts; frames that show nothing are left out.

    Args:
        frames: The frames.
        joints: Names of the experts' joints.
        box_joints: Joints in the upper-body box, in the middle of which walks start; those that a frame knows.
        margin_m: Of the box [m].
        noise_m: Standard deviation of the starts across the line of sight, along each axis [m].
        is_cut: Whether the images end somewhere on the person.
    """
    places = chosen_joints(frames.labels.joints, joints)
    inside = chosen_joints(frames.labels.joints, box_joints)
    views = []
    for index in range(len(frames)):
        frame = frames[index]
        edges = edges_of(frame.depth.shape, frame.camera)
        if is_cut:
            rng = np.random.default_rng([_CUT_STREAM, index])
            frame, edges = cut_frame(frame, frame.joints[places], edges, rng)
        box = seen_box(upper_body_box(frame.joints[inside], frame.camera, margin_m), frame.camera, edges)
        start = start_point(frame.depth, frame.camera, box=box)
        if start is not None:
            camera = frame.camera
            intrinsics = np.array([camera.fx, camera.fy, camera.cx, camera.cy], np.float32)
            start[:2] += np.random.default_rng([_START_STREAM, index]).normal(0.0, noise_m, 2)
            is_occluded = frame.is_occluded[places]
            views.append(View(frame.depth, intrinsics, start, frame.joints[places], camera, is_occluded, edges))
    return views


def tune(model: RWFModel, frames: FrameSequence) -> RWFModel:
    """Learns on frames that a forest was not trained on how its experts walk and how probable their answers are.

    Walks start in the middle of the true upper-body box, as far off as the config's `box_noise_m` says; frames
    that show nothing are left out. Probabilities are learned on starts that are not off, too, and on images that end
    on the person.

    Args:
        model: A forest, tuned or not.
        frames: Validation frames.
    """
    config = model.config
    exact, started, cut = (
        views_of(frames, model.joints, config.box_joints, noise_m=noise_m, is_cut=is_cut)
        for noise_m, is_cut in ((0.0, False), (config.box_noise_m, False), (config.box_noise_m, True))
    )
    return calibrated(choose_walks(model, started), [*exact, *started, *cut])


def choose_walks(model: RWFModel, views: list[View]) -> RWFModel:
    """Chooses how the experts walk, joint by joint from the parents on.

    What a joint's walks are judged by are the frames that know it; where none does, they go on as the config has
    them.

    Args:
        model: A trained forest.
        views: Validation frames.
    """
    return replace(model, plan=_chosen_plan(model, views)) if views else model


def calibrated(model: RWFModel, views: list[View]) -> RWFModel:
    """Fits a forest's probabilities on the frames that know a joint.

    Args:
        model: A forest whose plan is settled.
        views: Frames that it was not trained on.
    """
    weights = np.full((len(OUTCOMES), len(model.joints), len(TERMS)), np.nan, np.float32)
    walker = Predictor(model)
    walks = [walker.walk(view.depth, view.camera, view.start, view.edges) for view in views]
    nowhere = np.empty((0, len(model.joints), 3), np.float32)
    truth = np.stack([view.joints for view in views]) if views else nowhere
    has_truth = is_known(truth)
    if has_truth.any():
        terms = np.stack([walked.terms for walked in walks])
        outcomes = (
            np.linalg.norm(np.stack([walked.ends[:, 0, :3] for walked in walks]) - truth, axis=2) <= WITHIN_M,
            np.stack([view.is_occluded for view in views]),
            is_outside(truth, np.stack([view.edges for view in views])),
        )
        weights[:] = [fit_logistic_alike(terms, outcome, has_truth) for outcome in outcomes]
    return replace(model, weights=weights)


def _chosen_plan(model: RWFModel, views: list[View]) -> WalkPlan:
    """The best plan, joint by joint."""
    plan = model.plan._replace(**{name: getattr(model.plan, name).copy() for name in _CHOSEN})
    tables = walk_tables(model.experts)
    points = np.zeros((len(views), len(model.joints), 3), np.float32)
    for joint in plan.order:
        best = -1.0
        for choice in _choices(model, views, int(joint)):
            for name, value in zip(_CHOSEN, choice, strict=True):
                getattr(plan, name)[joint] = value
            ends = walk_views(tables, plan, int(joint), model.config.seed, views, points)
            score = _score(ends, views, int(joint))
            if score > best:
                best, kept = score, (choice, ends)
        for name, value in zip(_CHOSEN, kept[0], strict=True):
            getattr(plan, name)[joint] = value
        points[:, joint] = kept[1]
    return plan


_CHOSEN = ("start_from", "scatter_m", "bandwidth_m", "n_arriving")


def _choices(model: RWFModel, views: list[View], joint: int) -> list[tuple[int, float, float, int]]:
    parent, config = int(model.limbs.parent[joint]), model.config
    if not any(np.isfinite(view.joints[joint]).all() for view in views):
        return [(parent, config.scatter_m, config.bandwidth_m, config.n_arriving)]
    starts = (parent, -1) if parent >= 0 else (-1,)
    scatters = sorted({*SCATTERS_M, config.scatter_m})
    bandwidths = sorted({*BANDWIDTHS_M, config.bandwidth_m})
    arriving = sorted({n for n in ARRIVING if n < config.n_steps} | {config.n_arriving})
    return list(itertools.product(starts, scatters, bandwidths, arriving))


def walk_views(
    tables: WalkTables, plan: WalkPlan, joint: int, seed: int, views: list[View], points: NDArray[np.float32]
) -> NDArray[np.float32]:
    """Walks to one joint in every view.

    Args:
        tables: The experts.
        plan: How to walk.
        joint: Which expert.
        seed: Of the walks.
        views: The frames.
        points: (n_views, n_joints, 3) float32, the joints that were walked to before [m].

    Returns:
        (n_views, 3) float32, the first ends [m].
    """
    ends = np.empty((len(views), 1, 4), np.float32)
    votes = np.empty((plan.n_walks[joint] * plan.n_steps * tables.vote.shape[1], 4), np.float32)
    parent = plan.start_from[joint]
    for i, view in enumerate(views):
        start = view.start if parent < 0 else points[i, parent]
        walk_joint(view.depth, view.intrinsics, tables, plan, joint, seed, start, votes, ends[i])
    return ends[:, 0, :3]


def _score(ends: NDArray[np.float32], views: list[View], joint: int) -> float:
    """Share of the joints that are found, with a soft limit: from 1 at half of it to 0 at one and a half.

    Frames that do not know the joint are left out; 0 if none does.
    """
    error = np.linalg.norm(ends - np.stack([view.joints[joint] for view in views]), axis=1)
    error = error[np.isfinite(error)]
    return float(np.clip(1.5 - error / WITHIN_M, 0.0, 1.0).mean()) if len(error) else 0.0
