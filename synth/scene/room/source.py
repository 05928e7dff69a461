"""RoomSource: makes any frame of a corpus of whole scenes from (configuration, seed, split, number) alone."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from synth.frame import NumberedFrames, ObjectRecord, PersonRecord, PersonView, RoomFrame, RoomInfo
from synth.geometry import inverse, transform_points
from synth.render.among import PersonVisibility, measure_person, object_fractions
from synth.render.records import RenderObject
from synth.render.rooms import RenderedRoom, RenderPerson, RoomRenderer
from synth.scene.bases import PoseMix
from synth.scene.config import SceneConfig
from synth.scene.draw import SceneDraw
from synth.scene.objects import ObjectMix
from synth.scene.placement import Assembly, record_of
from synth.scene.room.arrange import Eye, Gathering, PlacedPerson, distance_range, draw_eye, gather
from synth.scene.room.cast import Cast, Rooms
from synth.scene.room.groups import GROUPS, Group, draw_group
from synth.scene.room.shell import BuiltRoom
from synth.vocabulary import SCENE_CODE, SPLITS, SURFACE_CLASSES

_FRAME_STREAM = 6
"""Kept apart from those of other frames, subjects, objects and rooms."""
MAX_SCENES = 12
"""Casts drawn for a frame before a configuration is given up."""
MAX_PLACEMENTS = 12
"""Rooms and cameras tried for one cast."""
MAX_GROUPS = 24
"""Groups drawn for one scene before it is drawn anew."""
MIN_SEEN_PIXELS = 400
"""The person who is seen best shows at least this many pixels, unless the frame shall show nobody."""
CLOSE_MM = 500
"""What is nearer to the camera than this [mm] ..."""
MAX_CLOSE_SHARE = 0.15
"""... covers at most this share of the image."""
MIN_DEPTH_SHARE = 0.3
"""At least this share of the image has depth."""


@dataclass(frozen=True)
class _Seen:
    """A scene and what the camera makes of it.

    Attributes:
        room: The room.
        gathering: Who is in it.
        eye: The camera.
        objects: Those of the room, then the people's.
        drawn: The image.
        labels: Of every person.
    """

    room: BuiltRoom
    gathering: Gathering
    eye: Eye
    objects: Assembly
    drawn: RenderedRoom
    labels: tuple[PersonVisibility, ...]


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
        super().__init__(seed, n_frames, config.splits.counts)
        if not config.room.is_on:
            raise ValueError("whole scenes need room kinds with a weight, such as room.kinds.living=1")
        if renderer != "numba":
            raise ValueError(f"renderer={renderer!r} draws single people; whole scenes are drawn by 'numba' alone")
        self.config = config
        self._camera = config.make_camera()
        self._renderer = RoomRenderer(self._camera)
        self._cast = Cast(config, seed, objects)
        self._rooms = Rooms(config, seed)
        self._poses = poses

    @property
    def description(self) -> str:
        """Which back end and device draws, in words."""
        return self._renderer.description

    def frame(self, index: int) -> RoomFrame:
        """Makes a frame.

        Args:
            index: 0..len(self) - 1.

        Raises:
            IndexError: There is no such frame.
            RuntimeError: No scene of the configuration passes its own conditions.
        """
        split, frame_idx = self.locate(index)
        rng = np.random.default_rng([self.seed, _FRAME_STREAM, SPLITS.index(split), frame_idx])
        low, high = self.config.people.number
        n_people = int(rng.integers(low, high + 1))
        for _ in range(MAX_SCENES):
            seen = self._attempt(split, frame_idx, n_people, rng)
            if seen is not None:
                return self._frame(index, split, frame_idx, seen)
        people, room = self.config.people, self.config.room
        raise RuntimeError(
            f"frame {index} of seed {self.seed}: in {MAX_SCENES * MAX_PLACEMENTS} attempts at {n_people} people in a "
            f"room the camera saw nobody, or not all found a place; people.number={people.number}, "
            f"people.visible={people.visible}, room.sides={room.sides}, distance={self.config.distance} and the "
            "mounting's ranges must leave room for them"
        )

    def _attempt(self, split: str, frame_idx: int, n_people: int, rng: np.random.Generator) -> _Seen | None:
        """Draws people, and rooms and cameras until one shows them."""
        groups = self._draw_groups(split, frame_idx, n_people, rng)
        if groups is None:
            return None
        distance = distance_range(self.config)
        for _ in range(MAX_PLACEMENTS):
            room, taken = self._rooms.draw(split, frame_idx, rng)
            eye = draw_eye(self.config, room, taken, self._camera, rng)
            if eye is None:
                continue
            gathering = gather(groups, taken.copy(), eye, self._camera, distance, rng)
            seen = None if gathering is None else self._look(room, gathering, eye)
            if seen is not None:
                return seen
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

    def _look(self, room: BuiltRoom, gathering: Gathering, eye: Eye) -> _Seen | None:
        """Draws the scene; None if its view is not one that a camera would be put up for."""
        T_camera_world = inverse(eye.T_world_camera)
        unseen = set(SURFACE_CLASSES) - set(self.config.room.surfaces)
        objects = (*room.items, *gathering.objects)
        people = [RenderPerson(one.member.person.mesh(), one.T_world_person) for one in gathering.people]
        is_near = room.may_show(T_camera_world, self._camera)
        things = [
            RenderObject(item.occluder.mesh, SCENE_CODE[item.occluder.class_name], k, item.T_world_object)
            for k, item in enumerate(objects, start=1)
            if item.occluder.class_name not in unseen and (k > len(is_near) or is_near[k - 1])
        ]
        drawn = self._renderer.render_room(T_camera_world, people, things)
        n_pixels = drawn.depth.size
        n_close = np.count_nonzero((drawn.depth > 0) & (drawn.depth < CLOSE_MM))
        is_empty = np.count_nonzero(drawn.depth) < MIN_DEPTH_SHARE * n_pixels and not unseen
        if n_close > MAX_CLOSE_SHARE * n_pixels or is_empty:
            return None
        labels = tuple(
            measure_person(drawn, k, transform_points(T_camera_world, one.joints()), self._camera)
            for k, one in enumerate(gathering.people)
        )
        if labels:
            best = max(labels, key=lambda label: label.n_seen)
            low, high = self.config.people.visible
            if best.n_seen < MIN_SEEN_PIXELS or not low <= best.visible_fraction <= high:
                return None
        return _Seen(room, gathering, eye, objects, drawn, labels)

    def _frame(self, index: int, split: str, frame_idx: int, seen: _Seen) -> RoomFrame:
        T_camera_world = inverse(seen.eye.T_world_camera)
        n_before = len(seen.objects) - len(seen.gathering.objects)
        fractions = np.zeros(len(seen.objects) + 1)
        measured = object_fractions(seen.drawn)
        fractions[: len(measured)] = measured
        of_people = tuple(
            record_of(item, k, float(fractions[k]))
            for k, item in enumerate(seen.gathering.objects, start=n_before + 1)
        )
        records, views = [], []
        for k, (one, labels) in enumerate(zip(seen.gathering.people, seen.labels, strict=True)):
            pose_id = one.member.person.pose.source_id or f"pose/{split}/{frame_idx:07d}/{k + 1}"
            seat = one.seat + n_before + 1 if one.seat >= 0 else 0
            records.append(_person_record(k + 1, one, pose_id, seat, labels))
            views.append(_person_view(one, T_camera_world, seen.drawn, k, labels))
        info = RoomInfo(
            seed=self.seed,
            index=index,
            split=split,
            room_id=seen.room.room_id,
            room=seen.room.plain,
            people=tuple(records),
            objects=(*_seen_records(seen.room, fractions), *of_people),
        )
        drawn = seen.drawn
        return RoomFrame(
            depth=drawn.depth,
            part=drawn.part,
            person=drawn.person,
            occluder=drawn.occluder,
            instance=drawn.instance,
            people=tuple(views),
            T_world_camera=seen.eye.T_world_camera,
            camera=self._camera,
            info=info,
        )


def _seen_records(room: BuiltRoom, fractions: NDArray[np.float64]) -> tuple[ObjectRecord, ...]:
    """What a frame stores of a room's items, by the visible fraction of each instance."""
    return tuple(
        replace(record, visible_fraction=float(fractions[k])) if fractions[k] > 0.0 else record
        for k, record in enumerate(room.records, start=1)
    )


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


def _person_record(
    number: int, one: PlacedPerson, pose_id: str, seat: int, labels: PersonVisibility
) -> PersonRecord:
    person = one.member.person
    return PersonRecord(
        number=number,
        subject_id=person.subject.subject_id,
        subject=person.subject.spec,
        pose_family=person.pose.family,
        pose_id=pose_id,
        group=one.group,
        group_number=one.group_number,
        activity=one.member.activity,
        seat=seat,
        visible_fraction=labels.visible_fraction,
    )


def _person_view(
    one: PlacedPerson, T_camera_world: NDArray[np.float64], drawn: RenderedRoom, k: int, labels: PersonVisibility
) -> PersonView:
    pose = one.member.person.pose
    return PersonView(
        box=drawn.bodies[k].box,
        body_depth=drawn.bodies[k].depth,
        body_part=drawn.bodies[k].part,
        joints=transform_points(T_camera_world, one.joints()).astype(np.float32),
        joint_state=labels.joint_state,
        joint_visible_fraction=labels.joint_visible_fraction,
        part_visible_fraction=labels.part_visible_fraction,
        angles=pose.angles.astype(np.float32),
        T_world_root=one.T_world_person @ pose.T_world_root,
    )
