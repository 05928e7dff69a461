"""Looks at a furnished and peopled room through a camera: image, labels, and the frame that stores them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from synth.camera import Camera
from synth.frame import Moment, ObjectRecord, PersonMotion, PersonRecord, PersonView, RoomFrame, RoomInfo
from synth.geometry import inverse, transform_points
from synth.render.among import PersonVisibility, measure_person, object_fractions
from synth.render.records import RenderObject
from synth.render.rooms import RenderedRoom, RenderPerson, RoomRenderer
from synth.scene.config import SceneConfig
from synth.scene.placement import Assembly, record_of
from synth.scene.room.arrange import Eye, Gathering, PlacedPerson
from synth.scene.room.shell import BuiltRoom
from synth.vocabulary import SCENE_CODE, SURFACE_CLASSES

MIN_SEEN_PIXELS = 400
"""The person who is seen best shows at least this many pixels, unless the frame shall show nobody."""
MIN_SEEN_BY_OTHERS = 120
"""So many pixels for cameras after the first one of a scene."""
CLOSE_MM = 500
"""What is nearer to the camera than this [mm] ..."""
MAX_CLOSE_SHARE = 0.15
"""... covers at most this share of the image."""
MIN_DEPTH_SHARE = 0.3
"""At least this share of the image has depth."""


@dataclass(frozen=True)
class Seen:
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


class Looker:
    """Draws what one kind of camera sees of a room, and makes frames of it.

    Args:
        config: The scenes: surfaces that give depth, and who must be seen.
        camera: Intrinsics.
        seed: The corpus seed.
    """

    def __init__(self, config: SceneConfig, camera: Camera, seed: int) -> None:
        self.config = config
        self.camera = camera
        self.seed = seed
        self._renderer = RoomRenderer(camera)

    @property
    def description(self) -> str:
        """Which back end and device draws, in words."""
        return self._renderer.description

    def look(self, room: BuiltRoom, gathering: Gathering, eye: Eye) -> Seen:
        """Draws the scene and labels everybody."""
        T_camera_world = inverse(eye.T_world_camera)
        unseen = set(SURFACE_CLASSES) - set(self.config.room.surfaces)
        objects = (*room.items, *gathering.objects)
        people = [RenderPerson(one.member.person.mesh(), one.T_world_person) for one in gathering.people]
        is_near = room.may_show(T_camera_world, self.camera)
        things = [
            RenderObject(item.occluder.mesh, SCENE_CODE[item.occluder.class_name], k, item.T_world_object)
            for k, item in enumerate(objects, start=1)
            if item.occluder.class_name not in unseen and (k > len(is_near) or is_near[k - 1])
        ]
        drawn = self._renderer.render_room(T_camera_world, people, things)
        labels = tuple(
            measure_person(drawn, k, transform_points(T_camera_world, one.joints()), self.camera)
            for k, one in enumerate(gathering.people)
        )
        return Seen(room, gathering, eye, objects, drawn, labels)

    def is_worth_it(self, seen: Seen, is_first: bool = True) -> bool:
        """Whether a view is one that a camera would be put up for: far enough off, and somebody is seen.

        Args:
            seen: The view.
            is_first: Whether it is the first camera's; others need to show less of people.
        """
        depth = seen.drawn.depth
        n_close = np.count_nonzero((depth > 0) & (depth < CLOSE_MM))
        has_all = set(SURFACE_CLASSES) <= set(self.config.room.surfaces)
        if n_close > MAX_CLOSE_SHARE * depth.size:
            return False
        if has_all and np.count_nonzero(depth) < MIN_DEPTH_SHARE * depth.size:
            return False
        if not seen.labels:
            return True
        best = max(seen.labels, key=lambda label: label.n_seen)
        if not is_first:
            return best.n_seen >= MIN_SEEN_BY_OTHERS
        low, high = self.config.people.visible
        return best.n_seen >= MIN_SEEN_PIXELS and low <= best.visible_fraction <= high

    def frame(
        self,
        index: int,
        split: str,
        pose_ids: str,
        seen: Seen,
        moment: Moment | None = None,
        motions: Sequence[PersonMotion] = (),
    ) -> RoomFrame:
        """A frame of what is seen.

        Args:
            index: Its number in the corpus.
            split: Its split.
            pose_ids: Identifier of the drawn poses, to which each person's number is added.
            seen: What the camera sees.
            moment: Clip, time and view, of corpora that have them.
            motions: How each person moves, in clips.
        """
        n_before = len(seen.objects) - len(seen.gathering.objects)
        records, views = [], []
        for k, (one, labels) in enumerate(zip(seen.gathering.people, seen.labels, strict=True)):
            pose_id = one.member.person.pose.source_id or f"{pose_ids}/{k + 1}"
            seat = one.seat + n_before + 1 if one.seat >= 0 else 0
            records.append(_person_record(k + 1, one, pose_id, seat, labels))
            views.append(_person_view(seen, k, motions[k] if motions else None))
        info = RoomInfo(
            seed=self.seed,
            index=index,
            split=split,
            room_id=seen.room.room_id,
            room=seen.room.plain,
            people=tuple(records),
            objects=_object_records(seen, n_before),
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
            camera=self.camera,
            info=info,
            moment=moment,
        )


def _object_records(seen: Seen, n_before: int) -> tuple[ObjectRecord, ...]:
    """What a frame stores of the room's items, of which there are `n_before`, and of the people's objects."""
    fractions = np.zeros(len(seen.objects) + 1)
    measured = object_fractions(seen.drawn)
    fractions[: len(measured)] = measured
    of_room = tuple(
        replace(record, visible_fraction=float(fractions[k])) if fractions[k] > 0.0 else record
        for k, record in enumerate(seen.room.records, start=1)
    )
    of_people = tuple(
        record_of(item, k, float(fractions[k]))
        for k, item in enumerate(seen.gathering.objects, start=n_before + 1)
    )
    return (*of_room, *of_people)


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


def _person_view(seen: Seen, k: int, motion: PersonMotion | None) -> PersonView:
    one, body, labels = seen.gathering.people[k], seen.drawn.bodies[k], seen.labels[k]
    pose = one.member.person.pose
    return PersonView(
        box=body.box,
        body_depth=body.depth,
        body_part=body.part,
        joints=transform_points(inverse(seen.eye.T_world_camera), one.joints()).astype(np.float32),
        joint_state=labels.joint_state,
        joint_visible_fraction=labels.joint_visible_fraction,
        part_visible_fraction=labels.part_visible_fraction,
        angles=pose.angles.astype(np.float32),
        T_world_root=one.T_world_person @ pose.T_world_root,
        motion=motion,
    )
