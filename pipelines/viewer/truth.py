"""Frames of a corpus with their truth: labels, people, joints and what hides them, which way people face."""

import numpy as np
from numpy.typing import NDArray

from forests.frames import Intrinsics
from pipelines.corpus import Corpus
from pipelines.drawing import palette
from pipelines.errors import UserError
from pipelines.online.messages import NS, TrackSkeleton
from pipelines.viewer.moments import LEVEL, Arrow, Labels, Moment, standing
from synth.frame import Frame, RoomFrame
from synth.vocabulary import JOINT_NAMES, JointState

TRUTH = "truth"
"""Name of what skeletons of the truth come from."""
CROWN_M = 0.12
"""The top of a head is this far above its joint [m]."""
HIDDEN = (JointState.OCCLUDED, JointState.OCCLUDED_BY_PERSON, JointState.SELF_OCCLUDED)
_AT = {name: k for k, name in enumerate(JOINT_NAMES)}


class CorpusShow:
    """The frames of one camera of a corpus, in order of number.

    Attributes:
        fps: Of its clips, or a slow pace for frames that have nothing to do with one another.
    """

    def __init__(self, corpus: Corpus, sensor: str | None = None, view: int = 0) -> None:
        """Takes a corpus.

        Raises:
            UserError: It has no such camera, or is recorded and a sensor is given.
        """
        corpus.check_sensor(sensor)
        if not 0 <= view < corpus.header.cameras:
            raise UserError(f"view={view} must be in 0..{corpus.header.cameras - 1}")
        self._corpus, self._sensor = corpus, sensor
        numbers = corpus.indices
        if "view" in corpus.header.fields:
            numbers = numbers[corpus.arrays("view") == view]
        self._numbers = numbers
        told = float(corpus.header.config.get("scene", {}).get("fps", 0.0))
        self.fps = told if corpus.header.clip_steps and told > 0 else 2.0

    def __len__(self) -> int:
        """How many frames there are."""
        return len(self._numbers)

    def moment(self, number: int) -> Moment:
        """A frame with its truth."""
        index = int(self._numbers[number])
        if self._corpus.header.has_rooms:
            return self._scene(self._corpus.scene(index, self._sensor))
        return self._single(self._corpus.frame(index, self._sensor))

    def close(self) -> None:
        """Does nothing."""

    def _scene(self, frame: RoomFrame) -> Moment:
        numbered = [(one.number, view) for one, view in zip(frame.info.people, frame.people, strict=True)]
        T = np.asarray(frame.T_world_camera, np.float64)
        seen = [(k, view) for k, view in numbered if (view.joint_state != JointState.OUTSIDE).any()]
        words = f"frame {frame.info.index} of {frame.info.split}, {frame.info.room_id}"
        if frame.moment is not None:
            words += f", clip {frame.moment.clip}, step {frame.moment.time}, camera {frame.moment.view}"
        labels = {
            "objects and surfaces": Labels(frame.occluder, _rgb(palette.SCENE_COLOURS)),
            "body parts": Labels(frame.part, _rgb(palette.PART_COLOURS)),
            "people": Labels(frame.person, _rgb(palette.PERSON_COLOURS)),
        }
        places = [(k, _to_floor(T, view.joints), view.joint_state) for k, view in seen]
        return _moment(words, frame, T, labels, places)

    def _single(self, frame: Frame) -> Moment:
        info = frame.info
        words = f"frame {info.index} of {info.split}, {info.scene_family}, {info.pose_family}"
        T = LEVEL if self._corpus.header.is_recorded else np.asarray(frame.T_world_camera, np.float64)
        labels = {
            "body parts": Labels(frame.part, _rgb(palette.PART_COLOURS)),
            "objects": Labels(frame.occluder, _rgb(palette.CLASS_COLOURS)),
        }
        return _moment(words, frame, T, labels, [(1, _to_floor(T, frame.joints), frame.joint_state)])


def _moment(
    words: str,
    frame: RoomFrame | Frame,
    T_floor_camera: NDArray[np.float64],
    labels: dict[str, Labels],
    people: list[tuple[int, NDArray[np.float32], NDArray[np.uint8]]],
) -> Moment:
    camera = Intrinsics(frame.camera.fx, frame.camera.fy, frame.camera.cx, frame.camera.cy)
    skeletons, arrows, persons = [], [], []
    for number, joints, state in people:
        head = joints[_AT["head"]]
        if not np.isfinite(head).all():
            continue
        persons.append(standing(number, head[:2], float(head[2]) + CROWN_M))
        is_hidden = np.isin(state, HIDDEN).astype(np.float32)
        skeletons.append(true_skeleton(number, joints, is_hidden))
        ahead = facing_of(joints)
        if np.isfinite(ahead).all():
            arrows.append(Arrow(number, "body", ahead))
    return Moment(
        words, frame.depth, camera, T_floor_camera, labels, tuple(persons), tuple(skeletons), tuple(arrows)
    )


def true_skeleton(number: int, joints: NDArray[np.float32], is_hidden: NDArray[np.float32]) -> TrackSkeleton:
    """Joints (n_joints, 3) on the floor [m] that are known for sure."""
    n = len(joints)
    sure, exact = np.ones(n, np.float32), np.zeros(n, np.float32)
    return TrackSkeleton(NS, "world", number, TRUTH, JOINT_NAMES, joints, sure, exact, is_hidden)


def facing_of(joints: NDArray[np.float32]) -> NDArray[np.float64]:
    """(2,) float64 of length 1, where somebody faces by the line through hips and shoulders; NaN = not known."""
    across = np.zeros(2)
    for part in ("hip", "shoulder"):
        across = across + (joints[_AT[f"l_{part}"], :2] - joints[_AT[f"r_{part}"], :2])
    length = float(np.hypot(across[0], across[1]))
    return np.array([across[1], -across[0]], np.float64) / length if length > 1e-6 else np.full(2, np.nan)


def _to_floor(T_floor_camera: NDArray[np.float64], points: NDArray[np.float32]) -> NDArray[np.float32]:
    return np.asarray(points @ T_floor_camera[:3, :3].T + T_floor_camera[:3, 3], np.float32)


def _rgb(colours: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Red, green, blue of a table of blue, green, red."""
    return np.ascontiguousarray(colours[:, ::-1])
