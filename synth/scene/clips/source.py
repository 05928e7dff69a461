"""ClipSource: makes any frame of a corpus of clips from (configuration, seed, split, number) alone."""

from collections import OrderedDict
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from synth.bodies.motion.record import Motion
from synth.bodies.rig.kinematics import joint_positions
from synth.frame import Moment, NumberedFrames, PersonMotion, RoomFrame
from synth.scene.bases import PoseMix
from synth.scene.clips.actors import Actor
from synth.scene.clips.config import whole_scenes
from synth.scene.clips.recorded import MotionMix
from synth.scene.clips.stage import Stage, StageDraw, steps_with_people
from synth.scene.config import SceneConfig
from synth.scene.draw import Person, SceneDraw
from synth.scene.objects import ObjectMix
from synth.scene.pools import cached
from synth.scene.room.arrange import Eye, Gathering, PlacedPerson
from synth.scene.room.cast import Cast, Rooms
from synth.scene.room.groups import Member
from synth.scene.room.looking import Looker
from synth.vocabulary import N_JOINTS, SPLITS

_CLIP_STREAM = 7
"""Kept apart from those of frames, subjects, objects and rooms."""
MAX_STAGES = 40
"""Clips drawn before a configuration is given up."""
LEAST_SHARE = 0.5
"""The first camera sees somebody in at least this share of the time steps; every other one does now and then."""
_MAX_CLIPS = 2


@dataclass(frozen=True)
class _Clip:
    """A clip and where everybody's joints are.

    Attributes:
        stage: The clip.
        joints: (n_people, n_samples, 15, 3) world [m], at the rate of the motions.
    """

    stage: Stage
    joints: NDArray[np.float64]


class ClipSource(NumberedFrames[RoomFrame]):
    """The frames of a corpus of clips, in any order: train, then val, then test.

    Frames are numbered by clip, then time step, then camera. A frame depends on the configuration, the seed, its
    split and its number within the split alone.

    Args:
        config: What to draw from; `clip` is not 0 and its rooms are on.
        seed: Corpus seed, 0..2**63 - 1.
        n_frames: Length of the corpus, a multiple of cameras x clip.
        renderer: Name of the renderer; only "numba" draws whole scenes.
        poses: Recorded motions that some people make; single poses make no clip.
        objects: Imported objects among the procedural ones.
    """

    def __init__(
        self,
        config: SceneConfig,
        seed: int,
        n_frames: int,
        renderer: str = "numba",
        poses: MotionMix | PoseMix | None = None,
        objects: ObjectMix | None = None,
    ) -> None:
        super().__init__(seed, n_frames, whole_scenes(config.splits.counts, config.frames_a_scene))
        if not config.clip:
            raise ValueError("clips need a number of time steps, such as clip=60")
        if renderer != "numba":
            raise ValueError(f"renderer={renderer!r} draws single people; whole scenes are drawn by 'numba' alone")
        if isinstance(poses, PoseMix):
            raise ValueError("a library of single poses has no motion, and cannot be used for clips")
        if poses is not None:
            poses.check_length(config.clip / config.fps)
        self._motions = poses
        self.config = config
        self._camera = config.make_camera()
        self._looker = Looker(config, self._camera, seed)
        self._cast = Cast(config, seed, objects)
        self._rooms = Rooms(config, seed)
        self._clips: OrderedDict[tuple[str, int], _Clip] = OrderedDict()
        self._last: tuple[tuple[str, int, int], Gathering] | None = None

    @property
    def description(self) -> str:
        """Which back end and device draws, in words."""
        return self._looker.description

    def frame(self, index: int) -> RoomFrame:
        """Makes a frame.

        Args:
            index: 0..len(self) - 1.

        Raises:
            IndexError: There is no such frame.
            RuntimeError: No clip of the configuration passes its own conditions.
        """
        split, frame_idx = self.locate(index)
        clip_idx, rest = divmod(frame_idx, self.config.frames_a_scene)
        step, view = divmod(rest, self.config.cameras)
        clip = self.clip(split, clip_idx)
        gathering = self._gathering(split, clip_idx, step, clip.stage)
        T = clip.stage.eyes[view, step]
        seen = self._looker.look(clip.stage.room, gathering, Eye(T, 0.0))
        motions = [self._motion(clip, k, step) for k in range(len(clip.stage.actors))]
        pose_ids = f"motion/{split}/{clip_idx:07d}"
        return self._looker.frame(index, split, pose_ids, seen, Moment(clip_idx, step, view), motions)

    def clip(self, split: str, clip_idx: int) -> _Clip:
        """A clip before anybody looks at it; the last ones are kept."""
        return cached(self._clips, (split, clip_idx), _MAX_CLIPS, lambda: self._drawn(split, clip_idx))

    def _drawn(self, split: str, clip_idx: int) -> _Clip:
        rng = np.random.default_rng([self.seed, _CLIP_STREAM, SPLITS.index(split), clip_idx])
        low, high = self.config.people.number
        n_people = int(rng.integers(low, high + 1))
        draw = SceneDraw(self.config, self._cast, split, clip_idx, rng)
        n_unseen = 0
        for _ in range(MAX_STAGES):
            self._cast.begin()
            room, taken = self._rooms.draw(split, clip_idx, rng)
            stage = StageDraw(draw, room, taken, self._camera, self._motions).stage(n_people)
            if stage is None:
                continue
            n_samples = (self.config.clip - 1) * stage.stride + 2
            joints = np.empty((n_people, n_samples, N_JOINTS, 3))
            for k, one in enumerate(stage.actors):
                joints[k] = joints_of(one, n_samples)
            clip = _Clip(stage, joints)
            if not n_people or self._is_seen(clip):
                return clip
            n_unseen += 1
        raise RuntimeError(self._sorry(split, clip_idx, n_people, n_unseen))

    def _sorry(self, split: str, clip_idx: int, n_people: int, n_unseen: int) -> str:
        room = self.config.room
        what = (
            f"in {n_unseen} of them a camera never saw anybody; distance={self.config.distance}, the mounting's ranges "
            f"and cameras={self.config.cameras} must show who is there"
            if 2 * n_unseen >= MAX_STAGES
            else "people found no free way through the room, or no seat; "
            f"room.sides={room.sides} and room.furniture={room.furniture} must leave some"
        )
        which = f"clip {clip_idx} of {split}, seed {self.seed}"
        return f"{which}: {MAX_STAGES} attempts at {n_people} people failed; {what}"

    def _is_seen(self, clip: _Clip) -> bool:
        """Whether every camera sees somebody now and then, and the first one does for a good while."""
        stride = clip.stage.stride
        joints = clip.joints[:, ::stride][:, : self.config.clip]
        for view in range(self.config.cameras):
            n = steps_with_people(clip.stage, self._camera, view, joints)
            if np.count_nonzero(n) < (LEAST_SHARE * len(n) if view == 0 else 1):
                return False
            seen_at = np.flatnonzero(n == n.max())
            step = int(seen_at[len(seen_at) // 2])
            people = self._people(clip.stage, step)
            seen = self._looker.look(clip.stage.room, people, Eye(clip.stage.eyes[view, step], 0.0))
            if not self._looker.is_worth_it(seen, is_first=view == 0):
                return False
        return True

    def _gathering(self, split: str, clip_idx: int, step: int, stage: Stage) -> Gathering:
        """Everybody at a time step; that of the last one is kept, for the other cameras."""
        key = (split, clip_idx, step)
        if self._last is None or self._last[0] != key:
            self._last = key, self._people(stage, step)
        return self._last[1]

    def _people(self, stage: Stage, step: int) -> Gathering:
        people, n_seats = [], 0
        for one in stage.actors:
            k = step * stage.stride
            person = Person.in_pose(one.subject, one.pose(k))
            member = Member(person, np.eye(4), one.motion.activity[k])
            has_seat = one.seat is not None
            people.append(PlacedPerson(member, np.eye(4), one.act, one.group, n_seats if has_seat else -1))
            n_seats += has_seat
        moved = (one.moved_item(step * stage.stride) for one in stage.actors)
        return Gathering(tuple(people), (*stage.seats, *(item for item in moved if item is not None)))

    def _motion(self, clip: _Clip, k: int, step: int) -> PersonMotion:
        """Joints, their velocities and the contacts of a person at a time step."""
        motion: Motion = clip.stage.actors[k].motion
        at = step * clip.stage.stride
        before, after = max(at - 1, 0), min(at + 1, clip.joints.shape[1] - 1)
        velocity = (clip.joints[k, after] - clip.joints[k, before]) * (motion.rate / max(after - before, 1))
        return PersonMotion(
            clip.joints[k, at].astype(np.float32),
            velocity.astype(np.float32),
            motion.contacts[at].astype(np.uint8),
        )


def joints_of(actor: Actor, n: int) -> NDArray[np.float64]:
    """(n, 15, 3) joint centres of a person at the first samples, world frame [m]."""
    return np.array([joint_positions(actor.subject.body.skeleton, actor.motion.pose(k)) for k in range(n)])
