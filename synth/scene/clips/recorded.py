"""People of clips who move as recorded ones did."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from synth.bodies.motion.captured import captured
from synth.bodies.motion.library import MotionLibrary
from synth.bodies.motion.record import Motion
from synth.bodies.rig.kinematics import joint_positions
from synth.scene.clips.actors import Actor
from synth.scene.clips.routes import Router
from synth.scene.placement import pose_on_floor
from synth.scene.pools import Subject
from synth.vocabulary import SPLITS

ACT = "recorded"
"""What people who move as recorded do, in records."""
N_PLACES = 12
"""A motion is tried at so many places of a room."""
ARM_ROOM = 0.12
"""Joints keep this from furniture, seen from above [m]."""
LOOKED_AT = 0.1
"""So often [s]."""


@dataclass(frozen=True)
class MotionMix:
    """Recorded motions among the procedural ones of clips.

    Attributes:
        library: The motions; a clip takes only those of its own split.
        share: Share of the people on their feet whose motion is taken from the library.
        splits: Splits that use it at all.
    """

    library: MotionLibrary
    share: float = 0.5
    splits: tuple[str, ...] = SPLITS

    def __post_init__(self) -> None:
        if not 0.0 <= self.share <= 1.0:
            raise ValueError(f"share={self.share} of the people with recorded motions must be in 0..1")
        unknown = [split for split in self.splits if split not in SPLITS]
        if unknown:
            raise ValueError(f"split {unknown[0]!r} is unknown; known are {', '.join(SPLITS)}")

    def check_length(self, seconds: float) -> None:
        """Refuses clips that last longer than every motion of a split.

        Args:
            seconds: How long clips are [s].

        Raises:
            ValueError: Says which split, and how long its motions are.
        """
        for split in self.splits:
            own = self.library.seconds[self.library.of_split(split)]
            if not len(own):
                raise ValueError(f"the motion library has no motions for split {split!r}; leave that split out")
            if own.max() < seconds:
                raise ValueError(
                    f"the recorded motions of split {split!r} last at most {own.max():.1f} s, clips {seconds:.1f} s; "
                    "make clips shorter or leave that split out"
                )


class RecordedDraw:
    """Draws recorded motions for people and puts them into a room.

    Args:
        mix: The motions.
        split: Of the clip.
        seconds: How long the clip is [s].
        rate: Samples a second.
        router: Where people can walk.
        open_floor: What is free for arms.
        rng: Source of randomness.
    """

    def __init__(
        self,
        mix: MotionMix,
        split: str,
        seconds: float,
        rate: float,
        router: Router,
        open_floor: Router,
        rng: np.random.Generator,
    ) -> None:
        self.rows = mix.library.of_split(split, seconds)
        self.library, self.seconds, self.rate = mix.library, seconds, rate
        self.router, self.open_floor, self.rng = router, open_floor, rng

    def motion(self, subject: Subject) -> tuple[Motion, str] | None:
        """Part of a recorded motion on a person's body, and its identifier; None if it does not fit."""
        drawn = self.library[int(self.rng.choice(self.rows))]
        n = int(np.ceil(self.seconds * drawn.fps)) + 1
        first = int(self.rng.integers(max(len(drawn.angles) - n, 0) + 1))
        cut = drawn.part(first, n)
        made = captured(cut, subject.body, self.rate, ACT)
        return None if made is None else (made, drawn.motion_id)

    def placed(
        self, subject: Subject, found: tuple[Motion, str], middle: NDArray[np.float64], group: int
    ) -> Actor | None:
        """A motion at a place and with a drawn heading; None where furniture is in its way.

        Args:
            subject: Who.
            found: What `motion` gave.
            middle: (2,) where the middle of its way shall be [m].
            group: Number of the group.
        """
        motion, source_id = found
        turn = pose_on_floor(0.0, 0.0, float(self.rng.uniform(-np.pi, np.pi)))
        way = (turn @ motion.T_world_root[:, :, 3:])[:, :2, 0]
        shift = middle - 0.5 * (way.min(axis=0) + way.max(axis=0))
        stride = max(1, round(LOOKED_AT * self.rate))
        if not self.router.floor.is_free(way[::stride] + shift):
            return None
        T = pose_on_floor(float(shift[0]), float(shift[1]), 0.0) @ turn
        there = replace(motion, T_world_root=T @ motion.T_world_root)
        for k in range(0, len(there), stride):
            joints = joint_positions(subject.body.skeleton, there.pose(k))
            if not self.open_floor.floor.is_free(joints[:, :2]):
                return None
        return Actor(subject, ACT, there, group, source_id=source_id)
