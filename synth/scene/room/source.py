"""RoomSource: makes any frame of a corpus of whole scenes from (configuration, seed, split, number) alone."""

import numpy as np

from synth.frame import Moment, NumberedFrames, RoomFrame
from synth.scene.bases import PoseMix
from synth.scene.clips.config import whole_scenes
from synth.scene.config import SceneConfig
from synth.scene.draw import SceneDraw
from synth.scene.objects import ObjectMix
from synth.scene.room.arrange import distance_range, draw_eye, gather
from synth.scene.room.cast import Cast, Rooms
from synth.scene.room.groups import GROUPS, Group, draw_group
from synth.scene.room.looking import Looker, Seen
from synth.scene.room.rigs import further_eyes
from synth.vocabulary import SPLITS

_FRAME_STREAM = 6
"""Kept apart from those of other frames, subjects, objects and rooms."""
MAX_SCENES = 12
"""Casts drawn for a frame before a configuration is given up."""
MAX_PLACEMENTS = 12
"""Rooms and cameras tried for one cast."""
MAX_GROUPS = 24
"""Groups drawn for one scene before it is drawn anew."""


class RoomSource(NumberedFrames[RoomFrame]):
    """The frames of a corpus of whole scenes, in any order: train, then val, then test.

    A frame depends on the configuration, the seed, its split and its number within the split alone.

    Args:
        config: What to draw from; its rooms are on.
        seed: Corpus seed, 0..2**63 - 1.
        n_frames: Length of the corpus.
        renderer: Name of the renderer; only "numba" draws whole scenes.
        poses: Poses from motion capture among the procedural ones.
        objects: Imported objects among the procedural ones.
    """

    def __init__(
        self,
        config: SceneConfig,
        seed: int,
        n_frames: int,
        renderer: str = "numba",
        poses: PoseMix | None = None,
        objects: ObjectMix | None = None,
    ) -> None:
        super().__init__(seed, n_frames, whole_scenes(config.splits.counts, config.cameras))
        if not config.room.is_on:
            raise ValueError("whole scenes need room kinds with a weight, such as room.kinds.living=1")
        if renderer != "numba":
            raise ValueError(f"renderer={renderer!r} draws single people; whole scenes are drawn by 'numba' alone")
        self.config = config
        self._camera = config.make_camera()
        self._looker = Looker(config, self._camera, seed)
        self._last: tuple[tuple[str, int], tuple[Seen, ...]] | None = None
        self._cast = Cast(config, seed, objects)
        self._rooms = Rooms(config, seed)
        self._poses = poses

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
            RuntimeError: No scene of the configuration passes its own conditions.
        """
        split, frame_idx = self.locate(index)
        scene_idx, view = divmod(frame_idx, self.config.cameras)
        seen = self._seen(index, split, scene_idx)[view]
        moment = None if self.config.cameras == 1 else Moment(scene_idx, 0, view)
        return self._looker.frame(index, split, f"pose/{split}/{scene_idx:07d}", seen, moment)

    def _seen(self, index: int, split: str, scene_idx: int) -> tuple[Seen, ...]:
        """What every camera sees of a scene; that of the last one is kept."""
        if self._last is None or self._last[0] != (split, scene_idx):
            self._last = (split, scene_idx), self._drawn(index, split, scene_idx)
        return self._last[1]

    def _drawn(self, index: int, split: str, scene_idx: int) -> tuple[Seen, ...]:
        rng = np.random.default_rng([self.seed, _FRAME_STREAM, SPLITS.index(split), scene_idx])
        low, high = self.config.people.number
        n_people = int(rng.integers(low, high + 1))
        for _ in range(MAX_SCENES):
            seen = self._attempt(split, scene_idx, n_people, rng)
            if seen is not None:
                return seen
        people, room = self.config.people, self.config.room
        raise RuntimeError(
            f"frame {index} of seed {self.seed}: in {MAX_SCENES * MAX_PLACEMENTS} attempts at {n_people} people in a "
            f"room the camera saw nobody, or not all found a place; people.number={people.number}, "
            f"people.visible={people.visible}, room.sides={room.sides}, distance={self.config.distance} and the "
            "mounting's ranges must leave room for them"
        )

    def _attempt(
        self, split: str, scene_idx: int, n_people: int, rng: np.random.Generator
    ) -> tuple[Seen, ...] | None:
        """Draws people, and rooms and cameras until all cameras show them."""
        groups = self._draw_groups(split, scene_idx, n_people, rng)
        if groups is None:
            return None
        distance = distance_range(self.config)
        for _ in range(MAX_PLACEMENTS):
            room, taken = self._rooms.draw(split, scene_idx, rng)
            eye = draw_eye(self.config, room, taken, self._camera, rng)
            if eye is None:
                continue
            gathering = gather(groups, taken.copy(), eye, self._camera, distance, rng)
            if gathering is None:
                continue
            seen = [self._looker.look(room, gathering, eye)]
            if not self._looker.is_worth_it(seen[0]):
                continue
            places = [one.joints() for one in gathering.people]
            eyes = further_eyes(self.config, room, taken, eye, gathering.objects, places, rng)
            for other in eyes or ():
                seen.append(self._looker.look(room, gathering, other))
                if not self._looker.is_worth_it(seen[-1], is_first=False):
                    break
            else:
                if eyes is not None:
                    return tuple(seen)
        return None

    def _draw_groups(
        self, split: str, frame_idx: int, n_people: int, rng: np.random.Generator
    ) -> list[Group] | None:
        """Groups of so many people, nobody twice; None if too many could not be drawn."""
        self._cast.begin()
        groups: list[Group] = []
        n_left = n_people
        for _ in range(MAX_GROUPS):
            if n_left == 0:
                return groups
            library = None if self._poses is None else self._poses.draw_library(split, rng)
            draw = SceneDraw(self.config, self._cast, split, frame_idx, rng, library)
            kind, size = _draw_kind(self.config, n_left, rng)
            stayed = self._cast.present()
            group = draw_group(draw, kind, size)
            if group is None:
                self._cast.leave(stayed)
                continue
            self._cast.leave(stayed | {_number_of(one.person.subject.subject_id) for one in group.members})
            groups.append(group)
            n_left -= size
        return None


def _number_of(subject_id: str) -> int:
    return int(subject_id.rsplit("/", 1)[1])


def _draw_kind(config: SceneConfig, n_left: int, rng: np.random.Generator) -> tuple[str, int]:
    """Kind and size of the next group; kinds that need more people than are left are not drawn."""
    names = [name for name, kind in GROUPS.items() if kind.least <= n_left]
    weights = np.array([getattr(config.people.groups, name) for name in names])
    if not weights.sum() > 0.0:
        names, weights = ["alone"], np.ones(1)
    name = names[int(rng.choice(len(names), p=weights / weights.sum()))]
    return name, int(rng.integers(GROUPS[name].least, min(GROUPS[name].most, n_left) + 1))
