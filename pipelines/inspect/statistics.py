"""What a corpus holds, in numbers: joints by state, visible shares, families, classes, distances, bearings."""

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipelines.corpus import Corpus
from pipelines.corpus.frameinfo import people_of
from pipelines.corpus.rooms.people import by_person
from pipelines.inspect.coverage import BEND_EDGES, Grid, bends_of, life_covered, views_grid
from synth.frame import FrameInfo, RoomInfo
from synth.vocabulary import JOINT_NAMES, JointState

_TORSO = JOINT_NAMES.index("torso")


@dataclass(frozen=True)
class Histogram:
    """Counts between edges.

    Attributes:
        edges: n + 1 rising values.
        counts: n counts; values outside the edges fall into the outer bins.
    """

    edges: list[float]
    counts: list[int]


@dataclass(frozen=True)
class Statistics:
    """A corpus in numbers.

    Attributes:
        n_frames: Frames counted.
        joint_states: Share of each joint's frames (of whole scenes: people) by state name, by joint name.
        visible_fraction: Share of each person that the composite shows.
        distance: Camera to torso joint, where it is known [m].
        azimuth: Bearing of the camera seen from the person [deg]; 0 in front, positive to their left.
        counts: Frames by name, for each of "split", "scene family", "pose family", "objects' classes" (frames
            that hold one) and "camera"; of whole scenes "room", "people", "group" and "activity" instead of
            "scene family".
        views: Frames by bearing and distance, where both are known.
        bends: How far limbs are bent, by name [deg].
        life_covered: Share of poses drawn from the model of recorded life that have a pose of the corpus near them,
            by posture; empty if the corpus does not tell joint angles.
        n_subjects: Different subjects.
        n_objects: Different objects by class.
    """

    n_frames: int
    joint_states: dict[str, dict[str, float]]
    visible_fraction: Histogram
    distance: Histogram
    azimuth: Histogram
    counts: dict[str, dict[str, int]]
    views: Grid
    bends: dict[str, Histogram]
    life_covered: dict[str, float]
    n_subjects: int
    n_objects: dict[str, int]


def statistics_of(corpus: Corpus) -> Statistics:
    """Counts every frame of a corpus; reads records and small arrays, no image."""
    infos = [corpus.record(int(i)) for i in corpus.indices]
    people = [one for info in infos for one in people_of(info)]
    states = by_person(corpus, "joint_state")
    T_world_root, T_world_camera = by_person(corpus, "T_world_root"), by_person(corpus, "T_world_camera")
    is_known = states[:, _TORSO] != JointState.UNKNOWN
    joints = by_person(corpus, "joints")
    distances = np.linalg.norm(joints[is_known, _TORSO], axis=1)
    bearings = camera_azimuth(T_world_root, T_world_camera)
    objects = {item.spec_id: item.class_name for info in infos for item in info.objects}
    return Statistics(
        n_frames=len(infos),
        joint_states={
            joint: {
                name: float((states[:, k] == state).sum() / max(1, len(states)))
                for state, name in enumerate(corpus.header.labels["joint_states"])
            }
            for k, joint in enumerate(JOINT_NAMES)
        },
        visible_fraction=histogram([one.visible_fraction for one in people], np.linspace(0, 1, 21)),
        distance=histogram(distances, np.arange(0.0, 6.01, 0.25)),
        azimuth=histogram(bearings, np.arange(-180, 181, 15)),
        counts={
            "split": _counted(info.split for info in infos),
            **_kinds(infos),
            "pose family": _counted(_among(infos, "pose_family")),
            "objects' classes": _counted(
                name for info in infos for name in {item.class_name for item in info.objects}
            ),
            "camera": _counted(corpus.camera(int(i)).name for i in corpus.indices),
        },
        views=views_grid(bearings[is_known], distances),
        bends={name: histogram(values, BEND_EDGES) for name, values in bends_of(joints, states).items()},
        life_covered=life_covered(corpus),
        n_subjects=len({one.subject_id for one in people}),
        n_objects=_counted(objects.values()),
    )


def _kinds(infos: Sequence[FrameInfo | RoomInfo]) -> dict[str, dict[str, int]]:
    """Frames by kind of scene; of whole scenes by room, number of people, and who is with whom."""
    rooms = [info for info in infos if isinstance(info, RoomInfo)]
    if not rooms:
        return {"scene family": _counted(info.scene_family for info in infos if isinstance(info, FrameInfo))}
    return {
        "room": _counted(str(info.room["kind"]) for info in rooms),
        "people": _counted(str(len(info.people)) for info in rooms),
        "group": _counted(_among(rooms, "group")),
        "activity": _counted(_among(rooms, "activity")),
    }


def _among(infos: Sequence[FrameInfo | RoomInfo], name: str) -> Iterator[str]:
    """What a frame's people do, each thing once a frame."""
    return (value for info in infos for value in sorted({getattr(one, name) for one in people_of(info)}))


def camera_azimuth(T_world_root: NDArray[np.float64], T_world_camera: NDArray[np.float64]) -> NDArray[np.float64]:
    """Bearing of the camera in the horizontal plane, seen from the person.

    Args:
        T_world_root: (n, 4, 4); the root's x axis points forward, y to the person's left.
        T_world_camera: (n, 4, 4).

    Returns:
        (n,) degrees in -180..180; 0 is in front, positive to the person's left.
    """
    to_camera = T_world_camera[:, :2, 3] - T_world_root[:, :2, 3]
    forward = T_world_root[:, :2, 0]
    ahead = (to_camera * forward).sum(axis=1)
    left = forward[:, 0] * to_camera[:, 1] - forward[:, 1] * to_camera[:, 0]
    return np.degrees(np.arctan2(left, ahead))


def histogram(values: Iterable[float] | NDArray, edges: NDArray) -> Histogram:
    """Counts values between edges, outer bins open."""
    array = np.asarray(list(values), dtype=np.float64)
    counts = np.histogram(np.clip(array, edges[0], edges[-1]), bins=edges)[0]
    return Histogram([float(edge) for edge in edges], [int(count) for count in counts])


def _counted(names: Iterable[str]) -> dict[str, int]:
    return dict(sorted(Counter(names).items(), key=lambda item: (-item[1], item[0])))
