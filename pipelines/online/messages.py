"""What the parts of the on-line system tell one another: frozen records with stamp, frame and, of people, track."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from forests.boxes import Box
from forests.frames import Intrinsics

NS = 1_000_000_000
"""Stamps count nanoseconds; a second has so many."""


@dataclass(frozen=True)
class CameraFrame:
    """A depth image.

    Attributes:
        stamp: When it was taken [ns].
        frame_id: Name of the camera's frame of reference.
        depth: (height, width) uint16 [mm], 0 = nothing.
        camera: Intrinsics.
        T_world_camera: (4, 4) float64, where the camera is; None = not told.
        world_frame_id: Name of the frame of reference of that pose.
    """

    stamp: int
    frame_id: str
    depth: NDArray[np.uint16]
    camera: Intrinsics
    T_world_camera: NDArray[np.float64] | None = None
    world_frame_id: str = "world"


@dataclass(frozen=True)
class CameraPose:
    """Where the camera was.

    Attributes:
        stamp: Of the image [ns].
        frame_id: The frame of reference of the floor: z = 0 is the floor, z points up.
        camera_frame_id: The camera's frame of reference.
        T_floor_camera: (4, 4) float64, the camera in the former.
    """

    stamp: int
    frame_id: str
    camera_frame_id: str
    T_floor_camera: NDArray[np.float64]


@dataclass(frozen=True)
class Detection:
    """A person found in one image.

    Attributes:
        place: (2,) float64 on the floor, in the frame of reference of the message that holds it [m].
        height: Of the highest visible part above the floor [m]; NaN = not known.
        confidence: Probability that this is a person, 0..1.
        distance: From the camera, level [m].
        visible: Share of the person's height that is visible, 0..1.
        box: Of the person's pixels [px].
        upper_body: Of head and shoulders [px].
        axis: (3,) float64, the middle of the person at the height of the top, camera frame [m].
    """

    place: NDArray[np.float64]
    height: float
    confidence: float
    distance: float
    visible: float
    box: Box
    upper_body: Box
    axis: NDArray[np.float64]


@dataclass(frozen=True)
class Detections:
    """Everybody found in one image.

    Attributes:
        stamp: Of the image [ns].
        frame_id: The frame of reference of places: z = 0 is the floor, z points up.
        people: In any order.
    """

    stamp: int
    frame_id: str
    people: tuple[Detection, ...]


@dataclass(frozen=True)
class TrackedPerson:
    """Somebody who is followed over time.

    Attributes:
        track_id: Never given to anybody else.
        place: (2,) float64 on the floor [m].
        velocity: (2,) float64 [m/s].
        covariance: (4, 4) float64 of x, y and their velocities [m, m/s].
        height: Of the highest part that was seen lately, above the floor [m]; NaN = not known.
        confidence: Probability that this is a person, 0..1.
        age_s: Since the track began [s].
        unseen_s: Since it was last detected [s]; 0 = in this image.
        detection: In this image; None = not detected in it.
    """

    track_id: int
    place: NDArray[np.float64]
    velocity: NDArray[np.float64]
    covariance: NDArray[np.float64]
    height: float
    confidence: float
    age_s: float
    unseen_s: float
    detection: Detection | None


@dataclass(frozen=True)
class TrackedPersons:
    """Everybody who is followed, at one time.

    Attributes:
        stamp: Of the image [ns].
        frame_id: The frame of reference of places: z = 0 is the floor, z points up.
        persons: By track, rising.
    """

    stamp: int
    frame_id: str
    persons: tuple[TrackedPerson, ...]


@dataclass(frozen=True)
class Request:
    """A module is asked about one person in one image.

    Attributes:
        stamp: Of the image [ns].
        track_id: The person.
        module: Name of the module.
        box: Of the person's pixels [px].
        upper_body: Of head and shoulders [px].
        axis: (3,) float64, the middle of the person at the height of the top, camera frame [m].
    """

    stamp: int
    track_id: int
    module: str
    box: Box
    upper_body: Box
    axis: NDArray[np.float64]


@dataclass(frozen=True)
class Skip:
    """A module is not asked about a person in this image.

    Attributes:
        stamp: Of the image [ns].
        track_id: The person.
        module: Name of the module.
        reason: Why, in words.
    """

    stamp: int
    track_id: int
    module: str
    reason: str


@dataclass(frozen=True)
class Plan:
    """What the planner decided about one image.

    Attributes:
        stamp: Of the image [ns].
        requests: In order of priority.
        skips: Everybody else.
        spent_s: What the requests are expected to cost [s].
        budget_s: What they were allowed to cost [s].
    """

    stamp: int
    requests: tuple[Request, ...]
    skips: tuple[Skip, ...]
    spent_s: float
    budget_s: float


@dataclass(frozen=True)
class Result:
    """What a module answers about one person in one image.

    Attributes:
        stamp: Of the image [ns].
        frame_id: The camera's frame of reference.
        track_id: The person.
        module: Name of the module.
        seconds: What the answer cost [s].
    """

    stamp: int
    frame_id: str
    track_id: int
    module: str
    seconds: float


@dataclass(frozen=True)
class SkeletonResult(Result):
    """Where a person's joints are.

    Attributes:
        joints: Their names.
        positions: (n_joints, 3) float32, in the frame of reference [m]; NaN = not found.
        confidence: (n_joints,) float32, probability that a joint is within 10 cm; NaN = the model does not tell.
        deviation: (n_joints,) float32, standard deviation along each axis [m]; inf = not found.
        hidden: (n_joints,) float32, probability that something hides the joint; NaN = not told.
    """

    joints: tuple[str, ...]
    positions: NDArray[np.float32]
    confidence: NDArray[np.float32]
    deviation: NDArray[np.float32]
    hidden: NDArray[np.float32]


@dataclass(frozen=True)
class TrackSkeleton:
    """Where a person's joints are, smoothed over time; of one track alone.

    Attributes:
        stamp: Of the last image that was analysed [ns].
        frame_id: The frame of reference of the tracks' places.
        track_id: The person.
        module: Name of the module whose answers are smoothed.
        joints: Their names.
        positions: (n_joints, 3) float32 [m]; NaN = not known.
        confidence: (n_joints,) float32 of the last answer, as in `SkeletonResult`.
        deviation: (n_joints,) float32 of the last answer, as in `SkeletonResult`.
        hidden: (n_joints,) float32 of the last answer, as in `SkeletonResult`.
    """

    stamp: int
    frame_id: str
    track_id: int
    module: str
    joints: tuple[str, ...]
    positions: NDArray[np.float32]
    confidence: NDArray[np.float32]
    deviation: NDArray[np.float32]
    hidden: NDArray[np.float32]


@dataclass(frozen=True)
class OrientationResult(Result):
    """Which way a person faces.

    Attributes:
        region: body or head.
        angle: Heading of the body or pan of the head about the camera's y axis: 0 = towards the camera, pi / 2 =
            towards the image's right [rad].
        concentration: Kappa of the von Mises distribution about the angle.
        probability: That the angle is right to 22.5 degrees.
        posture: Name of the likeliest posture; empty = not told.
        posture_probability: Of that posture; NaN = not told.
    """

    region: str
    angle: float
    concentration: float
    probability: float
    posture: str
    posture_probability: float


@dataclass(frozen=True)
class Notice:
    """Something that went wrong and that the system went on after.

    Attributes:
        kind: The same for the same cause.
        sentence: What happened, told once for each kind.
    """

    kind: str
    sentence: str
