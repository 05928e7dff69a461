"""A clip before anybody looks at it: the room, the cameras over time, and what everybody does."""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from synth.camera import Camera
from synth.geometry import inverse, transform_points
from synth.scene.bases import draw_arms_pose
from synth.scene.clips.actors import Actor, ActorDraw, Seated, sit_down_at
from synth.scene.clips.cameras import ROBOT_RADIUS, draw_move, eye_track
from synth.scene.clips.pushing import ACT as PUSH
from synth.scene.clips.pushing import PUSHING_SPEED, draw_pushing, keeps_from, keeps_from_eye, pushed
from synth.scene.clips.recorded import ACT, ARM_ROOM, N_PLACES, MotionMix, RecordedDraw
from synth.scene.clips.routes import Router
from synth.scene.config import SceneConfig
from synth.scene.draw import Person, SceneDraw
from synth.scene.families import draw_pose_family
from synth.scene.placement import PlacedObject, pose_on_floor
from synth.scene.pools import Subject
from synth.scene.room.arrange import Eye, distance_range, draw_eye, half_view
from synth.scene.room.groups import FACING
from synth.scene.room.occupancy import Occupancy, footprint
from synth.scene.room.rigs import further_eyes
from synth.scene.room.shell import BuiltRoom
from synth.scene.seating import seat_person
from synth.scene.soundness import Scene, is_sound

RATE = 60.0
"""Motion is sampled at least so often a second; a clip's rate is a divisor of its motion's."""
WALKING_RADIUS, WIDE_RADIUS = 0.2, 0.4
"""Half of the width of the way of a walker, and of one with a stroller, beside the room that furniture keeps [m]."""
APART = 0.62
"""Hips of two people, seen from above, are never nearer [m]."""
FROM_EYE = 0.75
"""Nobody comes nearer to a camera, seen from above [m]."""
IN_VIEW_SHARE = 0.7
"""Share of the places that people go to that are before the first camera."""
N_GOALS, N_LOOKED_AT = 10, 14
TRIES = 6
"""Of each person, before the clip is drawn anew."""
SITTING_FROM_BEGINNING = 0.5
LEAST_JOINTS = 8
"""A person is seen who has so many joints inside an image."""


@dataclass(frozen=True)
class Stage:
    """A clip.

    Attributes:
        room: The room.
        eyes: (n_views, n_steps, 4, 4) T_world_camera.
        actors: Everybody, in order of number.
        stride: Samples of the motions a time step.
    """

    room: BuiltRoom
    eyes: NDArray[np.float64]
    actors: tuple[Actor, ...]
    stride: int

    @property
    def seats(self) -> tuple[PlacedObject, ...]:
        """The seats that people have brought, in order of person."""
        return tuple(one.seat for one in self.actors if one.seat is not None)


class StageDraw:
    """Draws one clip.

    Args:
        draw: Where subjects and seats come from.
        room: The room.
        taken: What its furniture takes of the floor.
        camera: Intrinsics.
        motions: Recorded motions that some people make, if any are used.
    """

    def __init__(
        self,
        draw: SceneDraw,
        room: BuiltRoom,
        taken: Occupancy,
        camera: Camera,
        motions: MotionMix | None = None,
    ) -> None:
        self.draw, self.rng, self.config = draw, draw.rng, draw.config
        self.motions = motions if motions is not None and draw.split in motions.splits else None
        self.room, self.camera = room, camera
        self.floor = taken.copy()
        self.taken = taken
        self.stride = stride_of(self.config)

    def stage(self, n_people: int) -> Stage | None:
        """A clip with so many people; None if somebody finds no way, or a camera no place."""
        eye = draw_eye(self.config, self.room, self.floor, self.camera, self.rng)
        if eye is None:
            return None
        move = draw_move(self.config, self.rng)
        track = eye_track(move, eye, Router(self.floor, ROBOT_RADIUS), self.config.clip, self.config.fps, self.rng)
        if track is None:
            return None
        acts = self._draw_acts(n_people)
        seated = [self._seat(eye) for act in acts if act == "sit"]
        router = Router(self.floor, WALKING_RADIUS)
        actors: list[Actor] = []
        seats = iter(seated)
        talkers: list[Actor] = []
        if (n_talkers := acts.count("talk")) and not self._talk(n_talkers, eye, track, router, talkers):
            return None
        actors += talkers
        for k, act in enumerate(acts):
            if act == "talk":
                continue
            seat = next(seats) if act == "sit" else None
            if act == "sit" and seat is None:
                return None
            others = {ACT: self._recorded, PUSH: self._pusher}
            find = others.get(act, partial(self._find, seat))
            actor = find(eye, track, router, actors, len(acts) + k + 1)
            if actor is None:
                return None
            actors.append(actor)
        eyes = self._eyes(eye, track, actors)
        return None if eyes is None else Stage(self.room, eyes, tuple(actors), self.stride)

    def _draw_acts(self, n_people: int) -> list[str]:
        names = ("walk", "talk", "sit", PUSH)
        weights = np.array([getattr(self.config.acts, name) for name in names])
        drawn = self.rng.choice(len(names), n_people, p=weights / weights.sum())
        acts = [names[int(k)] for k in sorted(drawn)]
        if self.motions is None:
            return acts
        share = self.motions.share
        return [ACT if act in ("walk", "talk") and self.rng.random() < share else act for act in acts]

    def _eyes(self, eye: Eye, track: NDArray[np.float64], actors: list[Actor]) -> NDArray[np.float64] | None:
        """(n_views, n_steps, 4, 4) all cameras; None if one finds no place."""
        if self.config.cameras == 1:
            return track[None]
        places = [np.concatenate([one.places(), np.zeros((len(one.motion), 1))], axis=1) for one in actors]
        seats = tuple(one.seat for one in actors if one.seat is not None)
        more = further_eyes(self.config, self.room, self.taken, eye, seats, places, self.rng)
        if more is None:
            return None
        start = inverse(eye.T_world_camera)
        moved = [track @ (start @ other.T_world_camera) if self.config.rig == "stereo" else None for other in more]
        still = [np.tile(other.T_world_camera, (len(track), 1, 1)) for other in more]
        return np.stack([track, *(a if a is not None else b for a, b in zip(moved, still, strict=True))])

    def _places(self, eye: Eye, router: Router, n: int) -> NDArray[np.float64]:
        """(n, 2) places to go to, most of them before the camera; fewer if the room has none."""
        out = []
        low, high = distance_range(self.config)
        for _ in range(n):
            drawn = router.draw_free(N_LOOKED_AT, self.rng)
            way = drawn - eye.place
            turn = (np.arctan2(way[:, 1], way[:, 0]) - eye.heading + np.pi) % (2.0 * np.pi) - np.pi
            far = np.hypot(way[:, 0], way[:, 1])
            is_seen = (np.abs(turn) < half_view(self.camera)) & (far > max(low, FROM_EYE)) & (far < high)
            if is_seen.any() and self.rng.random() < IN_VIEW_SHARE:
                drawn = drawn[is_seen]
            out += list(drawn[:1])
        return np.array(out).reshape(-1, 2)

    def _find(
        self,
        seat: tuple[Subject, Seated] | None,
        eye: Eye,
        track: NDArray[np.float64],
        router: Router,
        others: list[Actor],
        group: int,
    ) -> Actor | None:
        """A walker, or who sits on a seat, who keeps out of everybody's way."""
        subject = self._walker() if seat is None else seat[0]
        seconds = self.config.clip / self.config.fps
        for _ in range(TRIES):
            drawing = ActorDraw(subject, router, seconds, self.stride * self.config.fps, self.rng)
            places = self._places(eye, router, N_GOALS)
            if len(places) < 2:
                return None
            if seat is None:
                actor = drawing.walker(places[0], places[1:], group)
            else:
                start = None if self.rng.random() < SITTING_FROM_BEGINNING else places[0]
                actor = drawing.sitter(seat[1], start, places[1:], group)
            if actor is not None and self._keeps_apart(actor, track, others):
                return actor
        return None

    def _pusher(
        self, eye: Eye, track: NDArray[np.float64], router: Router, others: list[Actor], group: int
    ) -> Actor | None:
        """Somebody who pushes a stroller, and keeps out of everybody's way."""
        seconds, rate = self.config.clip / self.config.fps, self.stride * self.config.fps
        wide, bare = Router(self.floor, WIDE_RADIUS), Router(self.floor, 0.0)
        for _ in range(TRIES):
            subject = self._walker()
            pushing = draw_pushing(self.draw, subject)
            if pushing is None:
                continue
            drawing = ActorDraw(subject, wide, seconds, rate, self.rng, pushing.pose)
            drawing.speed *= PUSHING_SPEED
            for _ in range(TRIES):
                places = self._places(eye, wide, 3)
                walked = drawing.pusher(places[0], places[1:], group) if len(places) == 3 else None
                if walked is None or not self._keeps_apart(walked[0], track, others):
                    continue
                actor = pushed(walked[0], pushing, walked[1], bare)
                if actor is None or not keeps_from_eye(actor, track, self.stride):
                    continue
                if keeps_from(actor, others, len(track), self.stride):
                    return actor
        return None

    def _recorded(
        self, eye: Eye, track: NDArray[np.float64], router: Router, others: list[Actor], group: int
    ) -> Actor | None:
        """Somebody who moves as recorded, and keeps out of everybody's way."""
        assert self.motions is not None
        rate = self.stride * self.config.fps
        seconds = ((self.config.clip - 1) * self.stride + 1) / rate
        arms = Router(self.floor, ARM_ROOM)
        drawing = RecordedDraw(self.motions, self.draw.split, seconds, rate, router, arms, self.rng)
        for _ in range(TRIES):
            subject = self._walker()
            found = drawing.motion(subject)
            if found is None:
                continue
            for place in self._places(eye, router, N_PLACES):
                actor = drawing.placed(subject, found, place, group)
                if actor is not None and self._keeps_apart(actor, track, others):
                    return actor
        return None

    def _walker(self) -> Subject:
        """Somebody on their feet; a long skirt, which would not give way to the legs, stays at home."""
        subject = self.draw.subject(is_seated=False)
        if subject.body.spec.bottom != "long_skirt":
            return subject
        return self.draw.pools.subject(self.draw.split, int(subject.subject_id.rsplit("/", 1)[1]), is_seated=True)

    def _keeps_apart(self, actor: Actor, track: NDArray[np.float64], others: list[Actor]) -> bool:
        places = actor.places()[:: self.stride][: len(track)]
        if np.hypot(*(places - track[:, :2, 3]).T).min() < FROM_EYE:
            return False
        ways = [places - other.places()[:: self.stride][: len(track)] for other in others]
        is_apart = all(np.hypot(*way.T).min() >= APART for way in ways)
        return is_apart and keeps_from(actor, others, len(track), self.stride)

    def _seat(self, eye: Eye) -> tuple[Subject, Seated] | None:
        """Somebody, and a seat on free floor with room to come to it."""
        for _ in range(TRIES):
            subject = self.draw.subject(is_seated=True)
            drawn = self._sitting(subject)
            if drawn is None:
                continue
            person, seat = drawn
            for _ in range(TRIES):
                places = self._places(eye, Router(self.floor, 0.0), 1)
                if not len(places):
                    return None
                yaw = float(self.rng.uniform(-np.pi, np.pi))
                T = pose_on_floor(float(places[0, 0]), float(places[0, 1]), yaw)
                placed = replace(seat, T_world_object=T @ seat.T_world_object)
                seated = sit_down_at(subject, person.pose, placed, T)
                if seated is None:
                    break
                if self._takes(placed, seated):
                    return subject, seated
        return None

    def _sitting(self, subject: Subject) -> tuple[Person, PlacedObject] | None:
        """How somebody sits, hands included, on a seat that they do not sink into; person frame."""
        family = draw_pose_family(self.draw, "sitting")
        found = seat_person(self.draw, subject, family)
        if found is None:
            return None
        arms = draw_arms_pose(self.draw, family, subject.body, found[0].pose)
        if arms is None:
            return None
        person = Person.in_pose(subject, arms)
        return (person, found[1]) if is_sound(Scene("sit", person, (found[1],)), self.config.clearance) else None

    def _takes(self, seat: PlacedObject, seated: Seated) -> bool:
        """Takes the floor of a seat, if that and the way to it are free."""
        prints = footprint(seat.world_surface())
        way = seated.place + np.linspace(0.0, 1.0, 8)[:, None] * (seated.approach - seated.place)
        router = Router(self.floor, WALKING_RADIUS)
        if not self.floor.is_free(prints) or not router.floor.is_free(way):
            return False
        self.floor.take(prints, 0.05)
        return Router(self.floor, WALKING_RADIUS).is_free(seated.approach)

    def _talk(
        self, n_people: int, eye: Eye, track: NDArray[np.float64], router: Router, talkers: list[Actor]
    ) -> bool:
        """People who stand on a circle and look at its middle, or anywhere if there is only one."""
        seconds = self.config.clip / self.config.fps
        subjects = [self._walker() for _ in range(n_people)]
        for _ in range(TRIES):
            middle = self._places(eye, router, 1)
            if not len(middle):
                return False
            radius = 0.0 if n_people == 1 else float(self.rng.uniform(*FACING)) / (2.0 * np.sin(np.pi / n_people))
            turned = float(self.rng.uniform(-np.pi, np.pi))
            found: list[Actor] = []
            for k, subject in enumerate(subjects):
                bearing = turned + 2.0 * np.pi * k / n_people
                place = middle[0] + radius * np.array([np.cos(bearing), np.sin(bearing)])
                if not router.is_free(place):
                    break
                drawing = ActorDraw(subject, router, seconds, self.stride * self.config.fps, self.rng)
                heading = bearing + np.pi + float(self.rng.normal(0.0, 0.2))
                actor = drawing.talker(place, heading, 1)
                if actor is None or not self._keeps_apart(actor, track, found):
                    break
                found.append(actor)
            else:
                talkers += found
                return True
        return False


def stride_of(config: SceneConfig) -> int:
    """Samples of motion a time step."""
    return max(1, int(np.ceil(RATE / config.fps)))


def steps_with_people(stage: Stage, camera: Camera, view: int, joints: NDArray[np.float64]) -> NDArray[np.int64]:
    """(n_steps,) how many people have joints inside the image of a camera, by time step.

    Args:
        stage: The clip.
        camera: Intrinsics.
        view: Number of the camera.
        joints: (n_people, n_steps, 15, 3) world [m].
    """
    out = np.zeros(len(stage.eyes[view]), np.int64)
    for step, T in enumerate(stage.eyes[view]):
        in_camera = transform_points(inverse(T), joints[:, step])
        z = in_camera[..., 2]
        uv = camera.project(np.where(z[..., None] > 0.3, in_camera, (0.0, 0.0, 1.0)))
        is_inside = (z > 0.3) & (uv >= 0).all(axis=-1) & (uv <= (camera.width - 1, camera.height - 1)).all(axis=-1)
        out[step] = int((is_inside.sum(axis=-1) >= LEAST_JOINTS).sum())
    return out
