"""What one person of a clip does: walks, stands and gestures, or sits for a while."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from synth.bodies.body import Pose
from synth.bodies.motion.compose import Plan, composed
from synth.bodies.motion.foot import foot_shapes
from synth.bodies.motion.gestures import draw_gesture
from synth.bodies.motion.itinerary import Footing, Itinerary, Stance, wrapped
from synth.bodies.motion.overlays import Sit
from synth.bodies.motion.record import Motion
from synth.bodies.poses.draw import draw_base
from synth.bodies.poses.landmarks import landmarks_of
from synth.bodies.rig.kinematics import link_transforms
from synth.bodies.skeleton import DOF_IDX, LINK_IDX
from synth.scene.clips.routes import Router
from synth.scene.placement import PlacedObject
from synth.scene.pools import Subject

SPEEDS = (0.65, 1.3)
"""Range of the speed of people who walk indoors, with legs of 0.9 m [m/s]; free walking outdoors is 1.2-1.4 m/s."""
NARROW, WIDE = 0.8, 1.15
"""Feet are so far apart, over the distance of the hip joints: of the slim, and of those with a mass index of 35."""
SHARP_TURN = np.radians(50.0)
"""Who has to turn more than this turns before walking off [rad]."""
PAUSES = (0.6, 3.5)
"""Range of the time that people stand between two walks [s]."""
GESTURE_SHARE = 0.6
"""Share of the pauses with a gesture."""
SIT_SECONDS, RISE_SECONDS = (1.5, 2.2), (1.3, 1.9)
"""Ranges of the time that sitting down and getting up take [s]; Kralj et al. (1990) measured 1.6-2.2 s."""
APPROACH = 0.4
"""People come to this far before where they will stand to sit down [m]."""
FLAT = np.cos(np.radians(7.0))
"""A foot stands flat whose sole is tilted less than this."""
MAX_PATHS = 8


@dataclass(frozen=True)
class Actor:
    """One person of a clip.

    Attributes:
        subject: Who.
        act: What they do, a name in `ActWeights`.
        motion: How they move over the clip, world frame.
        group: Who is in one group shares it, from 1.
        seat: What they sit on, or will; world frame.
        source_id: Identifier of the recorded motion; empty if theirs was drawn.
        item: What they move along with them, if anything.
        T_items: (n, 4, 4) where that is, world frame.
    """

    subject: Subject
    act: str
    motion: Motion
    group: int
    seat: PlacedObject | None = None
    source_id: str = ""
    item: PlacedObject | None = None
    T_items: NDArray[np.float64] | None = None

    def moved_item(self, k: int) -> PlacedObject | None:
        """What they move along, at a sample."""
        if self.item is None or self.T_items is None:
            return None
        return replace(self.item, T_world_object=self.T_items[k])

    def places(self) -> NDArray[np.float64]:
        """(n, 2) where the hips are, seen from above [m]."""
        return self.motion.T_world_root[:, :2, 3]

    def pose(self, k: int) -> Pose:
        """The pose at a sample, and where it comes from."""
        return replace(self.motion.pose(k), source_id=self.source_id)


@dataclass(frozen=True)
class Seated:
    """Someone on a seat, and how they get there.

    Attributes:
        pose: How they sit, world frame.
        seat: World frame.
        place: (2,) where they stand before they sit down [m].
        heading: Which way they face then [rad].
        feet: Where the feet stand, by side.
        person_pose: How they sit, person frame.
    """

    pose: Pose
    seat: PlacedObject
    place: NDArray[np.float64]
    heading: float
    feet: dict[str, Footing]
    person_pose: Pose

    @property
    def approach(self) -> NDArray[np.float64]:
        """(2,) where they come to first [m]."""
        return self.place + APPROACH * np.array([np.cos(self.heading), np.sin(self.heading)])


def feet_of(subject: Subject, pose: Pose) -> dict[str, Footing] | None:
    """Where the feet of a pose stand flat on the floor; None if one does not."""
    T = link_transforms(subject.body.skeleton, pose.angles, pose.T_world_root)
    shapes = foot_shapes(subject.body)
    out: dict[str, Footing] = {}
    for side in "lr":
        foot = T[LINK_IDX[f"{side}_ankle_inversion"]]
        if foot[2, 2] < FLAT or abs(foot[2, 3] - shapes[side].ankle) > 0.02:
            return None
        out[side] = (float(foot[0, 3]), float(foot[1, 3]), float(np.arctan2(foot[1, 0], foot[0, 0])))
    return out


def sit_down_at(subject: Subject, person_pose: Pose, seat: PlacedObject, T: NDArray[np.float64]) -> Seated | None:
    """A seated pose at a pose (4, 4) of the person frame in the world; None if the feet are not flat on the floor."""
    pose = Pose(person_pose.angles, T @ person_pose.T_world_root, person_pose.family)
    feet = feet_of(subject, pose)
    if feet is None:
        return None
    heading = float(np.arctan2(T[1, 0], T[0, 0]))
    middle = 0.5 * (np.array(feet["l"][:2]) + np.array(feet["r"][:2]))
    return Seated(pose, seat, middle, heading, feet, person_pose)


class ActorDraw:
    """Draws what one person does.

    Args:
        subject: Who.
        router: Where people can walk.
        seconds: How long the clip is [s].
        rate: Samples a second.
        rng: Source of randomness.
        base: How they stand at ease, person frame; drawn if none is given.
    """

    def __init__(
        self,
        subject: Subject,
        router: Router,
        seconds: float,
        rate: float,
        rng: np.random.Generator,
        base: Pose | None = None,
    ) -> None:
        self.subject = subject
        self.router = router
        self.seconds = seconds
        self.rate = rate
        self.rng = rng
        body = subject.body
        marks = landmarks_of(body)
        hip = abs(float(body.skeleton.offsets[DOF_IDX["l_hip_flexion"]][1]))
        stout = np.clip((body.spec.mass / body.spec.stature**2 - 20.0) / 15.0, 0.0, 1.0)
        half_width = hip * float(NARROW + (WIDE - NARROW) * stout)
        self.stance = Stance(marks.leg, half_width, float(np.radians(rng.uniform(2.0, 11.0))))
        self.speed = float(rng.uniform(*SPEEDS) * np.sqrt(marks.leg / 0.9))
        self.base = draw_base("standing", body, rng) if base is None else base

    def walker(self, start: NDArray[np.float64], goals: NDArray[np.float64], group: int) -> Actor | None:
        """Walks from a place to others, and stops there.

        Args:
            start: (2,) [m].
            goals: (n, 2) where to, in order [m].
            group: Number of the group.
        """
        plan = self._begin(start, float(self.rng.uniform(-np.pi, np.pi)))
        if self.rng.random() < 0.5:
            self._pause(plan)
        self._walk_about(plan, goals, self.seconds + float(self.rng.uniform(0.0, 4.0)))
        return self._actor(plan, "walk", group) if "walk" in plan.way.activity else None

    def pusher(
        self, start: NDArray[np.float64], goals: NDArray[np.float64], group: int
    ) -> tuple[Actor, NDArray[np.float64]] | None:
        """Walks straight to one place and then to another, arms anyhow.

        Args:
            start: (2,) [m].
            goals: (2, 2) where to [m].
            group: Number of the group.

        Returns:
            The person; and (n, 3) x, y [m] and heading [rad] of the way.
        """
        first = goals[0] - start
        plan = self._begin(start, float(np.arctan2(first[1], first[0])))
        plan.way.stay(0.3)
        for goal in goals:
            if self._walk_to(plan, goal):
                plan.way.stay(0.4)
        plan.way.stay(max(0.0, self.seconds + 0.2 - plan.way.seconds))
        ways = np.column_stack([np.concatenate(plan.way.places), np.concatenate(plan.way.headings)])
        kept, motion = self._cut(composed(plan, self.rng))
        return (Actor(self.subject, "push", motion, group), ways[kept]) if "walk" in motion.activity else None

    def talker(self, place: NDArray[np.float64], heading: float, group: int) -> Actor | None:
        """Stands at a (2,) place [m] with a heading [rad] and gestures."""
        plan = self._begin(place, heading)
        while plan.way.seconds < self.seconds + 2.0:
            self._pause(plan)
            if self.rng.random() < 0.25:
                step = self.rng.normal(0.0, 0.06, 2)
                plan.way.shift(place + step, heading + float(self.rng.normal(0.0, 0.25)), {}, "shift")
        return self._actor(plan, "talk", group)

    def sitter(
        self, seated: Seated, start: NDArray[np.float64] | None, goals: NDArray[np.float64], group: int
    ) -> Actor | None:
        """Sits for a while.

        Args:
            seated: How and where.
            start: (2,) where they come from; None for who sits from the beginning [m].
            goals: (n, 2) where they go when they get up [m].
            group: Number of the group.
        """
        if start is None:
            way = Itinerary(self.stance, self.rate, seated.place.copy(), seated.heading, dict(seated.feet))
            plan = Plan(self.subject.body, self.base, way)
            down = moment = -np.inf
        else:
            plan = self._begin(start, float(self.rng.uniform(-np.pi, np.pi)))
            if not self._walk_to(plan, seated.approach):
                return None
            plan.way.shift(seated.place, seated.heading, seated.feet)
            plan.way.stay(0.25)
            down = plan.way.seconds
            plan.way.stay(float(self.rng.uniform(*SIT_SECONDS)), "sit_down")
            moment = plan.way.seconds
        self._sit(plan, seated, down, moment, float(self.rng.uniform(0.25, 0.9)) * self.seconds + 1.0, goals)
        return self._actor(plan, "sit", group, seated.seat)

    def _sit(
        self, plan: Plan, seated: Seated, down: float, moment: float, lasting: float, goals: NDArray[np.float64]
    ) -> None:
        """Sits for a time, gets up, and goes to the first goal that there is a way to."""
        way, until = plan.way, plan.way.seconds + lasting
        while until - way.seconds > 0.5:
            self._pause(plan, seated.person_pose, min(float(self.rng.uniform(1.0, 5.0)), until - way.seconds))
        rise = way.seconds
        way.stay(float(self.rng.uniform(*RISE_SECONDS)), "get_up")
        plan.sits.append(Sit(down, moment, rise, way.seconds, seated.pose))
        way.stay(0.2)
        way.shift(seated.approach, seated.heading, {}, "walk")
        self._walk_about(plan, goals, self.seconds + float(self.rng.uniform(0.0, 2.0)))

    def _begin(self, place: NDArray[np.float64], heading: float) -> Plan:
        return Plan(self.subject.body, self.base, Itinerary(self.stance, self.rate, np.array(place), heading))

    def _walk_about(self, plan: Plan, goals: NDArray[np.float64], until: float) -> None:
        """Walks to one goal after another, with pauses, until a time; stands when there are no more ways."""
        for goal in goals:
            if plan.way.seconds >= until:
                return
            if self._walk_to(plan, goal):
                self._pause(plan)
        while plan.way.seconds < until:
            self._pause(plan)

    def _walk_to(self, plan: Plan, goal: NDArray[np.float64]) -> bool:
        """Turns towards a (2,) goal and walks there; False if there is no way, or it is there already."""
        way = plan.way
        path = self.router.path(way.place, goal)
        if path is None or np.hypot(*(path[-1] - path[0])) < 0.5:
            return False
        first = path[1] - path[0]
        bearing = float(np.arctan2(first[1], first[0]))
        if abs(wrapped(bearing - way.heading)) > SHARP_TURN:
            way.turn(bearing)
        way.walk(path, self.speed)
        return True

    def _pause(self, plan: Plan, seated: Pose | None = None, seconds: float | None = None) -> None:
        """Stands or sits for a while, often with a gesture."""
        way = plan.way
        lasting = float(self.rng.uniform(*PAUSES)) if seconds is None else seconds
        name = "stand" if seated is None else "sit"
        if self.rng.random() < GESTURE_SHARE:
            base = self.base if seated is None else seated
            drawn = draw_gesture(self.subject.body, base, way.seconds, lasting, self.rng, seated is not None)
            if drawn is not None:
                name = f"{name}_{drawn[0]}"
                plan.gestures.append(drawn[1])
        way.stay(lasting, name)

    def _actor(self, plan: Plan, act: str, group: int, seat: PlacedObject | None = None) -> Actor:
        """The part of the plan that the clip shows."""
        _, motion = self._cut(composed(plan, self.rng))
        return Actor(self.subject, act, motion, group, seat)

    def _cut(self, motion: Motion) -> tuple[slice, Motion]:
        """The samples of a motion that the clip shows, which begins anywhere in it."""
        n = round(self.seconds * self.rate) + 2
        first = int(self.rng.integers(max(len(motion) - n, 0) + 1))
        kept = slice(first, first + n)
        return kept, Motion(
            self.rate, motion.angles[kept], motion.T_world_root[kept], motion.contacts[kept], motion.activity[kept]
        )
