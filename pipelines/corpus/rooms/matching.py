"""Scores of a finder of people on whole scenes: who ought to be found, and which places are false."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from forests.finder.floor import Floor
from synth.frame import RoomFrame
from synth.vocabulary import JOINT_NAMES, JointState

DISTANCES = (1.0, 5.0)
"""People nearer or farther need not be found [m]."""
MIN_VISIBLE = 0.25
"""People of whom less is seen need not be found."""
REACH_M = 0.35
"""A place is a person's within this, level distance from the line through head, neck and torso [m]."""
_TRUNK = [JOINT_NAMES.index(name) for name in ("head", "neck", "torso")]


@dataclass(frozen=True)
class Truths:
    """The people of a scene.

    Attributes:
        trunk: (n, 3, 3) float64 head, neck and torso on the floor and above it, world frame [m].
        is_wanted: (n,) bool, they ought to be found.
        is_seen: (n,) bool, the image shows something of them; who is seen and not wanted may be found or not.
        distance: (n,) float64, level, from the camera to the torso [m].
        shown: (n,) float64, of the pixels in the image the share that is not hidden.
        visible: (n,) float64: of the pixels in the image the share that is not hidden, times the share of the joints
            that lie inside the image.
    """

    trunk: NDArray[np.float64]
    is_wanted: NDArray[np.bool_]
    is_seen: NDArray[np.bool_]
    distance: NDArray[np.float64]
    shown: NDArray[np.float64]
    visible: NDArray[np.float64]


def truths_of(frame: RoomFrame) -> Truths:
    """Who ought to be found in a scene.

    Args:
        frame: The scene.
    """
    T = frame.T_world_camera
    joints = np.array([view.joints for view in frame.people], dtype=np.float64).reshape(-1, len(JOINT_NAMES), 3)
    trunk = joints[:, _TRUNK] @ T[:3, :3].T + T[:3, 3]
    state = np.array([view.joint_state for view in frame.people]).reshape(-1, len(JOINT_NAMES))
    is_inside = (state != JointState.OUTSIDE).mean(axis=1) if len(state) else np.zeros(0)
    shown = np.array([record.visible_fraction for record in frame.info.people], dtype=np.float64)
    distance = np.hypot(*(trunk[:, 2, :2] - T[:2, 3]).T)
    visible = shown * is_inside
    is_wanted = (distance >= DISTANCES[0]) & (distance <= DISTANCES[1]) & (visible >= MIN_VISIBLE)
    return Truths(trunk, is_wanted, shown > 0, distance, shown, visible)


def floor_of(frame: RoomFrame) -> Floor:
    """The true floor of a scene, z = 0 of its world, in the camera frame."""
    T = frame.T_world_camera
    return Floor(T[2, :3] / np.linalg.norm(T[2, :3]), float(T[2, 3]))


def level_distances(trunk: NDArray[np.float64], places: NDArray[np.float64]) -> NDArray[np.float64]:
    """Level distances of places from people's lines through head, neck and torso.

    Args:
        trunk: (n, 3, 3) float64, world frame [m].
        places: (m, 2) float64 x and y, world frame [m].

    Returns:
        (m, n) float64 [m].
    """
    out = np.full((len(places), len(trunk)), np.inf)
    for first in range(2):
        a, b = trunk[None, :, first, :2], trunk[None, :, first + 1, :2]
        length = np.maximum(((b - a) ** 2).sum(axis=2), 1e-12)
        share = np.clip(((places[:, None] - a) * (b - a)).sum(axis=2) / length, 0.0, 1.0)
        nearest = a + share[..., None] * (b - a)
        out = np.minimum(out, np.linalg.norm(places[:, None] - nearest, axis=2))
    return out


@dataclass(frozen=True)
class Verdicts:
    """What became of the places and people of one scene.

    Attributes:
        is_true: (m,) bool, the place is a wanted person's.
        is_false: (m,) bool, nobody's, or a person's who was found before; the rest is neither.
        person: (m,) int64, whose place it is; -1 = nobody's.
        n_wanted: People who ought to be found.
    """

    is_true: NDArray[np.bool_]
    is_false: NDArray[np.bool_]
    person: NDArray[np.int64]
    n_wanted: int


def judge(truths: Truths, places: NDArray[np.float64]) -> Verdicts:
    """Gives each place to the nearest person within reach who has none yet, the surest place first.

    Args:
        truths: The people.
        places: (m, 2) float64 x and y, world frame [m], the surest first.
    """
    distances = level_distances(truths.trunk, places)
    distances[:, ~truths.is_seen] = np.inf
    person = np.full(len(places), -1, np.int64)
    for i in range(len(places)):
        if len(truths.trunk) and distances[i].min() < REACH_M:
            person[i] = distances[i].argmin()
            distances[i + 1 :, person[i]] = np.inf
    is_wanted = np.append(truths.is_wanted, False)[person]
    return Verdicts(is_wanted, person < 0, person, int(truths.is_wanted.sum()))


def recall_at(
    verdicts: Sequence[Verdicts], scores: Sequence[NDArray], false_per_frame: float
) -> tuple[float, float]:
    """Recall at the lowest score that lets no more false places through.

    Args:
        verdicts: One a frame.
        scores: (m,) of each frame's places; a greater one is surer.
        false_per_frame: How many false places a frame may have in the mean.

    Returns:
        The share of wanted people found, and the score from which places count.
    """
    false = np.sort(np.concatenate([s[v.is_false] for v, s in zip(verdicts, scores, strict=True)]))[::-1]
    n_allowed = int(false_per_frame * len(verdicts))
    bound = (
        float(np.nextafter(np.float32(false[n_allowed]), np.float32(np.inf)))
        if n_allowed < len(false)
        else -np.inf
    )
    n_wanted = sum(v.n_wanted for v in verdicts)
    n_found = sum(int((v.is_true & (s >= bound)).sum()) for v, s in zip(verdicts, scores, strict=True))
    return n_found / max(1, n_wanted), bound


def judge_axes(
    truths: Truths, axes: Sequence[NDArray[np.float64]], T_world_camera: NDArray[np.float64]
) -> Verdicts:
    """The same for points (3,) on the axes of found people, camera frame [m], the surest first."""
    points = np.array(axes, dtype=np.float64).reshape(-1, 3) @ T_world_camera[:3, :3].T + T_world_camera[:3, 3]
    return judge(truths, points[:, :2])
