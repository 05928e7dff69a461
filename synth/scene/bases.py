"""Where a person's pose comes from: drawn by a procedural family, or taken from a library of captured ones."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from synth.bodies.body import Body, Pose
from synth.bodies.poses.draw import draw_arms, draw_base
from synth.bodies.poses.families import FAMILIES, PoseFamily
from synth.bodies.poses.hands import HandTargets
from synth.bodies.poses.library import PoseLibrary
from synth.bodies.poses.place import place_pose
from synth.bodies.poses.sit import Sitting
from synth.scene.draw import SceneDraw
from synth.vocabulary import SPLITS

N_TRIES = 6
"""Poses of the library tried on one body before the scene is drawn anew."""


@dataclass(frozen=True)
class PoseMix:
    """Poses from motion capture among the procedural ones.

    Attributes:
        library: The poses; a frame takes only those of its own split.
        share: Share of the frames whose person is taken from the library.
        splits: Splits that use it at all.
    """

    library: PoseLibrary
    share: float = 0.5
    splits: tuple[str, ...] = SPLITS

    def __post_init__(self) -> None:
        if not 0.0 <= self.share <= 1.0:
            raise ValueError(f"share={self.share} of the frames with library poses must be in 0..1")
        unknown = [split for split in self.splits if split not in SPLITS]
        if unknown:
            raise ValueError(f"split {unknown[0]!r} is unknown; known are {', '.join(SPLITS)}")
        for split in self.splits:
            if not len(self.library.rows(split, False)) + len(self.library.rows(split, True)):
                raise ValueError(f"the pose library has no poses for split {split!r}; leave that split out")

    def draw_library(self, split: str, rng: np.random.Generator) -> PoseLibrary | None:
        """The library if the person of a frame is taken from it; else None."""
        return self.library if split in self.splits and rng.random() < self.share else None


def draw_base_pose(draw: SceneDraw, family: str, body: Body, seat_height: float | None = None) -> Pose | None:
    """Trunk, head and legs of a pose, and the arms where nothing will move them.

    A library without a fitting posture leaves it to the family.

    Args:
        draw: The attempt; its library is used if it has one.
        family: Name of the pose family, which says posture and context.
        body: The person.
        seat_height: Top of the seat [m], for those who sit.

    Returns:
        The pose in the person frame, or None if no captured pose fitted.
    """
    kind = FAMILIES[family]
    rows = _rows(draw, kind)
    if draw.library is None or not len(rows):
        return draw_base(_at_ease(kind, draw.config.unlike_legs), body, draw.rng, seat_height=seat_height)
    for _ in range(N_TRIES):
        row = int(rows[int(draw.rng.integers(len(rows)))])
        pose = place_pose(draw.library, row, body, draw.rng, seat_height, keeps_arms=kind.context == "none")
        if pose is not None:
            return pose
    return None


def _at_ease(kind: PoseFamily, unlike_legs: float) -> PoseFamily:
    """The family with legs that differ at least so much from each other, if it sits with both feet down."""
    if not isinstance(kind.base, Sitting) or kind.base.are_legs_crossed or kind.base.unlike >= unlike_legs:
        return kind
    return replace(kind, base=replace(kind.base, unlike=unlike_legs))


def _rows(draw: SceneDraw, kind: PoseFamily) -> NDArray[np.int64]:
    """Poses of the library that suit a family: who pushes something walks or stands upright."""
    if draw.library is None:
        return np.empty(0, dtype=np.int64)
    rows = draw.library.rows(draw.split, kind.posture == "sitting")
    return rows[draw.library.is_upright[rows]] if kind.context == "stroller" else rows


def draw_arms_pose(
    draw: SceneDraw, family: str, body: Body, base: Pose, targets: HandTargets | None = None
) -> Pose | None:
    """Puts the arms where a family wants them; captured arms stay unless the family's hands touch something.

    Args:
        draw: The attempt.
        family: Name of the pose family.
        body: The person.
        base: From `draw_base_pose`.
        targets: What the scene offers the hands, person frame.

    Returns:
        The finished pose, or None if the hands do not reach without a collision.
    """
    if base.source_id and FAMILIES[family].context == "none":
        return base
    arms = draw_arms(family, body, base, draw.rng, targets)
    if arms is None or not base.source_id:
        return arms
    return replace(arms, family=f"mocap_{family}", source_id=base.source_id)
